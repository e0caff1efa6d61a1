"""Corpora: clips of movement with their provenance, gathered from recordings, in memory and on disk."""
