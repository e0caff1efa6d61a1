"""Laws of the search: what must stay when a problem is put in another way, and all that can be asked, at once.

Here are small bodies whose joints are in three states each, so that every path can be listed; and toys (toys.py). That
bounds hold, and what restrictions alone do, is in test_search.py and test_asks.py.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import cache
from itertools import product
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from toys import random_toy, solution

from motionmind._typing import Floats, Ints, States
from motionmind.body.motion import Motion, Posture
from motionmind.body.skeleton import Skeleton
from motionmind.discretize.codebook import Codebook
from motionmind.errors import NoPathError
from motionmind.geometry import rotations as rot
from motionmind.grammar import coordination
from motionmind.search.tolerances import OPTIMAL_WITHIN_NATS
from motionmind.tween.engine import Engine
from motionmind.tween.result import Tween

MOVES = 4
SAME = 2 * OPTIMAL_WITHIN_NATS
BODY = Skeleton("body", ("trunk", "arm", "segment"), (-1, 0, 0), np.zeros((3, 3)))

Ends = tuple[Posture, Posture]
seeds = st.integers(0, 10_000)
bodies = st.integers(0, 19)  # whose clips are learned from once: that takes longer than to ask something


def clips(seed: int) -> list[Motion]:
    """Two clips of joints that go from state to state at random, 25 degrees from one to the next."""
    rng, made = np.random.default_rng(seed), []
    for name, frames in (("one", 14), ("two", 9)):
        turned = np.radians(25.0) * rng.integers(3, size=(frames, len(BODY), 1)) * np.array([0.6, 0.0, 0.8])
        made.append(Motion(BODY, rot.exp(turned), np.zeros((frames, 3)), 0.2 * np.arange(frames), name))
    return made


@cache
def learned_from(body: int) -> Engine:
    return learned(clips(body))


def learned(movement: list[Motion]) -> Engine:
    return Engine.fit(movement, name="laws", facing="stage", flips="keep", discretization=Codebook(15.0))


def two(movement: list[Motion], seed: int) -> Ends:
    """Two postures that differ."""
    motion = movement[0]
    a, b = np.random.default_rng(seed).integers(len(motion), size=2)
    assume(np.abs(motion.rotations[a] - motion.rotations[b]).max() > 0.1)
    return motion.posture(int(a)), motion.posture(int(b))


def join(engine: Engine, ends: Ends, **asked: Any) -> Tween | None:
    """A tween by what is attested alone, without a guide and of any pace, or None where there is none."""
    try:
        return engine.tween(*ends, strict=True, **{"moves": (1, MOVES), "guide": 0.0, "without": ["pace"]} | asked)
    except NoPathError:
        return None


class Book:
    """Every path of up to MOVES moves of a body, listed one by one, and its cost, counted from the clips.

    Nothing is taken from the engine but the number of each posture's state.
    """

    def __init__(self, engine: Engine, movement: list[Motion], ends: Ends, novelty: float = 0.0) -> None:
        states = np.asarray(engine.states)
        breaks = np.cumsum([len(motion) for motion in movement])[:-1]
        self.start, self.goal = engine.space.assign(np.stack([end.rotations for end in ends]))
        self.sizes = states.max(axis=0) + 1
        self.moves, self.stands = [], []
        self.listed = cache(self._listed)
        for chain, size in enumerate(self.sizes):
            count = np.zeros((size, size))
            for piece in np.split(states[:, chain], breaks):
                np.add.at(count, (piece[:-1], piece[1:]), 1)
            leaving = count.sum(axis=1, keepdims=True)
            kinds = (count > 0).sum(axis=1, keepdims=True)
            with np.errstate(divide="ignore", invalid="ignore"):
                cost = np.where(count > 0, (1 - novelty) * np.log(leaving / count) + novelty * np.log(kinds), np.inf)
            cost[self.goal[chain], self.goal[chain]] = min(cost[self.goal[chain], self.goal[chain]], 1.0)  # beta
            self.moves.append(cost)
            if chain > 0:
                seen = np.zeros((self.sizes[0], size))
                np.add.at(seen, (states[:, 0], states[:, chain]), 1)
                share = seen.sum(axis=0) / len(states)  # of the pseudo-count, which is 1
                self.stands.append(-np.log((seen + share) / (seen.sum(axis=1, keepdims=True) + 1.0)))

    def paths(self, moves: int) -> Ints:
        """All [N, moves + 1, L], attested or not."""
        inner = np.array(list(product(*map(range, self.sizes))))
        ways = np.array(list(product(range(len(inner)), repeat=moves - 1)), dtype=np.int64)
        middle = inner[ways].reshape(len(ways), moves - 1, 3)
        first, last = (np.broadcast_to(end, (len(ways), 1, 3)) for end in (self.start, self.goal))
        return np.concatenate([first, middle, last], axis=1)

    def _listed(self, moves: int) -> tuple[Ints, Floats]:
        """All paths of so many moves, and what they cost."""
        paths = self.paths(moves)
        return paths, self.costs(paths)

    def costs(self, paths: Ints) -> Floats:
        total = np.full(len(paths), float(paths.shape[1] - 1))  # tau
        for chain in range(3):
            total += self.moves[chain][paths[:, :-1, chain], paths[:, 1:, chain]].sum(axis=1)
            if chain > 0:
                total += self.stands[chain - 1][paths[:, 1:, 0], paths[:, 1:, chain]].sum(axis=1)
        return total

    def best(
        self,
        moves: Iterable[int] = range(1, MOVES + 1),
        pin: tuple[int, str] | None = None,
        avoid: Sequence[tuple[int, int]] = (),
        via: tuple[States, int | None] | None = None,
        unlike: Sequence[States] = (),
        differ: float = 0.0,
    ) -> tuple[float, int]:
        """The least cost of all paths that do what is asked, and how many of them cost that."""
        every = []
        for count in moves:
            paths, cost = self.listed(count)
            inner, cost = paths[:, 1:-1], cost.copy()
            if pin:
                wanted = (self.start if pin[1] == "A" else self.goal)[pin[0]]
                cost[(inner[:, :, pin[0]] != wanted).any(axis=1)] = np.inf
            for chain, state in avoid:
                cost[(inner[:, :, chain] == state).any(axis=1)] = np.inf
            if via:
                there = (inner == via[0]).all(axis=2)
                if via[1] is not None:
                    there &= np.arange(1, count) == via[1]
                cost[~there.any(axis=1)] = np.inf
            for other in unlike:
                cost[(inner != other[1:-1]).mean(axis=(1, 2)) < differ] = np.inf
            every.append(cost)
        costs = np.concatenate(every)
        least = float(costs.min())
        return least, int((costs < least + 1e-6).sum())


# --- all that can be asked, at once -----------------------------------------------------------------------------------


@settings(max_examples=60, deadline=None)
@given(
    bodies, seeds, st.booleans(), st.booleans(), st.integers(0, 2), st.integers(0, 2), st.sampled_from([0.0, 0.3, 1.0])
)
def test_combined_requests_cost_the_same_as_by_enumeration(
    body: int, seed: int, pinned: bool, passed: bool, avoided: int, others: int, novelty: float
) -> None:
    movement, rng = clips(body), np.random.default_rng(seed)
    engine, ends = learned_from(body), two(movement, seed)
    book = Book(engine, movement, ends, novelty)
    names = BODY.names
    moves = (int(rng.integers(1, MOVES + 1)), MOVES)
    asked: dict[str, Any] = {"moves": moves, "novelty": novelty, "differ": 0.25, "guide": 0.0}
    listed: dict[str, Any] = {"moves": range(moves[0], MOVES + 1), "differ": 0.25}
    if pinned:
        chain, end = int(rng.integers(3)), str(rng.choice(["A", "B"]))
        asked["pin"], listed["pin"] = {names[chain]: end}, (chain, end)
    if avoided:
        chains = rng.integers(3, size=avoided)
        listed["avoid"] = [(int(chain), int(rng.integers(book.sizes[chain]))) for chain in chains]
        asked["avoid"] = [(names[chain], state) for chain, state in listed["avoid"]]
    if passed:
        frame, move = int(rng.integers(len(movement[0]))), int(rng.integers(1, MOVES)) if rng.random() < 0.5 else None
        through = movement[0].posture(frame)
        asked["via"] = [through if move is None else (through, move)]
        listed["via"] = (engine.space.assign(through.rotations[None])[0], move)
    plain = join(engine, ends, **asked)
    assert (np.inf if plain is None else plain.cost) == pytest.approx(book.best(**listed)[0], abs=SAME)
    assert plain is None or plain.status == "optimal"
    if plain is None or plain.moves == 1 or others == 0:
        return
    same = {"moves": plain.moves, "novelty": 1.0 - novelty, "guide": 0.0}
    asked["unlike"] = [plain, *(tween for _ in range(others - 1) if (tween := join(engine, ends, **same)) is not None)]
    listed |= {"unlike": [tween.path for tween in asked["unlike"]], "moves": [plain.moves]}
    found, (least, _) = join(engine, ends, **asked), book.best(**listed)
    assert (found is None) == (least == np.inf)
    if found is not None:
        assert found.lower_bound <= least + SAME <= found.cost + 2 * SAME
        assert min(found.differs) >= listed["differ"]


@settings(max_examples=60, deadline=None)
@given(bodies, seeds, st.booleans(), st.integers(0, 2), st.booleans(), st.sampled_from([1, 200_000]))
def test_the_cost_of_a_restriction_is_that_of_enumeration(
    body: int, seed: int, pinned: bool, avoided: int, timed: bool, node_budget: int
) -> None:
    movement, rng = clips(body), np.random.default_rng(seed)
    engine, ends = learned_from(body), two(movement, seed)
    book, names = Book(engine, movement, ends), BODY.names
    asked: dict[str, Any] = {"max_moves": MOVES, "moves": None, "node_budget": node_budget}
    listed: dict[str, Any] = {}
    freed: dict[str, dict[str, Any]] = {}
    if pinned:
        chain, end = int(rng.integers(3)), str(rng.choice(["A", "B"]))
        asked["pin"], listed["pin"] = {names[chain]: end}, (chain, end)
        freed[f"pin {names[chain]}={end}"] = {"pin": None}
    if avoided:
        chains = rng.permutation(3)[:avoided]
        listed["avoid"] = [(int(chain), int(rng.integers(book.sizes[chain]))) for chain in chains]
        asked["avoid"] = [(names[chain], state) for chain, state in listed["avoid"]]
        for chain, state in listed["avoid"]:
            others = [one for one in listed["avoid"] if one[0] != chain]
            freed[f"avoid {names[chain]}={state}"] = {"avoid": others}
    if timed:
        asked["moves"] = int(rng.integers(1, MOVES + 1))
        listed["moves"] = [asked["moves"]]
        freed[f"moves {asked['moves']}"] = {"moves": range(1, MOVES + 1)}
    found = join(engine, ends, what_if=True, **asked)
    if found is None:
        return
    assert {one.without for one in found.what_if} == freed.keys()
    for one in found.what_if:
        difference = book.best(**listed)[0] - book.best(**listed | freed[one.without])[0]
        assert difference >= -SAME
        assert max(one.least - SAME, 0.0) <= difference + SAME <= one.most + 3 * SAME
        assert one.proven == (one.most - one.least <= SAME)


# --- the same problem, put in another way -----------------------------------------------------------------------------


@settings(max_examples=12, deadline=None)
@given(bodies, seeds)
def test_joints_by_other_names_in_another_order_take_the_same_path(body: int, seed: int) -> None:
    other, order = Skeleton("other", ("pelvis", "foot", "hand"), (-1, 0, 0), np.zeros((3, 3))), [0, 2, 1]
    movement = clips(body)
    moved = [Motion(other, m.rotations[:, order], m.root, m.times, m.name) for m in movement]
    engine, ends = learned_from(body), two(movement, seed)
    mine, theirs = join(engine, ends), join(learned(moved), two(moved, seed))
    assert (mine is None) == (theirs is None)
    if mine is not None and theirs is not None:
        assert theirs.cost == pytest.approx(mine.cost, abs=SAME)
        if Book(engine, movement, ends).best()[1] == 1:
            np.testing.assert_array_equal(theirs.path, mine.path[:, order])


@settings(max_examples=15, deadline=None)
@given(bodies, seeds, st.booleans())
def test_every_clip_twice_says_the_same_once_the_pseudo_count_is_doubled_too_or_nothing_coordinates(
    body: int, seed: int, coordinated: bool
) -> None:
    """(2 N(p, c) + 2 a m(c)) / (2 N(p) + 2 a) is P(c | p) as it was, and so is 2 C(s, s') / 2 C(s)."""
    movement = clips(body)
    again = [replace(motion, name=motion.name + " again") for motion in movement]
    ends, asked = two(movement, seed), {"lambda_": float(coordinated), "guide": 0.0}
    engine = learned_from(body)
    once = join(engine, ends, **asked)
    with pytest.MonkeyPatch.context() as patch:
        if coordinated:
            patch.setattr(coordination, "PRIOR_WEIGHT", 2.0 * coordination.PRIOR_WEIGHT)
        twice = join(learned([*movement, *again]), ends, **asked)
    assert (once is None) == (twice is None)
    if once is not None and twice is not None:
        assert twice.cost == pytest.approx(once.cost, abs=1e-9)
        if coordinated and Book(engine, movement, ends).best()[1] == 1:
            np.testing.assert_array_equal(twice.path, once.path)


def test_every_clip_twice_says_more_of_how_joints_coordinate_if_the_pseudo_count_stays() -> None:
    movement = clips(0)
    ends = movement[0].posture(0), movement[0].posture(2)
    once, twice = (join(learned(some), ends) for some in (movement, movement * 2))
    assert once is not None
    assert twice is not None
    assert abs(once.cost - twice.cost) > 1e-3


@settings(max_examples=25, deadline=None)
@given(bodies, seeds)
def test_an_avoided_state_that_the_best_path_does_not_visit_changes_nothing(body: int, seed: int) -> None:
    movement = clips(body)
    engine, ends = learned_from(body), two(movement, seed)
    free = join(engine, ends)
    assume(free is not None and Book(engine, movement, ends).best()[1] == 1)
    assert free is not None
    elsewhere = [
        (name, state)
        for chain, name in enumerate(BODY.names)
        for state in range(engine.space.sizes[chain])
        if state not in free.path[1:-1, chain]
    ]
    kept = join(engine, ends, avoid=elsewhere)
    assert kept is not None
    assert kept.cost == free.cost
    np.testing.assert_array_equal(kept.path, free.path)


# --- toys -------------------------------------------------------------------------------------------------------------


@settings(max_examples=100, deadline=None)
@given(seeds, st.booleans())
def test_the_best_number_of_moves_asked_for_gives_the_best_path(seed: int, frustrated: bool) -> None:
    toy = random_toy(seed, frustrated=frustrated)
    free = solution(toy.problem(toy.rules(1, 6)))
    assume(free is not None)
    assert free is not None
    moves = len(free.path) - 1
    fixed = solution(toy.problem(toy.rules(moves, moves)))
    assert fixed is not None
    assert fixed.cost == pytest.approx(free.cost, abs=SAME)
    assert toy.cost(fixed.path) == pytest.approx(toy.cost(free.path), abs=SAME)


@settings(max_examples=100, deadline=None)
@given(seeds, st.booleans())
def test_where_moves_cost_the_same_both_ways_the_way_back_costs_what_the_way_there_does(
    seed: int, frustrated: bool
) -> None:
    """But for how the body stands at the end that is arrived at; holds are attested, and no wait is cheaper."""
    toy = random_toy(seed, frustrated=frustrated)
    both = tuple(np.minimum(table, table.T) for table in toy.edges)
    for table in both:
        np.fill_diagonal(table, np.diag(table).clip(max=1.0))
    there = replace(toy, edges=both, wait=10.0)
    back = replace(there, start=there.goal, goal=there.start)

    def stand(states: tuple[int, ...]) -> float:
        coupled = [chain for chain, parent in enumerate(toy.parents) if parent >= 0]
        return sum(toy.coupling(chain)[states[toy.parents[chain]], states[chain]] for chain in coupled)

    first, second = (solution(body.problem(body.rules(2, 5))) for body in (there, back))
    assert (first is None) == (second is None)
    if first is not None and second is not None:
        assert first.cost - stand(there.goal) == pytest.approx(second.cost - stand(back.goal), abs=SAME)
        assert back.cost(first.path[::-1]) == pytest.approx(second.cost, abs=SAME)
