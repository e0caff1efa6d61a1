"""Chaotic reordering: a piece is wrapped around a strange attractor and read along another trajectory."""
