"""Variations of a piece: its postures in another order, the seams between them smoothed by the engine, and reviewed."""
