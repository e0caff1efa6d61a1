"""Realising a path of states as a motion: in its own time, as walks expect, on its feet, its limbs apart."""
