"""Ensemble files, in TOML: the dancers, and what they have in common."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

import msgspec
import numpy as np

from motionmind._typing import Floats
from motionmind.body.motion import Motion
from motionmind.display import displayed
from motionmind.ensemble.changes import assigned, send, whereabouts
from motionmind.ensemble.dancers import Dancer, Ensemble
from motionmind.ensemble.formations import places_in
from motionmind.errors import FormatError, did_you_mean
from motionmind.files import parse_toml, read_bytes
from motionmind.tween.counts import TEMPO_RANGE_BPM, counts_to_seconds

SPACING_M = 1.5  # between neighbours in a formation, unless the file says otherwise
MAX_DANCERS = 100
MAX_CHANGES = 100  # of formation
COUNT_TOLERANCE = 1e-6  # by which a change may begin before the last one has ended: rounding
SAME_SPOT_M = 0.05  # two dancers who begin closer than this stand on one spot

_Metres = Annotated[float, msgspec.Meta(ge=-1000.0, le=1000.0)]
_Side = Annotated[float, msgspec.Meta(ge=1.0, le=200.0)]
_Count = Annotated[float, msgspec.Meta(ge=1.0, le=1e5)]
_Name = Annotated[str, msgspec.Meta(min_length=1, max_length=100)]
_Piece = Annotated[str, msgspec.Meta(min_length=1, max_length=4_096)]  # or its path
_Formation = Literal["line", "circle", "V", "grid"]
_Spacing = Annotated[float, msgspec.Meta(gt=0.0, le=100.0)]
_Degrees = Annotated[float, msgspec.Meta(ge=-3600.0, le=3600.0)]


class _Dancer(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A table `[[dancer]]`; None where the ensemble's own value, or its formation, applies."""

    name: _Name | None = None
    piece: _Piece | None = None
    place: tuple[_Metres, _Metres] | None = None
    facing: _Degrees | Literal["centre", "each other"] | None = None
    mirrored: bool | None = None
    entry: _Count | None = None


class _Change(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A table `[[change]]`: all go to the places of a formation, or each to one that is given."""

    at: _Count
    counts: Annotated[float, msgspec.Meta(gt=0.0, le=1e4)]
    formation: _Formation | None = None
    spacing: _Spacing | None = None
    places: list[tuple[_Metres, _Metres]] | None = None


class _File(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An ensemble file."""

    dancer: Annotated[list[_Dancer], msgspec.Meta(min_length=1, max_length=MAX_DANCERS)]
    piece: _Piece | None = None
    tempo: Annotated[float, msgspec.Meta(ge=TEMPO_RANGE_BPM[0], le=TEMPO_RANGE_BPM[1])] | None = None
    piece_tempo: Annotated[float, msgspec.Meta(ge=TEMPO_RANGE_BPM[0], le=TEMPO_RANGE_BPM[1])] | None = None
    stage: tuple[_Side, _Side] | None = None
    formation: _Formation = "line"
    spacing: _Spacing = SPACING_M
    facing: _Degrees | Literal["centre", "each other"] = 0.0
    canon: Annotated[float, msgspec.Meta(ge=0.0, le=1e4)] = 0.0
    unison: bool = False
    mirror: bool = False
    change: Annotated[list[_Change], msgspec.Meta(max_length=MAX_CHANGES)] = []


def read_ensemble(path: Path, read: Callable[[str], Motion]) -> Ensemble:
    """Read an ensemble file.

    Args:
        path: the file; docs/formats.md describes its keys.
        read: reads the movement of a piece, by its name or by its path from the file's folder.

    Raises:
        FormatError: the file is not TOML, or a value in it is unknown or out of range.
        MotionMindError: a piece cannot be read.
    """
    try:
        file = msgspec.convert(parse_toml(read_bytes(path).decode("utf-8-sig").replace("\r\n", "\n")), _File)
    except (ValueError, RecursionError) as error:  # msgspec's errors are ValueErrors
        raise FormatError(f"{path}: {displayed(str(error), 300)}{_hint(str(error))}") from error
    if file.tempo is None and (file.canon or file.change or any(one.entry for one in file.dancer)):
        raise FormatError(f"{path}: canon, entry and change are in counts, and need a tempo")
    if file.tempo is None and file.piece_tempo is not None:
        raise FormatError(f"{path}: piece_tempo is the tempo of the pieces, and needs the tempo to dance them in")
    if file.unison and (file.canon or any(one.entry for one in file.dancer)):
        raise FormatError(f"{path}: in unison all begin together: leave out canon and entry")
    names = [one.name or f"dancer {number}" for number, one in enumerate(file.dancer, start=1)]
    twice = next((name for i, name in enumerate(names) if name in names[:i]), None)
    if twice is not None:
        raise FormatError(f"{path}: two dancers are named {displayed(twice)}")
    places = _places(path, file, names)
    pieces: dict[str, Motion] = {}
    ratio = file.piece_tempo / file.tempo if file.piece_tempo and file.tempo else 1.0
    dancers = []
    for i, (one, name) in enumerate(zip(file.dancer, names, strict=True)):
        piece = one.piece or file.piece
        if piece is None:
            raise FormatError(f"{path}: {displayed(name)} has no piece, and the ensemble has none for all")
        if piece.lower().endswith(".toml") and (path.parent / piece).resolve() == path.resolve():
            raise FormatError(f"{path}: {displayed(name)} dances {displayed(piece)}, the ensemble itself")
        if piece.lower().endswith(".toml"):
            raise FormatError(f"{path}: {displayed(piece)} is an ensemble; the piece of a dancer is one movement")
        if piece not in pieces:
            pieces[piece] = _stretched(read(piece), ratio)
        count = 1.0 + i * file.canon if one.entry is None else one.entry
        facing = _facing(file.facing if one.facing is None else one.facing, places, i)
        place = float(places[i, 0]), float(places[i, 1])
        entry = counts_to_seconds(count - 1.0, file.tempo or 60.0)
        is_mirrored = file.mirror and place[0] > SAME_SPOT_M if one.mirrored is None else one.mirrored
        dancers.append(Dancer(name, pieces[piece], place, facing, entry, is_mirrored, source=piece))
    return Ensemble(path.stem, _sent(path, file, dancers), file.tempo, file.stage, file.piece_tempo)


def _hint(message: str) -> str:
    """Return "; did you mean ...?" for an unknown key in an ensemble file, or ""."""
    unknown = re.search(r"unknown field `(.*?)`(?: - at `\$\.(dancer|change))?", message)
    if unknown is None:
        return ""
    tables: dict[str | None, type[msgspec.Struct]] = {"dancer": _Dancer, "change": _Change}
    return did_you_mean(unknown[1], [field.name for field in msgspec.structs.fields(tables.get(unknown[2], _File))])


def _stretched(piece: Motion, ratio: float) -> Motion:
    """Return a piece that lasts `ratio` times as long."""
    if ratio == 1.0:
        return piece
    start = piece.times[0]
    insertions = tuple(replace(one, times=start + ratio * (one.times - start)) for one in piece.insertions)
    return replace(piece, times=start + ratio * (piece.times - start), insertions=insertions, rate=0.0)


def _sent(path: Path, file: _File, dancers: Sequence[Dancer]) -> tuple[Dancer, ...]:
    """Return the dancers with their ways; FormatError if a change cannot be, or if two end on one spot."""
    last = 1.0
    for number, change in enumerate(file.change, start=1):
        where = f"{path}: change {number}"
        if (change.places is None) == (change.formation is None):
            raise FormatError(f"{where} needs a formation, or places, and not both")
        if change.at < last - COUNT_TOLERANCE:
            raise FormatError(f"{where} begins at count {change.at:g}, before the last one has ended at {last:g}")
        last = change.at + change.counts
        start, end = (counts_to_seconds(count - 1.0, file.tempo or 60.0) for count in (change.at, last))
        if change.places is not None:
            if len(change.places) != len(dancers):
                raise FormatError(f"{where} has {len(change.places)} places for {len(dancers)} dancers")
            targets = np.array(change.places)
        else:
            targets = places_in(change.formation or file.formation, len(dancers), change.spacing or file.spacing)
            targets = assigned(whereabouts(dancers, start), targets)
        check_spots(where, "end", [one.name for one in dancers], targets)
        dancers = send(dancers, targets, start, end)
    return tuple(dancers)


def _places(path: Path, file: _File, names: list[str]) -> Floats:
    """Return the places of all dancers [N, 2], metres; FormatError if two stand on one spot."""
    places = places_in(file.formation, len(names), file.spacing)
    for i, one in enumerate(file.dancer):
        if one.place is not None:
            places[i] = one.place
    check_spots(str(path), "begin", names, places)
    return places


def check_spots(where: str, verb: str, names: Sequence[str], places: Floats) -> None:
    """Raise a FormatError if two dancers begin, or end, on one spot; places are [N, 2], metres."""
    apart = np.linalg.norm(places[:, None] - places[None], axis=-1) + np.where(np.eye(len(names)), np.inf, 0.0)
    i, k = (int(index) for index in np.unravel_index(int(apart.argmin()), apart.shape))
    if apart[i, k] < SAME_SPOT_M:
        x, z = places[i].tolist()
        raise FormatError(f"{where}: {displayed(names[i])} and {displayed(names[k])} {verb} on one spot, {x:g}, {z:g}")


def _facing(facing: float | str, places: Floats, i: int) -> float:
    """Return the angle by which a dancer is turned to the left of the audience, radians."""
    if facing not in ("centre", "each other"):
        return float(np.radians(float(facing)))
    partner = (
        i + 1 if i % 2 == 0 else i - 1
    )  # the first and the second, the third and the fourth; an odd one: the centre
    pairs = facing == "each other" and partner < len(places)
    x, z = (places[partner] if pairs else places.mean(axis=0)) - places[i]
    return float(np.arctan2(x, z)) if np.hypot(x, z) > SAME_SPOT_M else 0.0
