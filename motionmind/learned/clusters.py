"""Clusters of postures, part by part of the body: in time that grows with their number, and not with its square.

`squared_distance` of two postures is the squared distance between two points: their rotation matrices [m, 3, 3], over
the square root of 2. Seen along a few directions it is never more; so a k-d tree of what is seen there names the
founders of clusters that may be near (Bentley, "Multidimensional binary search trees used for associative searching",
CACM 18:509, 1975), and these are compared, until no other can be nearer. Where postures differ in all their joints
there are ever more that may be; no more than the last of LOOKED_AT are compared, and the nearest of all may then be
missed. In corpora of some thousand postures none is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from motionmind._typing import Floats, Int32s, Ints
from motionmind.body.limbs import parts_of
from motionmind.body.skeleton import Skeleton
from motionmind.executors.workshop import Workshop
from motionmind.geometry import rotations as rot
from motionmind.geometry.distances import squared_distance
from motionmind.jit import jit

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

ALIKE = 0.2  # radians a joint (root mean square) within which postures of a part are in one cluster
DIRECTIONS = 6  # in which postures are seen by a tree; it finds little in more
LOOKED_AT = 8, 32  # founders that are compared with a posture, those that look nearest: the first, then all
BLOCK = 2048  # postures that are compared at a time
SHOWN = 4096  # postures that show the directions
SLACK = 1e-6  # of rounding, in squared distances


def clusters_of(skeleton: Skeleton, orientations: Floats, workshop: Workshop | None = None) -> Int32s:
    """Cluster the postures of each part of a body: [N, P], with parts as in `parts_of` and clusters numbered from 0.

    In order, a posture founds a cluster unless a founder lies within ALIKE; then each joins its nearest founder, the
    first of those that are equally near.

    Args:
        skeleton: the body.
        orientations: orientations of the chains [N, L, 4].
        workshop: threads, for which each part is a job, and room for large arrays; None for this thread and memory.
    """
    workshop, parts = workshop or Workshop(), parts_of(skeleton)
    out = workshop.empty((len(orientations), len(parts)), np.int32)

    def of_part(part: int) -> None:
        joints = parts[part]
        own = workshop.empty((len(orientations), len(joints), 4))
        for start in range(0, len(orientations), BLOCK):
            own[start : start + BLOCK] = orientations[start : start + BLOCK, joints]
        out[:, part] = clusters(own, len(joints) * ALIKE**2, workshop)

    workshop.do(of_part, range(len(parts)))
    return out


def clusters(orientations: Floats, within: float, workshop: Workshop | None = None) -> Ints:
    """Return the clusters [N] of one part's orientations [N, m, 4]; founders are more than `within` apart, squared."""
    seen = _seen(orientations, workshop or Workshop())
    forest, founders = _Forest(seen), np.zeros(0, dtype=np.int64)
    for start in range(0, len(orientations), BLOCK):
        here = np.arange(start, min(start + BLOCK, len(orientations)))
        far = here
        for tree, own in forest.trees:
            least, _ = _nearest(tree, own, orientations, seen, far, within)
            far = far[least > within]
        founding = _found(np.ascontiguousarray(orientations[far]), np.ascontiguousarray(seen[far]), within)
        forest.plant(far[founding])
        founders = np.concatenate([founders, far[founding]])
    tree = _tree(seen[founders])
    out = np.empty(len(orientations), dtype=np.int64)
    for start in range(0, len(orientations), BLOCK):
        here = np.arange(start, min(start + BLOCK, len(orientations)))
        out[here] = _nearest(tree, founders, orientations, seen, here)[1]
    return out


class _Forest:
    """Trees of founders: each new one joins those before it that are no larger, so there are few, and each founder is
    in few of those that are made."""

    def __init__(self, seen: Floats) -> None:
        self._seen = seen
        self.trees: list[tuple[cKDTree, Ints]] = []

    def plant(self, founders: Ints) -> None:
        """Add founders [n], postures by number."""
        if not len(founders):
            return
        while self.trees and len(self.trees[-1][1]) <= len(founders):
            founders = np.concatenate([self.trees.pop()[1], founders])
        self.trees.append((_tree(self._seen[founders]), founders))


def _tree(points: Floats) -> cKDTree:
    from scipy.spatial import cKDTree  # slow to import

    return cKDTree(points)


def _seen(orientations: Floats, workshop: Workshop) -> Floats:
    """Return the postures along a few directions [N, d], those in which some of them differ most; distances are at most
    the root of `squared_distance`."""
    shown = _points(orientations[:: max(len(orientations) // SHOWN, 1)])
    middle = shown.mean(axis=0)
    directions = np.linalg.eigh((shown - middle).T @ (shown - middle))[1][:, ::-1][:, :DIRECTIONS]
    seen = workshop.empty((len(orientations), directions.shape[1]))
    for start in range(0, len(orientations), BLOCK):
        here = slice(start, start + BLOCK)
        seen[here] = (_points(orientations[here]) - middle) @ directions
    return seen


def _points(orientations: Floats) -> Floats:
    """Return the points [n, 9 m] whose squared distances are those of the postures [n, m, 4]."""
    return np.asarray(rot.to_matrix(orientations).reshape(len(orientations), -1) / np.sqrt(2.0))


def _nearest(
    tree: cKDTree, founders: Ints, orientations: Floats, seen: Floats, postures: Ints, enough: float = -1.0
) -> tuple[Floats, Ints]:
    """Return the least squared distance of each of n postures to a founder [n], and the first such founder's place [n].

    Args:
        tree: of what is seen of the founders.
        founders: postures by number [K].
        orientations: of all postures [N, m, 4].
        seen: of all postures [N, d].
        postures: by number [n].
        enough: a squared distance that is near enough: of those whose least is more, only that is sure.
    """
    least, place = np.full(len(postures), np.inf), np.zeros(len(postures), dtype=np.int64)
    left, known = np.arange(len(postures)), 0
    looked_at = LOOKED_AT if enough < 0.0 else (1, *LOOKED_AT)  # mostly the one that looks nearest is near enough
    for count in (min(most, len(founders)) for most in looked_at):
        if len(left) and count > known:
            bound, near = tree.query(seen[postures[left]], k=np.arange(known + 1, count + 1))
            _compare(orientations, postures[left], founders, near, least, place, left)
            sought = least[left] if enough < 0.0 else enough
            more = bound[:, -1] ** 2 <= sought * (1.0 + SLACK) + SLACK
            left, known = left[more & (least[left] > enough)], count
    return least, place


@jit
def _compare(
    orientations: Floats, postures: Ints, founders: Ints, near: Ints, least: Floats, place: Ints, rows: Ints
) -> None:
    """Write to `rows` of `least` and `place` what is the least of the distances to the founders `near` [n, k]."""
    for i in range(len(postures)):
        row = rows[i]
        for k in near[i]:
            distance = squared_distance(orientations[postures[i]], orientations[founders[k]])
            if distance < least[row] or (distance == least[row] and k < place[row]):
                least[row], place[row] = distance, k


@jit
def _found(orientations: Floats, seen: Floats, within: float) -> Ints:
    """Return which of n postures found clusters, in order, among themselves alone."""
    founders = np.empty(len(orientations), np.int64)
    count = 0
    for i in range(len(orientations)):
        alone = True
        for k in range(count):
            bound = 0.0
            for d in range(seen.shape[1]):
                bound += (seen[i, d] - seen[founders[k], d]) ** 2
            if bound <= within * (1.0 + SLACK) + SLACK and (
                squared_distance(orientations[i], orientations[founders[k]]) <= within
            ):
                alone = False
                break
        if alone:
            founders[count] = i
            count += 1
    return founders[:count]
