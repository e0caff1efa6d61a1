"""Every colour of pictures, pages and plots: sRGB, 0 to 255."""

from __future__ import annotations

from motionmind.body.mirror import LEFT, MIDDLE, RIGHT
from motionmind.body.palette import FRONT_COLOUR, SIDE_COLOURS, Colour

FACE, HAIR, MARK = "face", "hair", "mark"  # paints of a body, beside its sides

# Bodies, by paint: as given, and where the engine inserted the movement (violet, left still warmer than right).
COLOURS: dict[str, Colour] = {**SIDE_COLOURS, FACE: (244, 216, 190), HAIR: (84, 70, 62), MARK: FRONT_COLOUR}
INSERTED: dict[str, Colour] = COLOURS | {LEFT: (190, 95, 130), RIGHT: (95, 105, 195), MIDDLE: (140, 90, 200)}
BRIDGED: Colour = (20, 190, 120)  # balls around joints amid a move that no corpus attests
INK: Colour = (34, 30, 34)  # lines around a body's parts; words of plots

# The stage of films and stills.
PAPER: Colour = (252, 251, 249)
GROUND: Colour = (234, 230, 224)
GRID: Colour = (217, 212, 205)
SHADOW: Colour = (52, 44, 60)
TEXT: Colour = (40, 38, 40)
FILM_PALE: Colour = (140, 135, 132)  # words of less weight
TRACK: Colour = (224, 220, 215)  # the timeline
VIOLET: Colour = INSERTED[MIDDLE]  # insertions, on the timeline and in words

# Contact sheets.
SHEET_PAPER: Colour = (255, 255, 255)
SHEET_FLOOR: Colour = (120, 116, 112)
SHEET_GROUND: Colour = (240, 237, 233)
SHEET_FRAME: Colour = (214, 210, 206)
SHEET_PALE: Colour = (118, 114, 112)  # words of less weight
PLUMB: Colour = (30, 140, 90)  # the centre of mass, and the line from it to the floor
SUNK: Colour = (214, 0, 132)  # body parts under the floor

# Plots.
PLOT_PALE: Colour = (110, 106, 104)  # words of less weight, and axes
STATE: Colour = (58, 104, 160)  # a joint graph's states, how likely each stays, and its transitions
STAYS: Colour = (214, 158, 66)
TRANSITION: Colour = (40, 46, 60)
# Both trajectories on an attractor: easy to tell apart whatever colours a viewer sees, and neither a body's nor violet.
PIECE: Colour = (0, 112, 120)
VARIATION: Colour = (206, 112, 0)
CELL: Colour = (240, 237, 232)
EDGE: Colour = (158, 151, 144)  # borders of cells, and axes

# Charts: one colour a series.
SERIES: tuple[Colour, ...] = (
    (31, 111, 139),
    (192, 86, 42),
    (91, 140, 58),
    (125, 79, 158),
    (176, 138, 30),
    (68, 68, 68),
    (208, 85, 143),
    (46, 156, 143),
)
