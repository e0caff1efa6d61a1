"""Bending of corpus walks towards the states of a path, no further than necessary."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from motionmind._typing import Bools, Floats, Int32s
from motionmind.corpus.corpus import Corpus
from motionmind.geometry import rotations as rot
from motionmind.geometry.splines import natural_spline
from motionmind.grammar.grammar import Grammar
from motionmind.synthesis.timeline import Timeline
from motionmind.walks.expectation import Expectation
from motionmind.walks.headings import correct_headings
from motionmind.walks.stops import Stop

# Distance of a chain from its state at a move, in tolerances: where a request constrains the chain (below 1, to leave
# room for the arc between two frames), and elsewhere.
FIRM_PULL_RATIO, FREE_PULL_RATIO = 0.95, 3.0


def allowed_distances(chains: Floats, path: Int32s, grammar: Grammar, tolerances: Floats, wished: Bools) -> Floats:
    """Return the distance that each chain may keep from its state at each move [T + 1, L], radians.

    It is FIRM_PULL_RATIO times the chain's tolerance where a request constrains the chain (`wished`). Elsewhere it is
    FREE_PULL_RATIO times the tolerance, plus the walk's distance (at `chains`) beyond the tolerance of the nearest
    state: a vocabulary without a state nearby must not distort the movement.
    """
    starts, nearest = grammar.transitions.starts, np.empty(path.shape)  # cosines of half the angles
    for chain in range(len(tolerances)):
        centres = grammar.centres[starts[chain] : starts[chain + 1]]
        nearest[:, chain] = np.abs(chains[:, chain] @ centres.T).max(axis=1)
    beyond = np.maximum(2.0 * np.arccos(np.minimum(nearest, 1.0)) - tolerances, 0.0)
    return np.where(wished, FIRM_PULL_RATIO * tolerances, FREE_PULL_RATIO * tolerances + beyond)


def bend_to_states(
    walk: Expectation,
    chains: Floats,
    states: Floats,
    clock: Timeline,
    stops: Mapping[int, Stop],
    corpus: Corpus,
    within: Floats,
) -> Expectation:
    """Bend a walk until each chain is `within` radians [T + 1, L] of its state [T + 1, L, 4] at each move.

    `chains` are the walk's orientations at the moves [T + 1, L, 4]. The bend is 0 at the stops and where a chain is
    near enough already; a spline interpolates it between moves.
    """
    joints, inner = walk.poses.shape[1], np.ones(len(states), dtype=np.bool_)
    inner[list(stops)] = False
    missing = rot.log(rot.inv_mul(chains[:, :joints], states[:, :joints]))
    far = rot.norm(missing)[..., None]
    bends = missing * np.maximum(1.0 - within[:, :joints, None] / np.maximum(far, 1e-9), 0.0) * inner[:, None, None]
    poses = rot.mul(walk.poses, rot.exp(natural_spline(clock.moves, bends, walk.half_steps)))
    headings = walk.headings
    if corpus.facing == "free":
        at_moves, centres = natural_spline(walk.half_steps, headings, clock.moves), rot.heading(states[:, -1])
        centres[~inner] = at_moves[~inner]
        bent = correct_headings(at_moves, centres, within[:, -1])
        headings = headings + natural_spline(clock.moves, bent, walk.half_steps)
    return walk._replace(poses=poses, headings=headings)
