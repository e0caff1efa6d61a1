"""Every colour of pictures, pages and plots: sRGB, 0 to 255."""

from __future__ import annotations

from dataclasses import dataclass

from motionmind.body.mirror import LEFT, MIDDLE, RIGHT
from motionmind.body.palette import FRONT_COLOUR, SIDE_COLOURS, Colour

FACE, HAIR, MARK = "face", "hair", "mark"  # paints of a body, beside its sides

# Bodies, by paint: given movement, and movement that the engine inserted (violet, the left still warmer).
COLOURS: dict[str, Colour] = {**SIDE_COLOURS, FACE: (244, 216, 190), HAIR: (84, 70, 62), MARK: FRONT_COLOUR}
INSERTED: dict[str, Colour] = COLOURS | {LEFT: (190, 95, 130), RIGHT: (95, 105, 195), MIDDLE: (140, 90, 200)}
VIOLET: Colour = INSERTED[MIDDLE]  # insertions, on timelines and in text
BRIDGED: Colour = (20, 190, 120)  # balls around joints during a move that no corpus attests
INK: Colour = (34, 30, 34)  # outlines of body parts; text of plots
PAPER: Colour = (252, 251, 249)  # of films and plots


@dataclass(frozen=True)
class StageColours:
    """The stage of films and stills; `pale` is for secondary text."""

    ground: Colour = (234, 230, 224)
    grid: Colour = (217, 212, 205)
    shadow: Colour = (52, 44, 60)
    text: Colour = (40, 38, 40)
    pale: Colour = (140, 135, 132)
    timeline: Colour = (224, 220, 215)


@dataclass(frozen=True)
class SheetColours:
    """Contact sheets; `pale` is for secondary text.

    Attributes:
        plumb: the centre of mass, and the line from it to the floor.
        sunk: body parts below the floor.
    """

    paper: Colour = (255, 255, 255)
    floor: Colour = (120, 116, 112)
    ground: Colour = (240, 237, 233)
    frame: Colour = (214, 210, 206)
    text: Colour = StageColours.text
    pale: Colour = (118, 114, 112)
    plumb: Colour = (30, 140, 90)
    sunk: Colour = (214, 0, 132)


@dataclass(frozen=True)
class PlotColours:
    """Plots; `pale` is for secondary text and axes.

    Attributes:
        grid: faint lines at the ticks of an axis.
        state, stays, transition: a joint graph's states, how likely each stays, and its transitions.
        piece, variation: both trajectories on an attractor, distinct for every kind of colour vision, and unlike
            the colours of bodies.
        cell: a cell of the attractor.
        edge: borders of cells, and axes.
    """

    pale: Colour = (110, 106, 104)
    grid: Colour = StageColours.grid
    state: Colour = (58, 104, 160)
    stays: Colour = (214, 158, 66)
    transition: Colour = (40, 46, 60)
    piece: Colour = (0, 112, 120)
    variation: Colour = (206, 112, 0)
    cell: Colour = (240, 237, 232)
    edge: Colour = (158, 151, 144)


STAGE, SHEET, PLOT = StageColours(), SheetColours(), PlotColours()

# Names, paths and trunks of dancers, in their order: Okabe and Ito's colours, distinct for every kind of colour vision;
# first those unlike the colours of limbs and of inserted movement.
_DANCERS: tuple[Colour, ...] = (
    (0, 128, 96),
    (120, 94, 0),
    (40, 40, 40),
    (160, 70, 130),
    (0, 114, 178),
    (213, 94, 0),
)


def dancer_ink(number: int) -> Colour:
    """Return the colour of a dancer's name, path and trunk; after six they repeat."""
    return _DANCERS[number % len(_DANCERS)]
