"""A corpus: clips of movement with their provenance, in memory and on disk."""
