"""Ensembles: several dancers on one stage, each with a piece, a place, a facing and an entry."""

KEEP_RANGE_M = (0.01, 2.0)  # of the distance that `keeping` keeps
