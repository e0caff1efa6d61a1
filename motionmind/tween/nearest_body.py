"""Tweens through whole postures of a corpus: the nearest posture, and the diagnosis when there is no path."""

from __future__ import annotations

import numpy as np

from motionmind._typing import Floats
from motionmind.corpus.corpus import FACING, Corpus
from motionmind.geometry import rotations as rot
from motionmind.search.problem import Rules
from motionmind.tween.whole_body import Bodies

_COMPARED = 4000  # greatest number of postures on each side when looking for the nearest pair


def nearest_posture(corpus: Corpus, rotations: Floats) -> int:
    """Return the number of the corpus's posture nearest to `rotations` [J, 4], ignoring its facing if that is free.

    The nearest posture has the least sum of squared angles between joints.
    """
    count = len(corpus.skeleton)
    angles = rot.angle(corpus.to_chains(corpus.rotations)[:, :count], corpus.to_chains(rotations)[:count])
    return int(np.argmin(np.sum(angles**2, axis=1)))


def diagnose_posturewise(corpus: Corpus, bodies: Bodies, near: tuple[int, int], rules: Rules) -> str:
    """Explain why no whole postures join the corpus's postures nearest to A and B, and name the nearest pair."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import shortest_path

    (a, b), (start, goal) = near, bodies.of[list(near)]
    count, shape = len(bodies.targets), (len(bodies.states), len(bodies.states))
    graph = csr_array((np.ones(count), bodies.targets, bodies.indptr), shape=shape)
    ahead = shortest_path(graph, unweighted=True, indices=start)
    back = shortest_path(graph.T.tocsr(), unweighted=True, indices=goal)
    within = f"at most {rules.longest} move{'s' * (rules.longest != 1)}"
    first = f"no path from A to B in {within} through whole postures (without posturewise joints move on their own):"
    ends = f"{_place(corpus, a)}, nearest to A, and {_place(corpus, b)}, nearest to B"
    if np.isfinite(ahead[goal]) and start != goal:
        needs = f"{ahead[goal]:.0f} moves lie between {ends}"
        if ahead[goal] <= rules.longest:
            needs += f", but not in as many as were asked for, or the {FACING} does not come round in them"
        return f"{first}\n  {needs}"
    # One posture of each body is enough to measure distances.
    one = np.unique(bodies.of, return_index=True)[1]
    found, led = one[np.isfinite(ahead)], one[np.isfinite(back)]
    joints = corpus.to_chains(corpus.rotations)[:, : len(corpus.skeleton)]
    some, others = (which[:: 1 + len(which) // _COMPARED] for which in (found, led))
    # The sum over joints of (q . p)^2 = cos^2 of half the angle is a product of one factor from each posture.
    squares = [(q[..., :, None] * q[..., None, :]).reshape(len(q), -1) for q in (joints[some], joints[others])]
    i, k = np.unravel_index(int(np.argmax(squares[0] @ squares[1].T)), (len(some), len(others)))
    degrees = np.degrees(rot.angle(joints[some[i]], joints[others[k]])).mean()
    return (
        f"{first}\n  of the {len(found)} postures that {_place(corpus, a)}, nearest to A, leads to and the {len(led)} "
        f"that lead to {_place(corpus, b)}, nearest to B, none are the same; nearest are "
        f"{_place(corpus, some[i])} and {_place(corpus, others[k])}, {degrees:.1f} degrees a joint apart"
    )


def _place(corpus: Corpus, posture: int) -> str:
    clip = corpus.clip_of(posture)
    return f"posture {posture - clip.start} of {clip.label}"
