"""Ensembles: several dancers on one stage, each with a piece, a place, a facing and an entry."""

NEAR_M = 0.7  # an arm's length: dancers who come nearer are worth a look
KEEP_RANGE_M = (0.01, 2.0)  # of the distance that `keeping` keeps
