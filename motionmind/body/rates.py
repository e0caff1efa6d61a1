"""Rates and sizes of movement, light to import."""

from motionmind.errors import MotionMindError

FASTEST = 10_000.0  # frames a second; faster is a slip of the keyboard
# Frames a second of the slowest recording. Of fewer, each is taken as a posture that someone chose: films on twos have
# 12, and the quickest score that comes with MotionMind 12.5.
FILM_RATE = 15.0
# Frames times joints of a motion that is made, not read: an hour of human23 at 30 frames a second, and some 800 MB.
MOST_PLACES = 3_000_000


def check_size(frames: float, joints: int, name: str) -> None:
    """Check, before memory is taken, that a motion may be made.

    Args:
        frames: its frames; any number.
        joints: the joints that move in each.
        name: what to call it.

    Raises:
        MotionMindError: there are too many frames for so many joints.
    """
    if not frames * joints <= MOST_PLACES:
        raise MotionMindError(
            f"{name or 'motion'}: {frames:.15g} frames of {joints} joints are more than can be made at once, "
            f"{MOST_PLACES // joints} (a lower rate or a shorter part makes fewer)"
        )
