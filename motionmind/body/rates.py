"""Rates of movement, light to import."""

FASTEST = 10_000.0  # frames a second; faster is a slip of the keyboard
# Frames a second of the slowest recording. Of fewer, each is taken as a posture that someone chose: films on twos have
# 12, and the quickest score that comes with MotionMind 12.5.
FILM_RATE = 15.0
