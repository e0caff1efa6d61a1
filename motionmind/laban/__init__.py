"""Labanotation: scores as signs on a staff, drawn, written as text, and read back into scores."""

DRAWINGS = (".svg", ".png", ".pdf")
LABAN_SUFFIX = ".laban"
MAX_BAR_COUNTS = 64
