"""A choreographer's requests for an insertion: postures to pass, hands and feet to hold, places, and a path."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

MAX_INSERTION_S = 600.0
MAX_DRAWN_POINTS = 64  # of a path; the user can drag each

Key = Annotated[str, msgspec.Meta(min_length=1, max_length=400)]  # of a movement
Name = Annotated[str, msgspec.Meta(min_length=1, max_length=200)]
Frame = Annotated[int, msgspec.Meta(ge=0, lt=2**31)]
Hold = Literal["start", "end", "throughout", "place"]
Share = Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]
Metres = Annotated[float, msgspec.Meta(ge=-100.0, le=100.0)]
Degrees = Annotated[float, msgspec.Meta(ge=-360.0, le=360.0)]


class _Struct(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A value in an edit."""


class Passing(_Struct, frozen=True):
    """A posture that an insertion passes through: a frame of a movement."""

    posture: Key
    frame: Frame = 0


class Pin(_Struct, frozen=True):
    """A hand or a foot that stays during an insertion: in its limb's posture, or in place in the room.

    Attributes:
        joint: the joint at the limb's end.
        hold: "start" if the limb keeps its posture of the start until the end, "end" if it takes its posture of the end
            at once, "throughout" if both ends agree and it keeps its posture; "place" if the hand or foot keeps its
            place in the room and the limb compensates.
        begins: share of the insertion's time at which "place" begins.
        ends: share at which it ends, more than `begins`.
    """

    joint: Name
    hold: Hold = "start"
    begins: Share = 0.0
    ends: Share = 1.0

    def __post_init__(self) -> None:
        """Check that `begins` is less than `ends`."""
        if self.begins >= self.ends:
            raise ValueError(f"begins must be less than ends, not {self.begins:g} and {self.ends:g}")


class Reach(_Struct, frozen=True):
    """A place for a hand or a foot at a time of an insertion.

    Attributes:
        joint: the joint at the limb's end.
        place: x, y and z, metres: to the left, up and ahead of the floor under the insertion's first posture.
        at: time from the insertion's start, seconds.
    """

    joint: Name
    place: tuple[Metres, Metres, Metres]
    at: Annotated[float, msgspec.Meta(gt=0.0, le=MAX_INSERTION_S)]


class Travel(_Struct, frozen=True):
    """A path over the floor for an insertion, or the place where it ends.

    Attributes:
        points: x and z of each point, metres, to the left and ahead of the insertion's first posture. It ends
            on the last; with several, it follows the straight lines from that posture through all of them.
        facing: where the body faces at the end, degrees to the left of its first posture (of the audience, if the
            corpus's dancers face it); None for where it does anyway.
    """

    points: Annotated[tuple[tuple[Metres, Metres], ...], msgspec.Meta(min_length=1, max_length=MAX_DRAWN_POINTS)]
    facing: Degrees | None = None


class Ask(_Struct, frozen=True):
    """A request for a seam's insertion.

    Attributes:
        seconds: its duration; None leaves that to the engine.
        passing: postures to pass through, in this order.
        pins: hands and feet that stay.
        reaches: places for hands and feet at given times.
        travel: a path over the floor; None for any.
    """

    seconds: Annotated[float, msgspec.Meta(gt=0.0, le=MAX_INSERTION_S)] | None = None
    passing: Annotated[tuple[Passing, ...], msgspec.Meta(max_length=20)] = ()
    pins: Annotated[tuple[Pin, ...], msgspec.Meta(max_length=20)] = ()
    reaches: Annotated[tuple[Reach, ...], msgspec.Meta(max_length=20)] = ()
    travel: Travel | None = None
