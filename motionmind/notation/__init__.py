"""Scores: text that a person writes, and the movement that it describes; docs/notation.md explains it."""
