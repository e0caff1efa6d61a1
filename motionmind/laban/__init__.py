"""Labanotation: scores as signs on a staff, drawn, written as text, and read back into scores."""
