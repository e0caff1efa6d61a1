"""The colours of a body's sides, the same in every picture and in files for other programs.

sRGB, 0 to 255. Left is warm, right is cool, the trunk is neutral, and what shows the front is yellow.
"""

from __future__ import annotations

from collections.abc import Mapping

from motionmind.body.mirror import LEFT, MIDDLE, RIGHT

Colour = tuple[int, int, int]

SIDE_COLOURS: Mapping[str, Colour] = {LEFT: (222, 98, 66), RIGHT: (62, 118, 190), MIDDLE: (168, 164, 160)}
FRONT_COLOUR: Colour = (255, 226, 120)
