"""Stops: the postures that a movement passes exactly, with the velocities there if they are known."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from motionmind._typing import Floats
from motionmind.body.motion import Posture, Velocity
from motionmind.corpus.corpus import Corpus
from motionmind.geometry import rotations as rot
from motionmind.learned.carriage import Carriage

_SOON = 1e-3  # seconds over which a velocity of the body is taken apart into its chains'


class Rates(NamedTuple):
    """Velocities of a body in one or more moments.

    Attributes:
        joints: angular velocities of the joints [..., J, 3], radians a second, in their own frames; of the root without
            the body's turning, where that is a chain of its own.
        turn: the body's turning about the vertical [...], radians a second; 0 where that is no chain of its own.
        travel: velocity of the root [..., 3], metres a second, in the body's own heading.
    """

    joints: Floats
    turn: Floats
    travel: Floats

    @classmethod
    def of_chains(cls, chains: Floats, travel: Floats, joints: int) -> Rates:
        """Return rates from those of all chains [..., L, 3], of which the first J are joints, and the travel."""
        turn = chains[..., -1, 1] if chains.shape[-2] > joints else np.zeros(chains.shape[:-2])
        return cls(np.ascontiguousarray(chains[..., :joints, :]), turn, travel)


class Stop(NamedTuple):
    """A posture that a movement passes.

    Attributes:
        chains: orientations of the chains [L, 4].
        place: of the root [3], in heights of the body.
        rates: its velocity; None if unknown.
    """

    chains: Floats
    place: Floats
    rates: Rates | None = None


def stop_at(corpus: Corpus, posture: Posture, velocity: Velocity | None = None) -> Stop:
    """Return a stop at a posture of the corpus's skeleton that is passed with the given velocity."""
    chains, place = corpus.to_chains(posture.rotations), posture.root / (posture.skeleton.height or 1.0)
    if velocity is None:
        return Stop(chains, place)
    soon = corpus.to_chains(rot.mul(posture.rotations, rot.exp(_SOON * velocity.rotations)))
    ahead = rot.about_vertical(-rot.heading(posture.rotations[0]))
    turned = rot.log(rot.inv_mul(chains, soon)) / _SOON
    return Stop(chains, place, Rates.of_chains(turned, rot.mul_vec(ahead, velocity.root), len(posture.skeleton)))


@lru_cache(maxsize=1)
def moments_rates(corpus: Corpus, carriage: Carriage) -> Rates:
    """Return the velocities in the corpus's N moments: means of the steps that lead there and on, in `Rates`."""
    steps = np.concatenate([0.5 * corpus.moves.seconds] * 2)[:, None]
    begins, ends = carriage.begins, carriage.ends
    turned = rot.log(rot.inv_mul(carriage.orientations[begins], carriage.orientations[ends])) / steps[..., None]
    travelled = np.concatenate([carriage.travel] * 2) / steps
    counts = np.bincount(np.concatenate([begins, ends]), minlength=len(carriage.weights))
    means = []
    for of_steps in (turned, travelled):
        sums = np.zeros((len(counts), *of_steps.shape[1:]))
        np.add.at(sums, begins, of_steps)
        np.add.at(sums, ends, of_steps)
        means.append(sums / np.maximum(counts, 1).reshape(-1, *(1,) * (of_steps.ndim - 1)))
    return Rates.of_chains(means[0], means[1], len(corpus.skeleton))
