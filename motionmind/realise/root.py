"""Where the body goes: the root carried along by the displacements that the corpus gives the root's moves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionmind import rotations as rot
from motionmind.corpus.corpus import Corpus
from motionmind.grammar.transitions import Transitions
from motionmind.skeleton import Skeleton

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Carriage:
    """How a corpus's bodies travel and stand.

    Attributes:
        travel: mean displacement that goes with each transition of the root's lane, metres, in the body's heading
            when it sets out [E_0, 3].
        clearance: height of each posture's lowest point above its clip's floor [N], metres, at least 0. The floor is
            where the lowest point is in the lowest twentieth of the clip: a recording's own zero is often off.
    """

    travel: Floats
    clearance: Floats


def learn_carriage(corpus: Corpus, states: NDArray[np.int32], transitions: Transitions) -> Carriage:
    """How the bodies of a corpus travel and stand; `states` [N, L] are those of its postures."""
    low = lowest(corpus.skeleton, corpus.rotations, corpus.root)
    floor = [np.quantile(low[clip.start : clip.stop], 0.05) for clip in corpus.clips]
    clearance = np.maximum(low - np.repeat(floor, [clip.stop - clip.start for clip in corpus.clips]), 0.0)
    return Carriage(_travel(corpus, states, transitions), clearance)


def _travel(corpus: Corpus, states: NDArray[np.int32], transitions: Transitions) -> Floats:
    begins, ends, weights = corpus.moves.begins, corpus.moves.ends, corpus.moves.weights
    turn = rot.about_vertical(rot.heading(corpus.rotations[begins, 0]))
    moved = rot.mul_vec(rot.inv(turn), corpus.root[ends] - corpus.root[begins])
    count = int(transitions.indptr[transitions.starts[1]])
    size = int(transitions.starts[1])
    key = states[begins, 0].astype(np.int64) * size + states[ends, 0]
    listed = transitions.sources[:count] * size + transitions.targets[:count]
    edge = np.searchsorted(listed, key)
    counted = np.bincount(edge, weights, count)
    return np.stack([np.bincount(edge, weights * moved[:, k], count) / counted for k in range(3)], axis=1)


def carry(
    path: NDArray[np.int32],
    headings: Floats,
    seconds: Floats,
    travel: Floats,
    transitions: Transitions,
    a: Floats,
    b: Floats,
) -> Floats:
    """Positions [T + 1, 3] of the root at each posture of a path of states [T + 1, L], from `a` [3] to `b` [3].

    Each move carries the root by `travel` [E_0, 3] of its transition, turned by the body's heading [T + 1] then; a
    bridge by nothing. What is missing to `b` at the end is spread over the moves as they last, so no single one jumps.
    """
    steps = np.zeros((len(path) - 1, 3))
    for t in range(len(steps)):
        edge = transitions.edge(0, path[t, 0], path[t + 1, 0])
        if edge >= 0:
            steps[t] = rot.mul_vec(rot.about_vertical(headings[t]), travel[edge])
    missing = b - a - steps.sum(axis=0)
    share = seconds / seconds.sum() if len(seconds) else seconds
    return np.asarray(a + np.concatenate([np.zeros((1, 3)), np.cumsum(steps + share[:, None] * missing, axis=0)]))


def stand(skeleton: Skeleton, rotations: Floats, root: Floats, clearance: Floats) -> Floats:
    """Root positions [N, 3] that put each posture's lowest point `clearance` [N] metres above y = 0."""
    lifted = root.copy()
    lifted[:, 1] += clearance - lowest(skeleton, rotations, root)
    return lifted


def lowest(skeleton: Skeleton, rotations: Floats, root: Floats) -> Floats:
    """Heights [...] of the lowest joint or tip of postures with local rotations [..., J, 4] and root [..., 3]."""
    return np.asarray(skeleton.positions_and_tips(rotations, root)[..., 1].min(axis=-1))
