"""The dancers of a project: who dances its piece, where, from which count, and how their formation changes."""

from __future__ import annotations

from itertools import combinations
from math import hypot
from typing import Annotated, Literal, NamedTuple, TypeAlias

import msgspec
from msgspec.structs import replace

from motionmind.display import displayed
from motionmind.ensemble.reading import COUNT_TOLERANCE, MAX_CHANGES, MAX_DANCERS, SAME_SPOT_M, SPACING_M
from motionmind.errors import MotionMindError

DancerId = Annotated[str, msgspec.Meta(pattern=r"^[A-Za-z0-9_.-]{1,40}\Z")]
DancerName = Annotated[str, msgspec.Meta(min_length=1, max_length=100)]
Count = Annotated[float, msgspec.Meta(ge=1.0, le=1e5)]  # the first count of a piece is 1
Coordinate = Annotated[float, msgspec.Meta(ge=-1000.0, le=1000.0)]  # metres


class _Struct(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A value in an edit."""


class _Edit(msgspec.Struct, frozen=True, tag_field="edit", forbid_unknown_fields=True):
    """An edit of the dancers."""


class Dancer(_Struct, frozen=True):
    """A dancer of the piece.

    Attributes:
        id: its name in the project.
        name: its name for people; names differ.
        place: where it begins, x and z, metres.
        facing: by how much it is turned to the left of the audience, degrees.
        entry: the count at which it begins.
        mirrored: whether left and right are exchanged.
        source: key of a movement of its own, which the project holds; "" for the piece.
    """

    id: DancerId
    name: DancerName
    place: tuple[Coordinate, Coordinate] = (0.0, 0.0)
    facing: Annotated[float, msgspec.Meta(ge=-3600.0, le=3600.0)] = 0.0
    entry: Count = 1.0
    mirrored: bool = False
    source: Annotated[str, msgspec.Meta(pattern=r"^(m-[0-9a-f]{16})?\Z")] = ""


class Change(_Struct, frozen=True):
    """A change of formation: all go to the places of a formation, or some to places of their own.

    Attributes:
        at: the count at which they set out.
        counts: for how many counts they go; their pieces wait.
        formation: the formation; None for `places`.
        spacing: distance between neighbours in the formation, metres.
        places: the places to take, x and z, metres, by the dancers' ids; all others stay.
    """

    at: Count
    counts: Annotated[float, msgspec.Meta(gt=0.0, le=1e4)]
    formation: Literal["line", "circle", "V", "grid"] | None = None
    spacing: Annotated[float, msgspec.Meta(gt=0.0, le=100.0)] = SPACING_M
    places: Annotated[dict[DancerId, tuple[Coordinate, Coordinate]], msgspec.Meta(max_length=MAX_DANCERS)] = {}


class PutDancer(_Edit, frozen=True, tag="dancer"):
    """Add a dancer, or replace the one with its id."""

    dancer: Dancer


class RemoveDancer(_Edit, frozen=True, tag="dismiss"):
    """Remove a dancer and its places in changes of formation; without dancers, there are no changes."""

    dancer: DancerId


class SetFormations(_Edit, frozen=True, tag="formations"):
    """Replace all changes of formation.

    Attributes:
        changes: the changes, in order, none before the last has ended.
    """

    changes: Annotated[tuple[Change, ...], msgspec.Meta(max_length=MAX_CHANGES)]


CastEdit: TypeAlias = PutDancer | RemoveDancer | SetFormations


class Cast(NamedTuple):
    """The dancers, in order, and their changes of formation; without dancers, one body dances the piece."""

    dancers: tuple[Dancer, ...] = ()
    changes: tuple[Change, ...] = ()


def recast(cast: Cast, edit: CastEdit) -> Cast:
    """Return the dancers after an edit of them.

    Raises:
        MotionMindError: there is no such dancer, two have one name or begin on one spot, there are too many, or a
            change begins before the last one has ended.

    >>> from motionmind.studio.dancers import Cast, Dancer, PutDancer, recast
    >>> cast = recast(Cast(), PutDancer(Dancer("d1", "Anna")))
    >>> recast(cast, PutDancer(Dancer("d1", "Ann", entry=9.0))).dancers[0].entry
    9.0
    """
    match edit:
        case PutDancer(dancer):
            known = any(one.id == dancer.id for one in cast.dancers)
            others = tuple(dancer if one.id == dancer.id else one for one in cast.dancers)
            return cast._replace(dancers=_checked(others if known else (*others, dancer)))
        case RemoveDancer(name):
            if all(one.id != name for one in cast.dancers):
                raise MotionMindError("this dancer is no longer there")
            left = tuple(one for one in cast.dancers if one.id != name)
            return Cast(left, tuple(_without(name, change) for change in cast.changes) if left else ())
        case SetFormations(changes):
            last = 1.0
            for number, change in enumerate(changes, start=1):
                if change.at < last - COUNT_TOLERANCE:
                    raise MotionMindError(
                        f"change {number} of formation begins at count {change.at:g}, before the last one has ended, "
                        f"at {last:g}"
                    )
                last = change.at + change.counts
            return cast._replace(changes=changes)


def described(edit: CastEdit) -> str:
    """Describe an edit of the dancers in a few words."""
    match edit:
        case PutDancer(dancer):
            return f"change the dancer {displayed(dancer.name)}"
        case RemoveDancer():
            return "remove a dancer"
        case SetFormations():
            return "change the formations"


def cast_places(edit: CastEdit) -> str:
    """Return the part of the project that an edit of the dancers changes, as `edits.touched` has it."""
    match edit:
        case PutDancer(Dancer(id=name)) | RemoveDancer(name):
            return f"/dancer/{name}"
        case SetFormations():
            return "/formations"


def cast_differences(before: Cast, now: Cast) -> list[str]:
    """Describe how the dancers differ from those of a version, in a few words each; nothing if they do not."""
    old, new = ({one.id: one for one in cast.dancers} for cast in (before, now))
    count = sum(old.get(name) != new.get(name) for name in {*old, *new})
    words = [f"{count} dancer{'s' * (count != 1)} changed"] * bool(count)
    return words + ["formations changed"] * (before[1:] != now[1:])


def _without(dancer: str, change: Change) -> Change:
    """Return a change of formation without the place of a dancer."""
    return replace(change, places={name: place for name, place in change.places.items() if name != dancer})


def _checked(dancers: tuple[Dancer, ...]) -> tuple[Dancer, ...]:
    if len(dancers) > MAX_DANCERS:
        raise MotionMindError(f"a piece has at most {MAX_DANCERS} dancers")
    for one, other in combinations(dancers, 2):
        if one.name == other.name:
            raise MotionMindError(f"two dancers are named {displayed(one.name)}")
        if hypot(one.place[0] - other.place[0], one.place[1] - other.place[1]) < SAME_SPOT_M:
            x, z = one.place
            raise MotionMindError(f"{displayed(one.name)} and {displayed(other.name)} begin on one spot, {x:g}, {z:g}")
    return dancers
