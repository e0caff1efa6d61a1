"""Rates of movement, light to import."""

FASTEST = 10_000.0  # frames a second; faster is a slip of the keyboard
