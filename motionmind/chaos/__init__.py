"""Variations by chaos: a piece wrapped around a strange attractor and read along another trajectory."""
