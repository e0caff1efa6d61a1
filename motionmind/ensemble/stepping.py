"""Dance the ways between formations: the engine's insertions in place of feet that slide."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from motionmind._typing import Floats
from motionmind.body.motion import Insertion, Motion
from motionmind.display import displayed
from motionmind.ensemble.dancers import Dancer, Ensemble
from motionmind.errors import MotionMindError
from motionmind.tween.counts import counts_to_seconds
from motionmind.tween.engine import Engine

_SHOWN_S = 0.3  # of the piece before and after a way, from which the engine takes velocities


def dance_ways(ensemble: Ensemble, engine: Engine) -> Ensemble:
    """Return an ensemble whose dancers go their ways by steps, each with one piece from the first count on.

    A way becomes an insertion that leaves one place, and reaches the other, in the posture in which the piece waits, on
    the same counts. It is not quite straight.

    Args:
        ensemble: the dancers.
        engine: the engine; its corpus has the steps.

    Raises:
        MotionMindError: the engine finds no steps for a way.
    """
    times = ensemble.times()
    dancers = []
    for dancer in ensemble.dancers:
        piece = _danced(dancer, times, engine, ensemble.tempo or 60.0)
        x, _, z = piece.root[0].tolist()
        dancers.append(Dancer(dancer.name, piece, (x, z)))
    return Ensemble(ensemble.name, tuple(dancers), ensemble.tempo, ensemble.stage)


def _danced(dancer: Dancer, times: Floats, engine: Engine, tempo: float) -> Motion:
    """Return a dancer's movement on a clock, with an insertion for each way."""
    plain = dancer.at(times)
    rotations, root, clock, begin = [], [], [], -np.inf
    insertions, danced = list(plain.insertions), list[Insertion]()
    for number, way in enumerate(dancer.ways, start=1):
        part = (times > begin) & (times < way.start - 1e-6)
        steps = _steps(dancer, way.start, way.end, engine, tempo, f"{displayed(dancer.name)}, way {number}")
        new = slice(1 if way.start < begin + 1e-6 else 0, None)  # the last way may end with the first frame of this one
        rotations += [plain.rotations[part], steps.rotations[new]]
        root += [plain.root[part], steps.root[new]]
        clock += [times[part], steps.times[new]]
        insertions = [one for own in insertions for one in _outside(own, way.start, way.end)]
        danced += steps.insertions
        begin = way.end + 1e-6
    last = times > begin
    return replace(
        plain,
        rotations=np.concatenate([*rotations, plain.rotations[last]]),
        root=np.concatenate([*root, plain.root[last]]),
        times=np.concatenate([*clock, times[last]]),
        insertions=tuple(sorted(insertions + danced, key=lambda one: float(one.times[0]))),
        recorded=dancer.piece.own_credits,
    )


def _steps(dancer: Dancer, start: float, end: float, engine: Engine, tempo: float, name: str) -> Motion:
    """Return the engine's movement along a way, on the ensemble's clock."""
    around = np.arange(0.0, _SHOWN_S + 1e-6, 1.0 / 30.0)
    before = dancer.at(start - around[::-1])
    after = dancer.at(end + around)
    try:
        made = engine.tween(
            before.posture(-1),
            after.posture(0),
            before=before,
            after=after,
            tempo=tempo,
            counts=(end - start) / counts_to_seconds(1.0, tempo),
        ).motion
    except MotionMindError as error:
        raise MotionMindError(f"{name}: {error}") from error
    later = start - made.times[0]
    insertions = tuple(replace(one, times=one.times + later) for one in made.insertions)
    return replace(made, times=made.times + later, insertions=insertions)


def _outside(insertion: Insertion, start: float, end: float) -> list[Insertion]:
    """Return what is left of an insertion before and after a way."""
    times = insertion.times
    if times[-1] <= start or times[0] >= end:
        return [insertion]
    out = []
    first, last = int(np.sum(times <= start)), int(np.sum(times < end))
    for low, high in ((0, first), (last, len(times))):
        if high - low > 1:
            bridged = tuple((joint, move - low) for joint, move in insertion.bridged if low <= move < high - 1)
            out.append(replace(insertion, times=times[low:high], bridged=bridged))
    return out
