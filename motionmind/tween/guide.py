"""The guide: the cost of a path's departure from the movement that corpus walks expect.

If each chain depends on its last state alone, the likeliest path is not the likeliest movement: every joint freezes
and rushes on its own clock. Corpus walks cover whole limbs and bodies. For T moves from A to B they expect an
orientation m_j(t) of each chain at each move (`motionmind.walks.expectation`), and a state x_j(t) pays

    kappa (seconds of a move / 0.2) (angle(x_j(t), m_j(t)) / width)^2   nats,

the -log of a Gaussian about the walks' mean, up to a constant. So the likelihoods of chains, coordination and walks
multiply. The width is the chain's tolerance, or the angle to its nearest state if that is larger: in a sparse
vocabulary the guide chooses among the existing states and does not force unattested moves between them. The factor for
the time of a move makes the total independent of the corpus's sampling rate.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.body.motion import Posture
from motionmind.geometry import rotations as rot
from motionmind.geometry.splines import rotation_spline
from motionmind.learned.model import LearnedCorpus
from motionmind.learned.pace import over_seconds, way_between
from motionmind.learned.trust import ZERO_DISPLACEMENT_RAD
from motionmind.synthesis.detour import detour
from motionmind.synthesis.timeline import usual
from motionmind.tween.pacing import usual_times
from motionmind.walks.expectation import expect
from motionmind.walks.passages import Place, dance
from motionmind.walks.stops import Stop

PRICED_MOVE_S = 0.2  # a move of this length pays kappa for a departure of one tolerance


def make_guide(
    learned: LearnedCorpus,
    stops: tuple[Stop, Stop],
    kappa: float,
    duration: float | None,
    rows: Ints,
    path: Floats | None = None,
    liveliness: float = 0.0,
    place: Place | None = None,
) -> Callable[[int], Floats]:
    """Return the guide of a search from one posture to another, as `motionmind.search.problem.Problem` takes it.

    It depends on both ends and the number of moves, but not on pins, vias or other restrictions, so that answers under
    different restrictions share one energy.

    Args:
        learned: the corpus.
        stops: the stops at A and B.
        kappa: nats for a chain that is off by its tolerance for 0.2 s.
        duration: total seconds; None for moves of the corpus's usual length.
        rows: row of the grammar's states for each row of the searched model [G].
        path: joint orientations that the walks should stay near, after each move of the corpus's usual length within
            the duration, as `find_detour` returns them; None for all walks.
        liveliness: liveliness of the motion, from 0 to 1, which the guide shares.
        place: start in the corpus of a passage to follow instead of the mean; None for the mean.
    """
    space, seconds = learned.space, usual(learned.grammar.transitions)

    @lru_cache(maxsize=1)  # the cost breakdown needs the last number of moves again
    def costs(moves: int) -> Floats:
        length = moves * seconds if duration is None else duration
        walked = max(1, round(length / seconds))
        half_steps = np.linspace(0.0, length, 2 * walked + 1)
        passed = {0: stops[0], walked: stops[1]}
        expected = expect(learned.corpus, learned.statistics, passed, half_steps, path, duration is None)
        at = np.linspace(0.0, length, moves + 1)[1:-1]
        chains = expected.chains(learned.corpus, at)
        if path is not None:  # follow it exactly: the mean of walks near it moves less
            chains[:, : path.shape[1]] = rotation_spline(half_steps[::2], path, at)
        else:
            met: dict[float, Stop] = {0.0: stops[0], length: stops[1]}
            danced = dance(learned.corpus, learned.statistics, expected, met, 1.0 if place else liveliness, place)
            if danced is not None:
                chains = danced.move(chains, at)
        price = kappa * length / moves / PRICED_MOVE_S
        return price * departures(chains, space.centres, space.starts, np.radians(space.tolerances))[:, rows]

    return costs


def find_detour(
    learned: LearnedCorpus,
    ends: tuple[Posture, Posture],
    stops: tuple[Stop, Stop],
    duration: float,
    route: Floats | None = None,
) -> Floats | None:
    """Return a detour that fills spare time in usual moves [T + 1, J, 4]: see `motionmind.synthesis.detour`.

    Return None if corpus walks between the postures creep for at most a quarter of that time, or the duration is
    common for the distance.

    Args:
        learned: the corpus.
        ends: postures A and B on its skeleton.
        stops: the stops at A and B.
        duration: total seconds.
        route: the path over the floor from A to B [P, 2], metres; None for any.
    """
    seconds, displacement = usual(learned.grammar.transitions), way_between(*ends)
    if route is None and displacement.parts.max() < ZERO_DISPLACEMENT_RAD:  # equal ends: hold still
        return None
    (own,) = (time.median for time in usual_times(learned, ends, route))
    if np.log(duration / own) <= 2.0 * learned.pace.spread:  # dancers take longer one time in forty
        return None
    walked = max(1, round(duration / seconds))
    half_steps = np.linspace(0.0, duration, 2 * walked + 1)
    expected = expect(learned.corpus, learned.statistics, {0: stops[0], walked: stops[1]}, half_steps)
    if creeps(learned, expected.poses, half_steps) <= 0.25:
        return None
    chains = stops[0].chains, stops[1].chains
    return detour(learned.corpus, learned.statistics, chains, walked, max(1, round(own / seconds)))


def creeps(learned: LearnedCorpus, poses: Floats, times: Floats) -> float:
    """Return the share of the time in which a movement is slower than all but the slowest seconds of the corpus.

    Args:
        learned: the corpus.
        poses: orientations of the joints [S + 1, J, 4].
        times: evenly spaced times of the poses [S + 1], seconds.
    """
    steps = np.diff(times)
    speeds = rot.angle(poses[:-1], poses[1:]).mean(axis=1) / steps
    return float(np.mean(over_seconds(speeds, 1.0 / float(steps.mean())) < learned.pace.slowest[0]))


def departures(expected: Floats, centres: Floats, starts: Ints, tolerances: Floats) -> Floats:
    """Return the squared angle between each state and its chain's expected orientation, in units of the width [K, G].

    Args:
        expected: orientations of the chains [K, L, 4].
        centres: orientations of the states, chain after chain [G, 4].
        starts: first row of each chain's states [L + 1].
        tolerances: tolerance of each chain [L], radians.
    """
    out = np.empty((len(expected), len(centres)))
    for chain, tolerance in enumerate(tolerances):
        rows = slice(starts[chain], starts[chain + 1])
        angles = 2.0 * np.arccos(np.minimum(np.abs(expected[:, chain] @ centres[rows].T), 1.0))
        out[:, rows] = (angles / np.maximum(angles.min(axis=1, keepdims=True), tolerance)) ** 2
    return out
