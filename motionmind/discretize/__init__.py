"""Orientations to states and back."""
