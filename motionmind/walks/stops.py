"""Stops: postures that a movement passes exactly, with their velocities if known."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.body.motion import Posture, Velocity
from motionmind.corpus.corpus import Corpus
from motionmind.geometry import rotations as rot
from motionmind.learned.posture_statistics import PostureStatistics
from motionmind.walks.steps import steps_at

_EVERY = slice(None)
_VELOCITY_STEP_S = 1e-3  # finite-difference step that splits the body's velocity into those of its joint chains


class Rates(NamedTuple):
    """Velocities of a body in one or more samples.

    Attributes:
        joints: angular velocities of the joints [..., J, 3], rad/s, in their own frames; the root's excludes the body's
            turn where the facing is a chain of its own.
        turn: turning rate of the body about the vertical [...], rad/s; 0 where the facing is no chain of its own.
        travel: velocity of the root [..., 3], m/s, relative to the body's heading.
    """

    joints: Floats
    turn: Floats
    travel: Floats

    @classmethod
    def of_chains(cls, chains: Floats, travel: Floats, joints: int) -> Rates:
        """Build rates from the angular velocities of all chains [..., L, 3], the J joints first, and the travel."""
        turn = chains[..., -1, 1] if chains.shape[-2] > joints else np.zeros(chains.shape[:-2])
        return cls(np.ascontiguousarray(chains[..., :joints, :]), turn, travel)


class Stop(NamedTuple):
    """A posture that a movement passes.

    Attributes:
        chains: orientations of the chains [L, 4].
        place: position of the root [3], in body heights.
        rates: velocities; None if unknown.
    """

    chains: Floats
    place: Floats
    rates: Rates | None = None


def stop_at(corpus: Corpus, posture: Posture, velocity: Velocity | None = None) -> Stop:
    """Return a stop at a posture of the corpus's skeleton, with a velocity if given."""
    chains, place = corpus.to_chains(posture.rotations), posture.root / (posture.skeleton.height or 1.0)
    if velocity is None:
        return Stop(chains, place)
    soon = corpus.to_chains(rot.mul(posture.rotations, rot.exp(_VELOCITY_STEP_S * velocity.rotations)))
    ahead = rot.about_vertical(-rot.heading(posture.rotations[0]))
    turned = rot.log(rot.inv_mul(chains, soon)) / _VELOCITY_STEP_S
    return Stop(chains, place, Rates.of_chains(turned, rot.mul_vec(ahead, velocity.root), len(posture.skeleton)))


def sample_rates(corpus: Corpus, statistics: PostureStatistics, samples: Ints | slice = _EVERY) -> Rates:
    """Return the velocities in samples of the corpus: means over the steps that arrive and leave.

    Args:
        corpus: the movement learned from.
        statistics: posture statistics of its samples.
        samples: indices of samples [n]; a slice means all.
    """
    if isinstance(samples, slice):
        return _all_rates(corpus, statistics)
    chain = statistics.begins, statistics.ends, len(statistics.weights) - len(statistics.turn)
    leaving, arriving = (steps_at(samples, ahead, *chain) for ahead in (True, False))
    return _mean_rates(corpus, statistics, len(samples), [(at, steps) for at, _, steps in (leaving, arriving)])


@lru_cache(maxsize=1)
def _all_rates(corpus: Corpus, statistics: PostureStatistics) -> Rates:
    """Return the velocities in all of the corpus's samples."""
    steps = np.arange(len(statistics.begins))
    return _mean_rates(
        corpus, statistics, len(statistics.weights), [(at, steps) for at in (statistics.begins, statistics.ends)]
    )


def _mean_rates(corpus: Corpus, statistics: PostureStatistics, count: int, steps: Sequence[tuple[Ints, Ints]]) -> Rates:
    """Return mean velocities in `count` samples; `steps` pairs the sample of each step with the step's index."""
    moves, means = len(statistics.turn), []
    counts = np.bincount(np.concatenate([at for at, _ in steps]), minlength=count)
    of_steps = [_velocities(corpus, statistics, numbers, moves) for _, numbers in steps]
    for k in range(2):
        sums = np.zeros((count, *of_steps[0][k].shape[1:]))
        for (at, _), velocities in zip(steps, of_steps, strict=True):
            np.add.at(sums, at, velocities[k])
        means.append(sums / np.maximum(counts, 1).reshape(-1, *(1,) * (sums.ndim - 1)))
    return Rates.of_chains(means[0], means[1], len(corpus.skeleton))


def _velocities(corpus: Corpus, statistics: PostureStatistics, steps: Ints, moves: int) -> tuple[Floats, Floats]:
    """Return the velocities of the joint chains [m, L, 3] and of the root [m, 3] in the given steps."""
    seconds, shown = 0.5 * corpus.moves.take(steps % moves).seconds[:, None], statistics.orientations
    turned = rot.log(rot.inv_mul(shown[statistics.begins[steps]], shown[statistics.ends[steps]]))
    return turned / seconds[..., None], statistics.travel[steps % moves] / seconds
