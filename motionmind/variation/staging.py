"""Staging: a variation stays on a stage, as a whole or, where insertions can travel, run by run.

A *run* is movement between two insertions that travel. Each run is as long as the stage allows; the insertion between
two runs leads from the place of one to that of the next, as near as possible.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import msgspec
import numpy as np

from motionmind._typing import Floats
from motionmind.body.stage import ON_STAGE_M, Spot, find_spot, spots_on, turned_path
from motionmind.errors import NoPathError
from motionmind.geometry import rotations as rot
from motionmind.search.solve import Watch
from motionmind.tween.engine import Engine
from motionmind.variation.piece import Arrangement, Piece
from motionmind.variation.review import Replace, Seam
from motionmind.variation.seams import Transition, candidate_of

EDGES_M = 0.1, 0.3, 0.6  # runs stay this far from the edge, so that insertions between them do, too
TURN_M_RAD = 0.5  # of travel that a turn by a radian is worth


class Staged(NamedTuple):
    """A variation on a stage.

    Attributes:
        piece: the piece, turned and moved as a whole.
        transitions: transitions with insertions that travel among their candidates.
        edits: edits that choose these candidates.
    """

    piece: Piece
    transitions: tuple[Transition, ...]
    edits: tuple[Replace, ...]


def put_on_stage(
    piece: Piece,
    arranged: Arrangement,
    seams: Sequence[Seam],
    stage: tuple[float, float],
    engine: Engine | None = None,
    watch: Watch | None = None,
    **options: Any,
) -> Staged:
    """Turn and move a variation as a whole, or else run by run, so that it stays on a stage as well as it can.

    Args:
        piece: the piece.
        arranged: the variation's movement.
        seams: its seams.
        stage: width and depth of the stage around the origin, metres.
        engine: the corpus that finds insertions; None to move it only as a whole.
        watch: as for `Engine.tween`.
        options: options of the tweens.
    """
    path, may_turn = arranged.motion.root[:, [0, 2]], piece.facing == "free"
    whole = find_spot(path, stage, may_turn=may_turn)
    if whole is not None:
        return Staged(_moved(piece, whole), (), ())
    if engine is None:
        return Staged(_moved(piece, _centred(path, 0.0)), (), ())
    made, least = Staged(_moved(piece, _centred(path, 0.0)), (), ()), np.inf
    for edge in EDGES_M:
        inner = max(stage[0] - 2.0 * edge, 0.5 * stage[0]), max(stage[1] - 2.0 * edge, 0.5 * stage[1])
        try:
            found, beyond = _by_runs(piece, arranged, seams, stage, inner, engine, watch, options)
        except NoPathError:  # no insertion leads from a run to the next
            continue
        if beyond < least:
            made, least = found, beyond
        if beyond <= ON_STAGE_M:
            break
    return made


def _by_runs(
    piece: Piece,
    arranged: Arrangement,
    seams: Sequence[Seam],
    stage: tuple[float, float],
    inner: tuple[float, float],
    engine: Engine,
    watch: Watch | None,
    options: dict[str, Any],
) -> tuple[Staged, float]:
    """Put a variation on a stage run by run; return it, and how far the farthest place is beyond an edge, metres.

    Arguments are those of `put_on_stage`, and the part of the stage that runs may use (`inner`).
    """
    path, may_turn, half = arranged.motion.root[:, [0, 2]], piece.facing == "free", 0.5 * np.array(stage)
    breaks = [seam for seam in seams if seam.insertion]
    blocks = list(
        zip(
            [0, *(int(arranged.frames[seam.at + 1]) for seam in breaks)],
            [*(int(arranged.frames[seam.at]) + 1 for seam in breaks), len(path)],
            strict=True,
        )
    )
    spots = _spots_of(path, blocks, inner, may_turn)
    shown = [
        spot.at(path[slice(*block)]) for block, spot in zip(blocks, spots, strict=True)
    ]  # and insertions within runs, which `_spots_of` has counted
    changed: dict[tuple[int, int], Transition] = {}
    edits = []
    for seam, before, after in zip(breaks, spots[:-1], spots[1:], strict=True):
        if before is after or seam.transition is None:
            continue
        frame = int(arranged.frames[seam.at])
        a, facing = path[frame], before.turn
        if may_turn:
            facing += float(rot.heading(arranged.motion.rotations[frame, 0]))
        to = turned_path((after.at(a[None]) - before.at(a[None])), -facing)[0].tolist()
        if may_turn:
            to.append(float(np.degrees(after.turn - before.turn)))
        ends, around = piece.ends(seam.start, seam.end), piece.around(seam.start, seam.end)
        tween = engine.tween(*ends, before=around[0], after=around[1], watch=watch, to=to, **options)
        shown.append(turned_path(tween.motion.root[:, [0, 2]], facing) + before.at(a[None]))
        known = changed.get((seam.start, seam.end), seam.transition)
        candidates = (*known.candidates, candidate_of(tween))
        changed[seam.start, seam.end] = msgspec.structs.replace(known, candidates=candidates)
        edits.append(Replace(seam.number, len(candidates)))
    beyond = float((np.abs(np.concatenate(shown)) - half).max())
    return Staged(_moved(piece, spots[0]), tuple(changed.values()), tuple(edits)), beyond


def _spots_of(
    path: Floats, blocks: Sequence[tuple[int, int]], stage: tuple[float, float], may_turn: bool
) -> list[Spot]:
    """Return the spot of each block of a path [T, 2]: consecutive blocks share a spot as long as they fit."""
    spots: list[Spot] = []
    while len(spots) < len(blocks):
        first, spot, count = len(spots), None, 1
        begin, stop = blocks[first]
        for last in range(first, len(blocks)):
            found = _nearest_spot(
                path[begin : blocks[last][1]], stage, may_turn, spots[-1] if spots else None, path[begin]
            )
            if found is None:
                break
            spot, count = found, last + 1 - first
        # A block that the stage cannot hold stands in its middle.
        spots += [spot or _centred(path[begin:stop], spots[-1].turn if spots else 0.0)] * count
    return spots


def _moved(piece: Piece, spot: Spot) -> Piece:
    """Return a piece, turned and moved as a whole."""
    return replace(piece, motion=spot.place(piece.motion)) if spot.turn or np.any(spot.shift) else piece


def _nearest_spot(
    run: Floats, stage: tuple[float, float], may_turn: bool, before: Spot | None, begins: Floats
) -> Spot | None:
    """Return the spot that keeps a run [T, 2] on a stage and is nearest to the spot of the run before; None for none.

    Args:
        run: places of the root in the arrangement, metres.
        stage: width and depth of the stage, metres.
        may_turn: whether it may turn.
        before: the spot of the run before; None for the arrangement's own.
        begins: where both runs meet in the arrangement [2], metres.
    """
    nearest, least = None, np.inf
    own = before or Spot(0.0, np.zeros(2))
    for spot in spots_on(run, stage, begins, own, may_turn=may_turn):
        turned = abs(np.angle(np.exp(1j * (spot.turn - own.turn))))
        far = float(np.linalg.norm(spot.at(begins[None]) - own.at(begins[None]))) + TURN_M_RAD * float(turned)
        if far < least:
            nearest, least = spot, far
    return nearest


def _centred(run: Floats, turn: float) -> Spot:
    """Return the spot that puts the middle of a run's extent [T, 2] at the centre of the stage."""
    turned = turned_path(run, turn)
    return Spot(turn, -0.5 * (turned.min(axis=0) + turned.max(axis=0)))
