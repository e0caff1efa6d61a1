"""The search over all numbers of moves, and the certificate."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass
from time import perf_counter
from typing import Literal, NamedTuple, TypeVar

import numpy as np

from motionmind._typing import Floats, Int32s, Ints
from motionmind.search import astar, pair_chains
from motionmind.search import trws as bound
from motionmind.search.polish import path_cost, polish
from motionmind.search.problem import Model, Rules, Via, costs_to_go, with_waits
from motionmind.search.segments import Segments
from motionmind.search.trellis import Trellis, build_trellis

SWEEPS_AT_ONCE = 2  # few, for fixing pays at once: 2 is fastest of 1 to 8 on real ballet
STALLED = (
    0.9  # sweeps of messages that leave more than this share of the gap, and of the positions, give way to pair chains
)
PAIR_CHAIN_SWEEPS = 100  # at most, for each number of moves
PAIR_CHAINS_STALLED = 0.98  # as STALLED; then A* takes over
WORTH_POLISHING = 0.1  # a path that costs no more than this share above the best is worth polishing
MOST_STATES_OF_CHAIN = 1 << 16  # of a chain: A* numbers them in 16 bits
MOST_PAIRS = 1 << 23  # of states in pair chains, 32 bytes each: more are not made, nor kept for A*
SECONDS_UNWATCHED = 0.1  # that pass before whoever watches is asked again
PROVEN = 1e-6  # nats: an answer within this of its lower bound is reported as optimal

_Result = TypeVar("_Result")
Status = Literal["optimal", "bounded", "interrupted", "sampled"]


class Progress(NamedTuple):
    """How far a search is: the cost of the best path so far, infinite before there is any, what is proven of all paths,
    and the nodes that A* has expanded."""

    cost: float
    lower_bound: float
    expansions: int


Watch = Callable[[Progress], bool | None]


@dataclass(frozen=True, eq=False)
class Certificate:
    """The best path found and how close to the best it provably is.

    Attributes:
        path: states [T + 1, L].
        cost: its cost in nats.
        lower_bound: no path within the rules costs less than this, in nats.
        status: "optimal" where both agree to 1e-6 nats, else "interrupted" if it was, else "bounded";
            "sampled" where the path was drawn and not sought.
        expansions: nodes expanded by A*.
        peak_nodes: the greatest number of nodes held at once.
        seconds: of the parts "problem", "bound" and "search"; a measurement, and no part of the proof.
        passed: the moves at which it passes its vias.
    """

    path: Int32s
    cost: float
    lower_bound: float
    status: Status
    expansions: int
    peak_nodes: int
    seconds: dict[str, float]
    passed: tuple[int, ...] = ()


def solve(
    model: Model, start: Ints, goal: Ints, rules: Rules, vias: Sequence[Via] = (), watch: Watch | None = None
) -> Certificate | None:
    """The best path from states `start` [L] to `goal` [L] over all numbers of moves; None where there is none.

    Numbers of moves are looked at in the order of what the chains cost on their own, as long as that is below the best
    path found, and bounded; those that this leaves undecided are searched. The least bound of all proves the answer.

    It passes through `vias` in their order, which divide it into segments of at least one move; with vias it is numbers
    of moves of a segment that are looked at, each below what the best path leaves when the other segments cost as
    little as is proven.

    `watch` is told between pieces of work how far the search is; where it returns True the search ends as soon as any
    path is known, with what is proven by then.
    """
    if np.diff(model.starts).max() > MOST_STATES_OF_CHAIN:
        raise ValueError(
            f"a chain has {np.diff(model.starts).max()} states; the search takes up to {MOST_STATES_OF_CHAIN}"
        )
    clock = _Clock()
    held = with_waits(model, goal, rules.wait)
    stops = [start, *(via.states for via in vias), goal]
    to_go = [costs_to_go(held, stop, rules.longest) for stop in stops[1:]]
    segments = Segments(separate_costs(held, stops, to_go, rules), rules.shortest, [via.move for via in vias])
    clock.lap("problem")

    expansions, peak = 0, 0
    attention = _Attention(watch, lambda: Progress(segments.best, segments.lower_bound(), expansions))
    left: dict[tuple[int, int], tuple[Trellis, pair_chains.PairChains]] = {}  # what is left to search
    kept = 0  # pairs in it
    while True:
        segment, moves, least, below = segments.most_promising()
        if not least < segments.best - PROVEN or (attention.ends() and np.isfinite(segments.best)):
            break
        toll = rules.per_move * moves
        known = _Known(build_trellis(held, stops[segment], moves, to_go[segment], below - toll), below - toll)
        clock.lap("problem")
        messages = _tighten_by_messages(known, rules.sweeps, attention)
        if (
            not (known.settled or attention.ends())
            and len(start) > 1
            and pair_chains.pairs(known.trellis) <= MOST_PAIRS
        ):
            cut = _tighten_by_pair_chains(known, pair_chains.cut(known.trellis, messages), attention)
            if not known.settled and kept + len(cut.stand) <= MOST_PAIRS:
                left[segment, moves] = known.trellis, cut
                kept += len(cut.stand)
        segments.learn(segment, moves, known.proven + toll, known.cost + toll, known.states)
        clock.lap("bound")
    segments.reopen(left)
    while True:
        segment, moves, least, below = segments.most_promising()
        if not least < segments.best - PROVEN or attention.ends():
            break
        toll, budget = rules.per_move * moves, rules.node_budget - expansions
        found = _search(*left.pop((segment, moves)), below - toll, rules.node_budget, budget, attention)
        segments.learn(segment, moves, found.proven + toll, found.cost + toll, found.states)
        expansions, peak = expansions + found.expansions, max(peak, found.peak)
        clock.lap("search")
    if not np.isfinite(segments.best):
        return None
    lower, (path, passed) = segments.lower_bound(), segments.path()
    status: Status = (
        "optimal" if segments.best - lower <= PROVEN else "interrupted" if attention.ended[0] else "bounded"
    )
    return Certificate(path, segments.best, lower, status, expansions, peak, clock.seconds, passed)


def feasible(model: Model, start: Ints, goal: Ints, rules: Rules, vias: Sequence[Via]) -> bool:
    """Whether there is any path from `start` to `goal` through `vias`."""
    held = with_waits(model, goal, rules.wait)
    stops = [start, *(via.states for via in vias), goal]
    to_go = [costs_to_go(held, stop, rules.longest) for stop in stops[1:]]
    segments = Segments(separate_costs(held, stops, to_go, rules), rules.shortest, [via.move for via in vias])
    return bool(np.isfinite(segments.lower_bound()))


def separate_costs(held: Model, stops: Sequence[Ints], to_go: Sequence[Floats], rules: Rules) -> Floats:
    """What each of K segments costs at least, its chains on their own, at each number of moves [K, longest + 1].

    Infinite where a segment cannot have as many moves, and finite where it can. `held` has its waits, and `to_go` leads
    to each stop but the first.
    """
    moves = np.arange(rules.longest + 1)
    out = np.array(
        [
            costs[:, held.starts[:-1] + stop].sum(axis=1) + rules.per_move * moves
            for stop, costs in zip(stops[:-1], to_go, strict=True)
        ]
    )
    if len(out) > 1:
        out[:, 0] = np.inf
    if not all(held.allowed[held.starts[:-1] + stop].all() for stop in stops[1:-1]):
        out[:] = np.inf
    return out


class _Known:
    """What is known of one number of moves.

    Attributes:
        trellis: what is left of it: no path cheaper than `cost` lies outside.
        cost: of the best path found, or what it has to be cheaper than.
        states: the best path found [T + 1, L]; empty until then.
        proven: no path that is cheaper than `cost` costs less than this.
    """

    def __init__(self, trellis: Trellis, cost: float) -> None:
        self.trellis, self.cost, self.proven = trellis, cost, -np.inf
        self.states = np.zeros((0, trellis.chains), dtype=np.int32)

    @property
    def settled(self) -> bool:
        """Whether bound and path meet, or nothing is left that a better path could go through."""
        return self.proven >= self.cost - PROVEN

    def learn(self, proven: float, chosen: Ints) -> None:
        """A bound, and a path of positions [n], which is polished if it is near the best."""
        if path_cost(self.trellis, chosen) <= self.cost + WORTH_POLISHING * abs(self.cost):
            cost = polish(self.trellis, chosen)
            if cost < self.cost:
                self.cost, self.states = cost, _states(self.trellis, chosen)
        self.proven = min(max(self.proven, proven), self.cost)

    def prune(self, trellis: Trellis) -> None:
        """What is left of the trellis: if a domain of it is empty, nothing."""
        self.trellis = trellis
        if np.any(np.diff(trellis.dom_ptr) == 0):
            self.proven = self.cost

    def stalls(self, gap: float, size: int, share: float) -> bool:
        """Whether more than a share is left of the gap and of the number of positions that there were."""
        return self.cost - self.proven > share * gap and len(self.trellis.dom) > share * size


def _tighten_by_messages(known: _Known, sweeps: int, attention: _Attention) -> bound.Messages:
    """Bound a number of moves by messages, of which the last are returned.

    Every few sweeps the path that they met is polished, and positions that no better path goes through are taken out
    of the trellis; until bound and path meet, or what separates them hardly shrinks, or it is to end.
    """
    messages = bound.no_messages(known.trellis)
    for done in range(0, sweeps, SWEEPS_AT_ONCE):
        gap, size = known.cost - known.proven, len(known.trellis.dom)
        chosen = np.zeros(len(known.trellis.dom_ptr) - 1, dtype=np.int64)
        proven, _ = bound.tighten(known.trellis, messages, chosen, min(SWEEPS_AT_ONCE, sweeps - done), known.cost)
        known.learn(proven, chosen)
        if known.settled:
            break
        trellis, messages = bound.prune(known.trellis, messages, known.cost - astar.SAME)
        known.prune(trellis)
        if known.settled or attention.ends() or (done and known.stalls(gap, size, STALLED)):
            break
    return messages


def _tighten_by_pair_chains(
    known: _Known, cut: pair_chains.PairChains, attention: _Attention
) -> pair_chains.PairChains:
    """Go on by pair chains, in the same way; the last are returned."""
    known.proven = max(known.proven, min(pair_chains.proven(cut), known.cost))
    for done in range(PAIR_CHAIN_SWEEPS):
        if known.settled:
            break
        gap, size = known.cost - known.proven, len(known.trellis.dom)
        chosen, through = np.zeros(len(known.trellis.dom_ptr) - 1, dtype=np.int64), np.zeros(size)
        proven = pair_chains.sweep(known.trellis, cut, through)
        pair_chains.descend(known.trellis, cut, chosen)
        known.learn(proven, chosen)
        if not known.settled:
            trellis, cut = pair_chains.prune(known.trellis, cut, through, known.cost - astar.SAME)
            known.prune(trellis)
        if attention.ends() or (done and known.stalls(gap, size, PAIR_CHAINS_STALLED)):
            break
    return cut


class _Searched(NamedTuple):
    """The best path that A* found, what it proved, and what it took."""

    cost: float
    states: Int32s
    proven: float
    expansions: int
    peak: int


def _search(
    trellis: Trellis, cut: pair_chains.PairChains, below: float, nodes: int, budget: int, attention: _Attention
) -> _Searched:
    """Search the parts of the body that nothing couples any more, each with the others on one path.

    What a path costs more than that one, or less, is the sum of what it does so in each part. So what is proven of each
    part adds up; and a part needs to be searched only up to what, with the best that the others may save, would come
    below `below`. Searched all at once, every near-best way of one part would be tried with those of all others.
    """
    chosen = np.zeros(len(trellis.dom_ptr) - 1, dtype=np.int64)
    pair_chains.descend(trellis, cut, chosen)
    cost = polish(trellis, chosen)
    states = _states(trellis, chosen)
    part = _parts(trellis)
    part_of = np.repeat(np.resize(part, len(chosen)), np.diff(trellis.dom_ptr))
    on_path = np.isin(np.arange(len(part_of)), chosen)
    separate_costs = {}
    for name in np.unique(part):
        separate_costs[name] = pair_chains.prune(trellis, cut, np.where(on_path | (part_of == name), 0.0, np.inf), 1.0)
    may_save = {name: max(cost - pair_chains.proven(fewer), 0.0) for name, (_, fewer) in separate_costs.items()}
    saved, expansions, peak = 0.0, 0, 0
    for name in sorted(may_save, key=lambda name: may_save[name]):
        others = sum(may_save.values()) - may_save[name]
        smaller, fewer = separate_costs.pop(name)
        known = _Known(smaller, min(cost, below + others))
        fewer = _tighten_by_pair_chains(known, fewer, attention)
        if not known.settled and expansions < budget and not attention.ends():
            chosen = np.zeros(len(chosen), dtype=np.int64)
            found, proven, expanded, held = attention.pay(
                astar.search,
                known.trellis,
                fewer,
                pair_chains.proven(fewer),
                known.cost,
                chosen,
                nodes,
                budget - expansions,
            )
            if found < known.cost:
                known.cost, known.states = found, _states(known.trellis, chosen)
            known.proven, expansions, peak = max(known.proven, proven), expansions + expanded, max(peak, held)
        may_save[name] = cost - known.proven
        if len(known.states) > 0:
            saved += cost - known.cost
            states[:, part == name] = known.states[:, part == name]
    return _Searched(cost - saved, states, cost - sum(may_save.values()), expansions, peak)


def _parts(trellis: Trellis) -> Ints:
    """The first chain of the part that each chain belongs to [L].

    A coupling joins two chains only where there is a move at which both have more than one position left.
    """
    part, many = np.arange(trellis.chains), np.diff(trellis.dom_ptr).reshape(-1, trellis.chains) > 1
    for chain, parent in enumerate(trellis.parents):
        if parent >= 0 and np.any(many[:, chain] & many[:, parent]):
            part[chain] = part[parent]
    return part


def _states(trellis: Trellis, chosen: Ints) -> Int32s:
    """States [T + 1, L] of a path of positions."""
    return trellis.dom[chosen].reshape(trellis.moves + 1, trellis.chains)


class _Attention:
    """Whether the search is to end before its time: what `watch` says when it is told how far the search is.

    Attributes:
        ended: whether it said so [1].
    """

    def __init__(self, watch: Watch | None, so_far: Callable[[], Progress]) -> None:
        self.ended = np.zeros(1, dtype=bool)
        self._watch, self._so_far = watch, so_far

    def ends(self) -> bool:
        """Whether the search is to end."""
        if self._watch is not None and not self.ended[0]:
            self.ended[0] = bool(self._watch(self._so_far()))
        return bool(self.ended[0])

    def pay(self, work: Callable[..., _Result], *arguments: object) -> _Result:
        """Do long compiled work, in a thread of its own where somebody watches, who is then asked meanwhile.

        The work gets `ended` as its last argument, and stops when it is set.
        """
        if self._watch is None:
            return work(*arguments, self.ended)
        with ThreadPoolExecutor(1) as pool:
            result = pool.submit(work, *arguments, self.ended)
            try:
                while not wait([result], SECONDS_UNWATCHED).done:
                    self.ends()
            except BaseException:
                self.ended[0] = True  # what is thrown by `watch`, or by Ctrl-C, is not to wait for the work
                raise
            return result.result()


class _Clock:
    """Seconds spent since the last lap, added up by name."""

    def __init__(self) -> None:
        self.seconds = {"problem": 0.0, "bound": 0.0, "search": 0.0}
        self._last = perf_counter()

    def lap(self, name: str) -> None:
        now = perf_counter()
        self.seconds[name] += now - self._last
        self._last = now
