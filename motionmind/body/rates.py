"""Rates and sizes of movement, light to import."""

from motionmind.errors import MotionMindError

MAX_FPS = 10_000.0  # frames per second; more is a typing error
# Frames per second of the slowest recording. With fewer, each frame counts as a chosen posture: films on twos have 12,
# and the fastest bundled score 12.5.
FILM_FPS = 15.0
# Frames times joints of a generated motion: an hour of human23 at 30 frames per second, about 800 MB.
MAX_POSITIONS = 3_000_000


def check_size(frames: float, joints: int, name: str) -> None:
    """Check that a motion is not too large to generate.

    Args:
        frames: number of frames, not necessarily an integer.
        joints: number of moving joints.
        name: the motion's name, for the message.

    Raises:
        MotionMindError: frames times joints exceed the limit.
    """
    if not frames * joints <= MAX_POSITIONS:
        raise MotionMindError(
            f"{name or 'motion'}: {frames:.15g} frames of {joints} joints are more than can be made at once, "
            f"{MAX_POSITIONS // joints} (a lower rate or a shorter part makes fewer)"
        )
