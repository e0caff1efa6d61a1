"""Coupling of two dancers, learned from duets: one more edge of the network, P(relation | state of the leader).

The states of the relation are the cells that the duets show, of `PLACE_CELL_M` and `FACING_CELL_DEG`, with the hands
that are held; its moves are those of the duets, as of a joint chain. One more relation is always possible, between A's
and B's in proportion to the time; without duets it is the only one. A path of relations r_t, step by step with the
leader, costs

    sum_t  -log P(r_t | leader's state at t)                    the edge of the network (`learn_coordination`)
         + -log P(r_t | r_(t-1)), or BRIDGE_NATS a cell         how the duets move
         + (distance^2 + turn^2) / 2                            the follower's own way over the floor, each in its usual

The exact minimum over paths is found by dynamic programming (Viterbi).
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import pairwise

import numpy as np

from motionmind._typing import Bools, Floats, Int32s, Ints
from motionmind.body.motion import Motion
from motionmind.corpus import cache
from motionmind.duets.relations import N_LEADER_STATES, Relations, leader_states, relate
from motionmind.geometry import rotations as rot
from motionmind.grammar.coordination import Coordination, learn_coordination

COUPLE_RATE_FPS = 5.0  # relations a second, as of corpora
PLACE_CELL_M = 0.25
FACING_CELL_DEG = 30.0
BRIDGE_NATS = 3.0  # for each cell of an unattested move between relations: dearer than the usual 1 in 20
MAX_RELATIONS = 400  # the most frequent ones; a search takes 0.01 s a step
LEAST_WAY_M = 0.05  # usual way of a follower in a step, at least
LEAST_TURN_RAD = 0.1  # usual turn in a step, at least


@dataclass(frozen=True, eq=False)
class Coupling:
    """Relations of two dancers, R of them, as duets show them.

    Attributes:
        means: the mean of each relation [R].
        cells: x, z, facing and held hands of each [R, 3 + pairs].
        moves: nats of a move from each relation to each [R, R]; infinite where the duets show none.
        visits: number of steps that begin in each relation [R].
        network: P(relation | leader's state).
        way, turn: a follower's usual way over the floor in a step, metres, and turn, radians: 95th percentiles.
        seen: all relations that the duets show [N].
    """

    means: Relations
    cells: Ints
    moves: Floats
    visits: Floats
    network: Coordination | None
    way: float
    turn: float
    seen: Relations

    def likelihood_costs(self, leader: Int32s) -> Floats:
        """Return -log P of the relations, and of one that was never seen, given the leader's states [T]: [T, R + 1]."""
        count = len(self.cells)
        if self.network is None:
            return np.zeros((len(leader), 1))
        starts = np.array([0, N_LEADER_STATES, N_LEADER_STATES + count])
        costs = self.network.cost(1, leader[:, None], np.arange(count, dtype=np.int32)[None], starts)
        never = self.network.parent_costs[leader] + np.log(len(self.seen.facings) + 1.0)
        return np.concatenate([costs, never[:, None]], axis=1)


@dataclass(frozen=True, eq=False)
class RelationPath:
    """The cheapest path of relations.

    Attributes:
        relations: the relations at its steps [T + 1], the first A's and the last B's.
        held: which hands are held [T + 1, pairs].
        attested: share of its moves that the duets show.
        cost: its cost, nats.
    """

    relations: Relations
    held: Bools
    attested: float
    cost: float


def cells_of(relations: Relations) -> Ints:
    """Return the cells of relations: x, z, facing and held hands [N, 3 + pairs]."""
    turns = round(360.0 / FACING_CELL_DEG)
    facing = np.round(np.degrees(relations.facings) / FACING_CELL_DEG)[:, None] % turns
    places = np.round(relations.places / PLACE_CELL_M)
    return np.concatenate([places, facing, relations.held], axis=1).astype(np.int64)


def learn_coupling(duets: Sequence[tuple[Motion, Motion]]) -> Coupling:
    """Learn the coupling from duets, each the movement of leader and follower on one clock and on the same joints."""
    pairs = [(one.resample(COUPLE_RATE_FPS), two.resample(COUPLE_RATE_FPS)) for one, two in duets if len(one) > 1]
    if not pairs:
        none = Relations(np.zeros((0, 2)), np.zeros(0), np.zeros((0, 0, 3)))
        return Coupling(none, np.zeros((0, 3), np.int64), np.zeros((0, 0)), np.zeros(0), None, 1.0, 1.0, none)
    parts = [relate(*pair) for pair in pairs]
    seen, leader = Relations.joined(parts), np.concatenate([leader_states(one) for one, _ in pairs])
    cells, states, counts = np.unique(cells_of(seen), axis=0, return_inverse=True, return_counts=True)
    states = states.reshape(-1)
    kept = np.sort(np.argsort(-counts, kind="stable")[:MAX_RELATIONS])
    known = np.searchsorted(kept, states).clip(max=len(kept) - 1)
    is_known = kept[known] == states
    ends = np.cumsum([len(part.facings) for part in parts])
    begins = np.delete(np.arange(ends[-1]), ends - 1)
    begins = begins[is_known[begins] & is_known[begins + 1]]
    moved = np.zeros((len(kept), len(kept)))
    np.add.at(moved, (known[begins], known[begins + 1]), 1.0)
    visits = moved.sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        moves = -np.log(moved / visits[:, None])
    moves[moved == 0.0] = np.inf
    means = Relations.joined([_mean(seen.part(np.flatnonzero(states == state))) for state in kept])
    ways = np.concatenate([rot.norm(np.diff(two.root[:, [0, 2]], axis=0)) for _, two in pairs])
    turns = np.concatenate([np.abs(np.diff(np.unwrap(rot.heading(two.rotations[:, 0])))) for _, two in pairs])
    network = _network(np.stack([leader[is_known], known[is_known]], axis=1).astype(np.int32), len(kept))
    usual = max(LEAST_WAY_M, float(np.percentile(ways, 95.0))), max(LEAST_TURN_RAD, float(np.percentile(turns, 95.0)))
    return Coupling(means, cells[kept], moves, visits, network, *usual, seen)


def _mean(relations: Relations) -> Relations:
    """Return the mean of relations in one cell [1]."""
    facing = np.angle(np.exp(1j * relations.facings).mean(keepdims=True))
    return Relations(relations.places.mean(axis=0)[None], facing, relations.hands.mean(axis=0)[None])


def _network(states: Int32s, count: int) -> Coordination:
    """Return P(relation | leader's state), learned from pairs of both [N, 2] or, by their hash, from the cache."""
    key = hashlib.sha256(b"duets" + states.tobytes()).hexdigest()
    names = [one.name for one in fields(Coordination)]
    arrays = cache.recall(key)
    if arrays is None:
        sizes = np.array([N_LEADER_STATES, count])
        learned = learn_coordination(("leader", "follower"), np.array([-1, 0]), states, sizes)
        arrays = {name: getattr(learned, name) for name in names}
        cache.remember(key, arrays)
    return Coordination(**{name: arrays[name] for name in names})


def find_relations(coupling: Coupling, leader: Motion, a: Relations, b: Relations) -> RelationPath:
    """Find the cheapest path of relations from A's to B's, in step with a leader.

    Args:
        coupling: the relations that duets show.
        leader: movement of the leader at the path's steps, of T + 1 frames.
        a, b: relations of A and of B [1].
    """
    steps, count = len(leader), len(coupling.cells)
    between = _between(a, b, np.linspace(0.0, 1.0, steps))
    likely = coupling.likelihood_costs(leader_states(leader))
    cost = np.full(count + 1, np.inf)
    came = np.zeros((steps, count + 1), dtype=np.int64)
    for end, at in ((a, 0), (b, steps - 1)):
        likely[at] = np.where(_state_of(coupling, end), 0.0, np.inf)
    cost = likely[0].copy()
    before = _states(coupling.means, between, a, 0)
    for step in range(1, steps):
        here = _states(coupling.means, between, b if step == steps - 1 else None, step)
        total = cost[:, None] + _move_costs(coupling, before, here, leader, step)
        came[step] = total.argmin(axis=0)
        cost = total.min(axis=0) + likely[step]
        before = here
    states = [int(cost.argmin())]
    for step in range(steps - 1, 0, -1):
        states.append(int(came[step, states[-1]]))
    path = np.array(states[::-1])
    inner = np.flatnonzero((path < count) & (np.arange(steps) % (steps - 1) > 0)) if steps > 1 else np.zeros(0, int)
    places, facings, hands = (array.copy() for array in between)
    # The points of the cells nearest to the straight way: cells' means would sway bodies that could stand.
    centres, half = PLACE_CELL_M * coupling.cells[path[inner], :2], 0.5 * PLACE_CELL_M
    places[inner] = np.clip(places[inner], centres - half, centres + half)
    turned = np.radians(FACING_CELL_DEG) * coupling.cells[path[inner], 2]
    half = 0.5 * np.radians(FACING_CELL_DEG)
    facings[inner] = turned + np.clip(_turned(facings[inner] - turned), -half, half)
    both = (a.held & b.held)[0]
    held = np.tile(both, (steps, 1))
    held[0], held[-1] = a.held[0], b.held[0]
    if len(inner):
        own = coupling.cells[path[inner], 3:].astype(np.bool_)
        hands[inner] = np.where(own[..., None], coupling.means.hands[path[inner]], hands[inner])
        held[inner] |= own
    shown = [
        bool(np.isfinite(coupling.moves[p, q])) if max(p, q) < count else False for p, q in pairwise(path.tolist())
    ]
    least = float(cost.min())
    return RelationPath(Relations(places, facings, hands), held, float(np.mean(shown or [True])), least)


def _state_of(coupling: Coupling, end: Relations) -> Bools:
    """Return whether an end's relation is each of the relations, or else the one between [R + 1]."""
    known = np.zeros(0, np.bool_)
    if len(coupling.cells):
        known = (coupling.cells == cells_of(end)).all(axis=1)
    return np.append(known, not known.any())


def _between(a: Relations, b: Relations, shares: Floats) -> Relations:
    """Return the relations at shares of the time from A's to B's; facings turn the shorter way."""
    turn = np.angle(np.exp(1j * (b.facings - a.facings)))
    places = a.places + shares[:, None] * (b.places - a.places)
    hands = a.hands + shares[:, None, None] * (b.hands - a.hands)
    return Relations(places, a.facings + shares * turn, hands)


def _states(means: Relations, between: Relations, end: Relations | None, step: int) -> Relations:
    """Return the relations that may be at a step [R + 1]: the means, or at an end its own, and the one between."""
    count = len(means.facings)
    last = between.part(slice(step, step + 1))
    if end is not None:
        return Relations(*(np.repeat(array, count + 1, axis=0) for array in end))
    if not count:
        return last
    return Relations.joined([means, last])


def _move_costs(coupling: Coupling, before: Relations, here: Relations, leader: Motion, step: int) -> Floats:
    """Return the cost of each move to a step [R + 1, R + 1], nats."""
    heading, root = rot.heading(leader.rotations[:, 0]), leader.root
    at, facing = [], []
    for number, relations in ((step - 1, before), (step, here)):
        local = np.insert(relations.places, 1, 0.0, axis=1)
        at.append((root[number] + rot.mul_vec(rot.about_vertical(heading[number]), local))[:, [0, 2]])
        facing.append(heading[number] + relations.facings)
    way = np.square(at[1][None] - at[0][:, None]).sum(axis=-1)
    turn = _turned(facing[1][None] - facing[0][:, None])
    own = 0.5 * (way / coupling.way**2 + np.square(turn / coupling.turn))
    cells = np.square(here.places[None] - before.places[:, None]).sum(axis=-1) / PLACE_CELL_M**2
    cells += np.square(_turned(here.facings[None] - before.facings[:, None]) / np.radians(FACING_CELL_DEG))
    count, changes = len(coupling.cells), (here.held[None] != before.held[:, None]).sum(axis=-1)
    moves = BRIDGE_NATS * (np.sqrt(cells) + changes)
    moves[:count, :count] = np.maximum(moves[:count, :count], BRIDGE_NATS)  # a hold that the duets do not show
    moves[:count] += np.log(coupling.visits + 1.0)[:, None]
    known = coupling.moves
    moves[:count, :count] = np.where(np.isfinite(known), known, moves[:count, :count])
    return np.asarray(own + moves)


def _turned(angle: Floats) -> Floats:
    return np.asarray(angle - 2.0 * np.pi * np.round(angle / (2.0 * np.pi)))
