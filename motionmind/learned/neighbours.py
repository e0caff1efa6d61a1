"""Neighbours: a ball tree over a corpus's samples for each body part, for fast nearest-neighbour searches.

The distance of two postures of a part is the root mean square over its joints of 2 sin(angle / 2), radians: that of
their rotation matrices, up to a factor. A node is a ball around its samples. Two distant samples divide them: each
child takes the half that is nearer to one of the two. Source: Omohundro, "Five balltree construction algorithms", ICSI
TR-89-063 (1989).

A leaf stores its samples' orientations of the part contiguously, one byte per number, so that a search
(`motionmind.learned.nearest`) reads a leaf in one piece; the full orientations are scattered over gigabytes. The bytes
distort distances of near samples by about 0.01 radians per joint.

The trees of all parts halve equal numbers of samples, so they share one table of node ranges: node n has the children
2 n + 1 and 2 n + 2, and a node of the last level is a leaf.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionmind._typing import Floats, Int8s, Int32s, Ints, Singles
from motionmind.body.limbs import parts_of
from motionmind.body.skeleton import Skeleton
from motionmind.executors.workshop import Workshop
from motionmind.geometry.distances import squared_distance
from motionmind.jit import jit, read_only

MAX_FULL_SEARCH = 8000  # samples of a corpus without trees
N_BLOCK_SAMPLES = 2048  # copied at a time
MAX_LEAF_SAMPLES = 32
N_SAMPLES_FOR_CENTRE = 64  # of a node, also used to halve it
MAX_COPIED_BYTES = 1 << 26  # larger arrays of centres are not copied
_CENTRE_SLACK_RAD = 1e-6  # for the rounding of centres
CODE_SCALE = 127.0


@dataclass(frozen=True, eq=False)
class Neighbours:
    """The trees of P body parts over N samples, each of K nodes.

    Attributes:
        parts: joints of each part.
        order: the samples of each part's tree, leaf after leaf [P, N].
        ranks: rank of each sample in that order [P, N].
        bounds: range of each node in that order, end excluded [K, 2].
        centres: centres of the nodes, with the joints of all parts concatenated [K, W, 4].
        radii: radii of the nodes [P, K], radians.
        weights: total weight of each node's samples [P, K].
        codes: orientations of the samples, in 127ths, part after part and leaf after leaf; for each leaf of n samples
            and m joints, 4 m rows of n numbers.
    """

    parts: tuple[Ints, ...]
    order: Int32s
    ranks: Int32s
    bounds: Int32s
    centres: Singles
    radii: Floats
    weights: Floats
    codes: Int8s

    @property
    def arrays(self) -> dict[str, NDArray[Any]]:
        """The arrays by name."""
        return {field.name: getattr(self, field.name) for field in fields(self) if field.name != "parts"}

    def centres_of(self, number: int) -> Singles:
        """Return the centres of the nodes of a part's tree [K, m, 4]."""
        start, stop = self._joints_of(number)
        return self.centres[:, start:stop]

    @cached_property
    def centres_apart(self) -> tuple[Singles, ...]:
        """The centres of the nodes of each part's tree [K, m, 4], for searches.

        Unless they are large, they are copied to make sibling nodes contiguous.
        """
        own = [self.centres_of(number) for number in range(len(self.parts))]
        if self.centres.nbytes > MAX_COPIED_BYTES:
            return tuple(own)
        # A spare joint makes the copies views, like uncopied centres, so that loops compile for a single array type.
        roomy = [np.empty((len(one), one.shape[1] + 1, 4), np.float32)[:, :-1] for one in own]
        for copy, one in zip(roomy, own, strict=True):
            copy[:] = one
        return tuple(read_only(copy) for copy in roomy)

    def codes_of(self, number: int) -> Int8s:
        """Return the codes of a part [N * m * 4]; empty if the corpus has none."""
        start, stop = self._joints_of(number)
        numbers = 4 * self.order.shape[1]
        return self.codes[numbers * start : numbers * stop]

    def _joints_of(self, number: int) -> tuple[int, int]:
        """Return the range of a part's joints among the concatenated joints of all parts."""
        start = sum(len(part) for part in self.parts[:number])
        return start, start + len(self.parts[number])


def build_neighbours(
    skeleton: Skeleton, orientations: Floats, weights: Floats, workshop: Workshop | None = None
) -> Neighbours:
    """Build the trees of all parts of a body (`parts_of`).

    Args:
        skeleton: the body.
        orientations: of the joint chains in N samples, joints first [N, L, 4].
        weights: of the samples [N].
        workshop: threads, one job per part, and room for large arrays; None for the current thread and memory.
    """
    workshop = workshop or Workshop()
    parts, bounds = parts_of(skeleton), node_bounds(len(orientations))
    order, ranks = (workshop.empty((len(parts), len(orientations)), np.int32) for _ in range(2))
    radii, sums = np.empty((2, len(parts), len(bounds)))
    joints = sum(map(len, parts))
    centres = workshop.empty((len(bounds), joints, 4), np.float32)
    codes = workshop.empty((len(orientations) * joints * 4,), np.int8)
    trees = Neighbours(parts, order, ranks, bounds, centres, radii, sums, codes)

    def grow(number: int) -> None:
        shown = workshop.empty((len(orientations), len(parts[number]), 4), np.float32)
        for start in range(0, len(orientations), N_BLOCK_SAMPLES):
            shown[start : start + N_BLOCK_SAMPLES] = orientations[start : start + N_BLOCK_SAMPLES, parts[number]]
        _grow(shown, bounds, order[number], trees.centres_of(number), radii[number])
        _encode(shown, bounds, trees.codes_of(number))
        ranks[number, order[number]] = np.arange(len(orientations), dtype=np.int32)
        total = np.concatenate([np.zeros(1), np.cumsum(weights[order[number]])])
        sums[number] = total[bounds[:, 1]] - total[bounds[:, 0]]

    workshop.do(grow, range(len(parts)))
    for array in trees.arrays.values():
        array.setflags(write=False)  # like loaded arrays (see `read_only`)
    return trees


def node_bounds(count: int) -> Int32s:
    """Return the range of each node of a tree over `count` samples [K, 2]."""
    levels = [np.array([[0, count]])]
    while (np.diff(levels[-1]) > MAX_LEAF_SAMPLES).any():
        start, stop = levels[-1].T
        middle = (start + stop) // 2
        levels.append(np.stack([start, middle, middle, stop], axis=1).reshape(-1, 2))
    return np.concatenate(levels).astype(np.int32)


def _grow(shown: Singles, bounds: Int32s, order: Int32s, centres: Singles, radii: Floats) -> None:
    """Grow the tree of a part, given its orientations [N, m, 4]: write the order [N] and the nodes' centres and radii.

    The orientations are sorted into that order, too, so that memory is read sequentially.
    """
    order[:] = np.arange(len(order))
    keys = np.empty(len(order))
    for node, (start, stop) in enumerate(bounds):
        own = shown[start:stop]
        radii[node] = _measure(own, centres[node], keys)
        if 2 * node + 2 < len(bounds):
            sorted_by_key = np.argsort(keys[: len(own)], kind="stable")
            order[start:stop] = order[start:stop][sorted_by_key]
            for j in range(own.shape[1]):  # one by one: a copy of all may not fit into memory
                own[:, j] = own[sorted_by_key, j]


@jit
def _measure(own: Singles, centre: Singles, keys: Floats) -> float:
    """Write a node's centre [m, 4] and the keys that halve its n samples [n, m, 4]; return its radius.

    A key is the squared distance to the sample farthest from the centre, minus that to the sample farthest from it [n].
    """
    sample = own[:: max(1, len(own) // N_SAMPLES_FOR_CENTRE)]
    _centre(sample, centre)
    one = sample[_farthest(sample, centre)]
    other = sample[_farthest(sample, one)]
    radius = 0.0
    for k in range(len(own)):
        radius = max(radius, squared_distance(own[k], centre))
        keys[k] = squared_distance(own[k], one) - squared_distance(own[k], other)
    return float(np.sqrt(radius / own.shape[1]) + _CENTRE_SLACK_RAD)


@jit
def _centre(shown: Singles, out: Singles) -> None:
    """Write the normalised means [m, 4] of orientations [n, m, 4], in the hemisphere of the first."""
    first = shown[0]
    for j in range(len(out)):
        mean = np.zeros(4)
        for k in range(len(shown)):
            one = shown[k, j]
            cosine = one[0] * first[j, 0] + one[1] * first[j, 1] + one[2] * first[j, 2] + one[3] * first[j, 3]
            for c in range(4):
                mean[c] += one[c] if cosine >= 0.0 else -one[c]
        length = np.sqrt(np.sum(mean**2))
        for c in range(4):
            out[j, c] = mean[c] / length if length > 1e-6 else first[j, c]


@jit
def _farthest(shown: Singles, posture: Singles) -> int:
    """Return the index of the sample [n, m, 4] farthest from a posture of the part [m, 4]."""
    far, farthest = -1.0, 0
    for k in range(len(shown)):
        away = squared_distance(shown[k], posture)
        if away > far:
            far, farthest = away, k
    return farthest


def _encode(shown: Singles, bounds: Int32s, codes: Int8s) -> None:
    """Write the codes [N * m * 4] of a part's orientations, given in its tree's order [N, m, 4]."""
    width = 4 * shown.shape[1]
    for start, stop in bounds[len(bounds) // 2 :]:
        own = shown[start:stop].reshape(-1, width).astype(np.float64)
        codes[width * start : width * stop] = np.round(CODE_SCALE * own.T).ravel()
