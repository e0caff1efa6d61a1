"""Rotations, splines and distances between postures, as free functions over plain arrays; knows no bodies."""
