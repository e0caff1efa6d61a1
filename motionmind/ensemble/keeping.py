"""Keep dancers apart: the least shifts of entries and places with which nobody comes closer than a distance.

An entry shifts by whole counts, a place by steps of 10 cm. Whether two dancers keep their distance depends on both
shifts alone, so the search is over one choice for each dancer, with a table for each pair: branch and bound, proven
unless its budget is spent.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from motionmind._typing import Bools, Floats, Int32s
from motionmind.display import displayed
from motionmind.ensemble import KEEP_RANGE_M
from motionmind.ensemble.dancers import LEAST_RATE_HZ, Dancer, Ensemble, find_approaches
from motionmind.errors import MotionMindError
from motionmind.jit import jit

PLACE_STEP_M = 0.1  # of places
COUNT_WEIGHT_M = 0.5  # metres of a place that weigh as much as a count of an entry
MAX_PLACE_STEPS = 10  # of a place along x and z
MAX_COUNTS = 4  # of an entry
MAX_KEPT_DANCERS = 24
N_NODES = 20_000  # budget: some seconds for six dancers


@dataclass(frozen=True)
class Shift:
    """A dancer's shift.

    Attributes:
        counts: by how many counts the dancer enters later.
        place: by how much its place is shifted, x and z, metres.
    """

    counts: int
    place: tuple[float, float]

    @property
    def weight(self) -> float:
        """Weight of the shift: metres of the place, and half a metre for each count."""
        return float(np.hypot(*self.place)) + COUNT_WEIGHT_M * abs(self.counts)


@dataclass(frozen=True, eq=False)
class Kept:
    """Dancers who keep a distance.

    Attributes:
        ensemble: the shifted dancers.
        shifts: the shift of each.
        is_least: whether it is proven that no other shifts weigh less.
    """

    ensemble: Ensemble
    shifts: tuple[Shift, ...]
    is_least: bool


def keep_apart(
    ensemble: Ensemble, metres: float, *, steps: int = MAX_PLACE_STEPS, counts: int = MAX_COUNTS, nodes: int = N_NODES
) -> Kept:
    """Shift entries and places by the least with which all dancers keep a distance between their nearest joints.

    Entries stay without a tempo, and where formations change. A place shifts with all that follows; nobody leaves the
    stage who did not leave it before.

    Args:
        ensemble: the dancers.
        metres: the distance, from 0.01 to 2.
        steps: most steps of 10 cm of a place, along x and z.
        counts: most counts of an entry.
        nodes: budget of the search, in nodes.

    Raises:
        MotionMindError: there are more than 24 dancers, the distance is out of range, or no such shifts keep it.
    """
    low, high = KEEP_RANGE_M
    if not low <= metres <= high:
        raise MotionMindError(f"keep takes from {low:g} to {high:g} m, not {metres:g}")
    if len(ensemble.dancers) > MAX_KEPT_DANCERS:
        raise MotionMindError(f"keep is for up to {MAX_KEPT_DANCERS} dancers, not {len(ensemble.dancers)}")
    has_entries = ensemble.tempo is not None and not any(one.ways for one in ensemble.dancers)
    sought = metres
    while True:
        found, is_complete = _Search(ensemble, sought, steps, counts if has_entries else 0, nodes).run()
        is_least = is_complete and sought == metres  # lighter shifts may keep the distance, though not a larger one
        if found is None:
            raise MotionMindError(_obstacle(ensemble, metres, steps, counts if has_entries else 0, is_least=is_least))
        kept = Kept(_shifted(ensemble, found), found, is_least)
        # Frames between those of the search may be closer by some millimetres.
        nearest = min((one.metres for one in find_approaches(kept.ensemble.motions())), default=np.inf)
        if nearest >= metres - 1e-6:
            return kept
        sought += metres - nearest + 1e-4


def _shifted(ensemble: Ensemble, shifts: Sequence[Shift]) -> Ensemble:
    beat = 60.0 / (ensemble.tempo or 60.0)
    dancers = []
    for dancer, shift in zip(ensemble.dancers, shifts, strict=True):
        place = dancer.place[0] + shift.place[0], dancer.place[1] + shift.place[1]
        dancers.append(replace(dancer, place=place, entry=dancer.entry + beat * shift.counts))
    return replace(ensemble, dancers=tuple(dancers))


def _obstacle(ensemble: Ensemble, metres: float, steps: int, counts: int, *, is_least: bool) -> str:
    """Say why nothing was found."""
    within = f"{steps * PLACE_STEP_M:g} m and {counts} counts" if counts else f"{steps * PLACE_STEP_M:g} m"
    near = find_approaches(ensemble.motions())[0]
    pair = f"{displayed(near.names[0])} and {displayed(near.names[1])} come to {near.metres:.2f} m"
    if is_least:
        return f"{displayed(ensemble.name)}: no shifts within {within} keep all {metres:g} m apart; {pair}"
    return f"{displayed(ensemble.name)}: found no shifts within {within} that keep all {metres:g} m apart; {pair}"


class _Search:
    """Branch and bound over a choice [E, G, G] for each dancer: of counts, and of steps along x and z."""

    def __init__(self, ensemble: Ensemble, metres: float, steps: int, counts: int, nodes: int) -> None:
        self.ensemble, self.metres, self.steps, self.counts, self.nodes = ensemble, metres, steps, counts, nodes
        self.beat = 60.0 / (ensemble.tempo or 60.0)
        self.tables: dict[tuple[int, int, int], Bools] = {}
        self.joints: dict[tuple[int, int], Floats] = {}
        last = ensemble.seconds + 2 * counts * self.beat  # of one dancer against another
        rate = max(LEAST_RATE_HZ, 1.0 / float(np.diff(ensemble.times()[:2])[0]))
        self.times = np.arange(-np.ceil(2 * counts * self.beat * rate), np.ceil(last * rate) + 1.0) / rate
        e, x, z = np.ogrid[-counts : counts + 1, -steps : steps + 1, -steps : steps + 1]
        weights = PLACE_STEP_M * np.hypot(x, z) + COUNT_WEIGHT_M * np.abs(e)
        self.domains = [np.where(self._allowed(one), weights, np.inf) for one in ensemble.dancers]
        self.pairs = {pair: self._pair_bound(*pair) for pair in combinations(range(len(self.domains)), 2)}
        self.least, self.best = np.inf, None

    least: float
    best: dict[int, tuple[int, int, int]] | None

    def run(self) -> tuple[tuple[Shift, ...] | None, bool]:
        """Return the lightest shifts found, None for none, and whether the search was complete."""
        self._descend({}, 0.0, dict(enumerate(self.domains)))
        if self.best is None:
            return None, self.nodes > 0
        choices = [self.best[i] for i in range(len(self.domains))]
        shifts = tuple(
            Shift(e - self.counts, (PLACE_STEP_M * (x - self.steps), PLACE_STEP_M * (z - self.steps)))
            for e, x, z in choices
        )
        return shifts, self.nodes > 0

    def _allowed(self, dancer: Dancer) -> Bools:
        """Return which choices [E, G, G] let a dancer enter from count 1 on, and stay on the stage."""
        counts = np.arange(-self.counts, self.counts + 1)
        metres = PLACE_STEP_M * np.arange(-self.steps, self.steps + 1)
        enters = dancer.entry + self.beat * counts > -1e-9
        path = dancer.at(self.times).root[:, [0, 2]]
        half = 0.5 * np.array(self.ensemble.stage or (np.inf, np.inf))
        high, low = np.maximum(half, path.max(axis=0)), np.minimum(-half, path.min(axis=0))
        stays = [
            (path[:, axis].max() + metres <= high[axis] + 1e-9) & (path[:, axis].min() + metres >= low[axis] - 1e-9)
            for axis in (0, 1)
        ]
        return np.asarray(enters[:, None, None] & stays[0][:, None] & stays[1])

    def _pair_bound(self, i: int, k: int) -> float:
        """Return the least that a pair's shifts weigh together, whatever the others do."""
        if not self._table(i, k, 0)[2 * self.steps, 2 * self.steps]:
            return 0.0
        x, z = np.ogrid[-2 * self.steps : 2 * self.steps + 1, -2 * self.steps : 2 * self.steps + 1]
        apart = PLACE_STEP_M * np.hypot(x, z)
        least = np.inf
        for later in sorted(range(-2 * self.counts, 2 * self.counts + 1), key=abs):
            if COUNT_WEIGHT_M * abs(later) < least:
                free = ~self._table(i, k, later)
                least = min(least, COUNT_WEIGHT_M * abs(later) + float(apart[free].min(initial=np.inf)))
        return least

    def _table(self, i: int, k: int, later: int) -> Bools:
        """Return where [D, D] dancer k, entering so many counts later against i, may not be shifted against i."""
        key = i, k, later
        if key not in self.tables:
            sides = 4 * self.steps + 1
            edges = np.zeros((sides, sides + 1), dtype=np.int32)
            _mark(*self._moving(self._positions(i, 0), self._positions(k, later)), self.metres, PLACE_STEP_M, edges)
            self.tables[key] = np.cumsum(edges, axis=1)[:, :-1] > 0
        return self.tables[key]

    def _positions(self, i: int, later: int) -> Floats:
        key = i, later
        if key not in self.joints:
            dancer = self.ensemble.dancers[i]
            moved = replace(dancer, entry=dancer.entry + later * self.beat)
            self.joints[key] = moved.at(self.times).positions()
        return self.joints[key]

    @staticmethod
    def _moving(one: Floats, other: Floats) -> tuple[Floats, Floats]:
        """Return the joints of two bodies without the frames in which neither moves."""
        moves = (np.diff(one, axis=0) != 0.0).any(axis=(1, 2)) | (np.diff(other, axis=0) != 0.0).any(axis=(1, 2))
        frames = np.flatnonzero(np.append(True, moves))
        return one[frames], other[frames]

    def _descend(self, chosen: dict[int, tuple[int, int, int]], weight: float, domains: dict[int, Floats]) -> None:
        """Choose for one more dancer, the lightest first.

        Args:
            chosen: the choices so far.
            weight: their weight.
            domains: weights of the choices [E, G, G] that the others still have, infinite for those they have not.
        """
        if self.nodes <= 0:
            return
        self.nodes -= 1
        if not domains:
            self.least, self.best = weight, chosen
            return
        least = {k: float(domain.min()) for k, domain in domains.items()}
        if weight + self._bound(least) >= self.least - 1e-9:
            return
        # The one who must move most, then who has most neighbours in the way.
        i = max(domains, key=lambda k: (least[k], sum(self.pairs[min(k, j), max(k, j)] for j in domains if j != k)))
        domain = domains[i]
        order = np.argsort(domain, axis=None, kind="stable")
        for flat in order.tolist():
            own = float(domain.flat[flat])
            if not weight + own < self.least - 1e-9 or self.nodes <= 0:
                break
            choice = tuple(int(at) for at in np.unravel_index(flat, domain.shape))
            rest = {k: self._pruned(i, choice, k, other) for k, other in domains.items() if k != i}
            self._descend({**chosen, i: choice}, weight + own, rest)  # type: ignore[dict-item]

    def _bound(self, least: dict[int, float]) -> float:
        """Return a lower bound of the weight of the rest: disjoint pairs, and the others alone."""
        free, bound = dict(least), 0.0
        for (i, k), both in sorted(self.pairs.items(), key=lambda item: -item[1]):
            if both > 0.0 and i in free and k in free:
                bound += max(both, free.pop(i) + free.pop(k))
        return bound + sum(free.values())

    def _pruned(self, i: int, choice: tuple[int, ...], k: int, domain: Floats) -> Floats:
        """Return a domain [E, G, G] without the choices of k that come too close to the choice of i."""
        e, x, z = choice
        sides, out = 2 * self.steps + 1, domain.copy()
        for own in range(len(domain)):
            if i < k:
                table = self._table(i, k, own - e)
                blocked = table[2 * self.steps - x : 2 * self.steps - x + sides, 2 * self.steps - z :][:, :sides]
            else:
                table = self._table(k, i, e - own)[::-1, ::-1]
                blocked = table[2 * self.steps - x : 2 * self.steps - x + sides, 2 * self.steps - z :][:, :sides]
            out[own][blocked] = np.inf
        return out


@jit
def _mark(one: Floats, other: Floats, metres: float, step: float, edges: Int32s) -> None:
    """Mark the shifts of a body against another with which two of their joints come too close in some frame.

    Args:
        one: joints of the body that stays [T, J, 3], metres.
        other: those of the body that is shifted [T, K, 3].
        metres: the distance to keep.
        step: of the shifts, metres.
        edges: counts, for shifts [D, D + 1] by steps along x and z, 0 in their middle, the stretches of z that are too
            close: one more where a stretch begins, one less after its end.
    """
    middle = len(edges) // 2
    most = metres + step * middle
    for t in range(len(one)):
        for j in range(one.shape[1]):
            for k in range(other.shape[1]):
                dx, dz = other[t, k, 0] - one[t, j, 0], other[t, k, 2] - one[t, j, 2]
                dy = other[t, k, 1] - one[t, j, 1]
                square = metres * metres - dy * dy - 1e-9
                if square <= 0.0 or abs(dx) > most or abs(dz) > most:
                    continue
                wide = np.sqrt(square)
                first = max(0, int(np.ceil((-wide - dx) / step)) + middle)
                last = min(len(edges) - 1, int(np.floor((wide - dx) / step)) + middle)
                for x in range(first, last + 1):
                    deep = np.sqrt(max(square - (dx + step * (x - middle)) ** 2, 0.0))
                    begin = max(0, int(np.ceil((-deep - dz) / step)) + middle)
                    end = min(len(edges) - 1, int(np.floor((deep - dz) / step)) + middle)
                    if begin <= end:
                        edges[x, begin] += 1
                        edges[x, end + 1] -= 1
