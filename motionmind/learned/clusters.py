"""Clusters of postures for each body part, in time proportional to the number of postures, not to its square.

`squared_distance` of two postures is the squared Euclidean distance between their rotation matrices [m, 3, 3], each
divided by the square root of 2. A projection onto few directions never increases it. So a k-d tree of the projections
(Bentley, "Multidimensional binary search trees used for associative searching", CACM 18:509, 1975) lists candidate
founders of clusters, which are compared until no other can be nearer. If postures differ in all joints, there are many
candidates. At most MAX_FOUNDERS_COMPARED are compared, so the nearest may be missed; in corpora of some thousand
postures it never is.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from motionmind._typing import Floats, Int32s, Ints
from motionmind.body.limbs import parts_of
from motionmind.body.skeleton import Skeleton
from motionmind.executors.workshop import Workshop
from motionmind.geometry import rotations as rot
from motionmind.geometry.distances import squared_distance, squared_turn
from motionmind.jit import jit
from motionmind.learned.neighbours import node_bounds

CLUSTER_RADIUS_RAD = 0.2  # RMS over joints
N_TREE_DIMENSIONS = 6  # more gain little
MAX_FOUNDERS_COMPARED = 32  # with a posture, nearest projections first
N_POSTURES_PER_BLOCK = 2048  # compared at a time
N_POSTURES_FOR_DIRECTIONS = 4096
MAX_JOINTS_DECOMPOSED = 64  # joints of a part with exact directions, whose time is cubic; with more, fewer postures
N_SUBSPACE_DIMENSIONS, N_SUBSPACE_ROUNDS = 2 * N_TREE_DIMENSIONS, 3
SLACK_RAD2 = 1e-6  # for rounding in squared distances of projections
# Squared distances, radians^2, that differ by less are a tie. Rounding makes differences of 1e-15, by which two dozen
# of the 13,932 memberships in recordings of one dancer (cmu-05) differed between two processors.
TIE_RAD2 = 1e-12


def clusters_of(skeleton: Skeleton, orientations: Floats, workshop: Workshop | None = None) -> Int32s:
    """Cluster the postures of each body part: [N, P], with parts as in `parts_of` and clusters numbered from 0.

    In order, a posture founds a cluster unless a founder lies within CLUSTER_RADIUS_RAD. Then each posture joins its
    nearest founder, or the first of several equally near ones (TIE_RAD2).

    Args:
        skeleton: the body.
        orientations: orientations of the joint chains [N, L, 4].
        workshop: threads, one job per part, and room for large arrays; None for the current thread and memory.
    """
    workshop, parts = workshop or Workshop(), parts_of(skeleton)
    out = workshop.empty((len(orientations), len(parts)), np.int32)

    def of_part(part: int) -> None:
        joints = parts[part]
        own = workshop.empty((len(orientations), len(joints), 4))
        for start in range(0, len(orientations), N_POSTURES_PER_BLOCK):
            own[start : start + N_POSTURES_PER_BLOCK] = orientations[start : start + N_POSTURES_PER_BLOCK, joints]
        out[:, part] = clusters(own, len(joints) * CLUSTER_RADIUS_RAD**2, workshop)

    workshop.do(of_part, range(len(parts)))
    return out


def clusters(orientations: Floats, within: float, workshop: Workshop | None = None) -> Ints:
    """Return the clusters [N] of one part's orientations [N, m, 4]; founders are more than `within` apart, squared."""
    seen = _seen(orientations, workshop or Workshop())
    forest: list[_Tree] = []
    founders = np.zeros(0, dtype=np.int64)
    for start in range(0, len(orientations), N_POSTURES_PER_BLOCK):
        far = np.arange(start, min(start + N_POSTURES_PER_BLOCK, len(orientations)))
        for tree in forest:
            far = far[_nearest(tree, orientations, seen, far, within)[0] > within + TIE_RAD2]
        founding = _found(np.ascontiguousarray(orientations[far]), np.ascontiguousarray(seen[far]), within)
        _plant(forest, far[founding], seen)
        founders = np.concatenate([founders, far[founding]])
    tree = _grow(founders, seen)
    out = np.empty(len(orientations), dtype=np.int64)
    for start in range(0, len(orientations), N_POSTURES_PER_BLOCK):
        here = np.arange(start, min(start + N_POSTURES_PER_BLOCK, len(orientations)))
        out[here] = _nearest(tree, orientations, seen, here)[1]
    return out


class _Tree(NamedTuple):
    """A k-d tree of the projections of K founders.

    Attributes:
        founders: indices of the founding postures, in the order in which they founded clusters [K].
        order: positions in `founders`, leaf after leaf [K].
        points: their projections, in the order of the leaves [K, d].
        bounds: range of each node in that order, end excluded (`neighbours.node_bounds`) [D, 2].
        boxes: least and greatest projections in each node [D, 2, d].
    """

    founders: Ints
    order: Ints
    points: Floats
    bounds: Int32s
    boxes: Floats


def _plant(forest: list[_Tree], founders: Ints, seen: Floats) -> None:
    """Add founders [n], indices of postures, to a forest: they merge with the last trees that are no larger, which
    keeps trees few and rebuilds rare."""
    if not len(founders):
        return
    while forest and len(forest[-1].founders) <= len(founders):
        founders = np.concatenate([forest.pop().founders, founders])
    forest.append(_grow(founders, seen))


def _grow(founders: Ints, seen: Floats) -> _Tree:
    """Build the tree of founders [K], indices of postures, given the projections of all postures [N, d]."""
    bounds, points = node_bounds(len(founders)), seen[founders]
    order, boxes = np.arange(len(founders)), np.empty((len(bounds), 2, points.shape[1]))
    for node, (start, stop) in enumerate(bounds):
        own = points[order[start:stop]]
        boxes[node] = own.min(axis=0, initial=np.inf), own.max(axis=0, initial=-np.inf)
        if 2 * node + 2 < len(bounds):  # its children halve it where it is widest
            widest = np.argmax(boxes[node, 1] - boxes[node, 0])
            order[start:stop] = order[start:stop][np.argsort(own[:, widest], kind="stable")]
    return _Tree(founders, order, points[order], bounds, boxes)


def _seen(orientations: Floats, workshop: Workshop) -> Floats:
    """Project the postures onto the directions of greatest variance [N, d]; distances are at most the root of
    `squared_distance`."""
    excess = max(orientations.shape[1] / MAX_JOINTS_DECOMPOSED, 1.0)
    shown = _points(orientations[:: max(int(len(orientations) * excess) // N_POSTURES_FOR_DIRECTIONS, 1)])
    middle = shown.mean(axis=0)
    directions = _directions(shown - middle)
    seen: Floats = workshop.empty((len(orientations), directions.shape[1]))
    _look_along(orientations, middle, np.ascontiguousarray(directions), seen)
    return seen


def _directions(points: Floats) -> Floats:
    """Return orthonormal directions of greatest variance [9 m, d] of centred points [n, 9 m].

    In many dimensions they are approximate, found by iteration in a random subspace (Halko, Martinsson and Tropp,
    "Finding structure with randomness", SIAM Review 53:217, 2011). Exact ones would list fewer candidates, not others.
    """
    if points.shape[1] <= 9 * MAX_JOINTS_DECOMPOSED:
        return np.asarray(np.linalg.eigh(points.T @ points)[1][:, ::-1][:, :N_TREE_DIMENSIONS])
    basis = np.random.default_rng(0).standard_normal((points.shape[1], N_SUBSPACE_DIMENSIONS))
    for _ in range(N_SUBSPACE_ROUNDS):
        basis = np.linalg.qr(points.T @ (points @ basis))[0]
    within = points @ basis
    return np.asarray(basis @ np.linalg.eigh(within.T @ within)[1][:, ::-1][:, :N_TREE_DIMENSIONS])


def _points(orientations: Floats) -> Floats:
    """Return the points [n, 9 m] whose squared distances are those of the postures [n, m, 4]."""
    return np.asarray(rot.to_matrix(orientations).reshape(len(orientations), -1) / np.sqrt(2.0))


def _nearest(
    tree: _Tree, orientations: Floats, seen: Floats, postures: Ints, enough: float = -1.0
) -> tuple[Floats, Ints]:
    """Return each posture's least squared distance to a founder [n], and the position of the first founder that near
    [n].

    Args:
        tree: of the founders.
        orientations: of all postures [N, m, 4].
        seen: projections of all postures [N, d].
        postures: their indices [n].
        enough: a squared distance that is near enough: a result above it is only known to be above it.
    """
    least, place = np.full(len(postures), np.inf), np.zeros(len(postures), dtype=np.int64)
    _search(*tree, orientations, seen, postures, enough, MAX_FOUNDERS_COMPARED, least, place)
    return least, place


@jit
def _look_along(orientations: Floats, middle: Floats, directions: Floats, out: Floats) -> None:
    """Write the projections [N, d] of `_points`, less their mean [9 m], onto directions [9 m, d]."""
    row, root = np.empty(9), np.sqrt(2.0)
    for n in range(len(orientations)):
        out[n] = 0.0
        for joint in range(orientations.shape[1]):
            x, y, z, w = orientations[n, joint]
            row[0], row[1], row[2] = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)
            row[3], row[4], row[5] = 2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)
            row[6], row[7], row[8] = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)
            for k in range(9):
                off = row[k] / root - middle[9 * joint + k]
                for d in range(N_TREE_DIMENSIONS):
                    out[n, d] += off * directions[9 * joint + k, d]


@jit
def _search(
    founders: Ints,
    order: Ints,
    points: Floats,
    bounds: Int32s,
    boxes: Floats,
    orientations: Floats,
    seen: Floats,
    postures: Ints,
    enough: float,
    most: int,
    least: Floats,
    place: Ints,
) -> int:
    """Write the results of `_nearest`; return the number of founders compared: at most `most` per posture, nearest
    projections first, until no other can be nearer."""
    compared, near, at, distances = 0, np.empty(most), np.empty(most, np.int64), np.empty(most)
    nodes, gaps = np.empty(64, np.int64), np.empty(64)  # twice as many as there are levels
    for i in range(len(postures)):
        here, own = seen[postures[i]], orientations[postures[i]]
        count, first, size = 0, -1, 1
        limit = np.inf if enough < 0.0 else enough * (1.0 + SLACK_RAD2) + SLACK_RAD2
        nodes[0], gaps[0] = 0, 0.0
        while size:
            size -= 1
            node = nodes[size]
            if gaps[size] > limit:
                continue
            if 2 * node + 2 < len(bounds):
                one, other = _gap(boxes[2 * node + 1], here), _gap(boxes[2 * node + 2], here)
                nearer = 2 * node + 1 if one <= other else 2 * node + 2  # visited first, so pushed last
                nodes[size], gaps[size] = 4 * node + 3 - nearer, max(one, other)
                nodes[size + 1], gaps[size + 1] = nearer, min(one, other)
                size += 2
                continue
            for k in range(bounds[node, 0], bounds[node, 1]):
                off = 0.0
                for d in range(N_TREE_DIMENSIONS):
                    off += (here[d] - points[k, d]) ** 2
                if off <= limit:
                    count = _insert(near, at, count, off, order[k])
                    if count == most:
                        limit = min(limit, near[most - 1])
            if count and at[0] != first:
                first = at[0]
                compared += 1
                limit = min(
                    limit,
                    squared_distance(own, orientations[founders[first]]) * (1.0 + SLACK_RAD2) + SLACK_RAD2,
                )
        tried = 0
        while (
            tried < count and near[tried] <= least[i] * (1.0 + SLACK_RAD2) + SLACK_RAD2 and least[i] > enough + TIE_RAD2
        ):
            distances[tried] = _distance_within(own, orientations[founders[at[tried]]], least[i] + TIE_RAD2)
            least[i] = min(least[i], distances[tried])
            tried += 1
        compared += tried
        place[i] = len(founders)
        for k in range(tried):
            if distances[k] <= least[i] + TIE_RAD2:
                place[i] = min(place[i], at[k])
    return compared


@jit
def _distance_within(a: Floats, b: Floats, most: float) -> float:
    """Return `squared_distance` of postures [m, 4], or, where that exceeds `most`, any partial sum above `most`."""
    total = 0.0
    for j in range(len(a)):
        total += squared_turn(a[j], b[j])
        if total > most:
            break
    return total


@jit
def _gap(box: Floats, point: Floats) -> float:
    """Return the squared distance of a point [d] from a box [2, d]."""
    total = 0.0
    for d in range(N_TREE_DIMENSIONS):
        off = max(box[0, d] - point[d], point[d] - box[1, d], 0.0)
        total += off * off
    return total


@jit
def _insert(near: Floats, at: Ints, count: int, off: float, founder: int) -> int:
    """Insert a founder into the sorted list of the nearest, dropping the farthest if it is full; return its length."""
    k = min(count, len(near) - 1)
    if k < count and off >= near[k]:
        return count
    while k > 0 and near[k - 1] > off:
        near[k], at[k] = near[k - 1], at[k - 1]
        k -= 1
    near[k], at[k] = off, founder
    return min(count + 1, len(near))


@jit
def _found(orientations: Floats, seen: Floats, within: float) -> Ints:
    """Return the indices of the postures, among n, that found clusters if no others exist."""
    founders = np.empty(len(orientations), np.int64)
    count = 0
    for i in range(len(orientations)):
        alone = True
        for k in range(count):
            bound = 0.0
            for d in range(seen.shape[1]):
                bound += (seen[i, d] - seen[founders[k], d]) ** 2
            if bound <= within * (1.0 + SLACK_RAD2) + SLACK_RAD2 and (
                squared_distance(orientations[i], orientations[founders[k]]) <= within + TIE_RAD2
            ):
                alone = False
                break
        if alone:
            founders[count] = i
            count += 1
    return founders[:count]
