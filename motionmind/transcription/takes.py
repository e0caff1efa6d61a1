"""Write later takes of a phrase like its first: in the same postures, at the frames where the recording passes them.

Two takes are never alike: their key frames lie elsewhere, and no row recurs. Here each key's posture, or its mirror
image, is looked for in the whole recording, and a take is a sequence of these that movement follows within the
tolerance.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats, Ints
from motionmind.body.anatomy import Anatomy
from motionmind.body.contact import lowest_point
from motionmind.body.mirror import find_sides
from motionmind.geometry import rotations as rot
from motionmind.transcription.angles import mirror_trunk, rotations_of
from motionmind.transcription.following import Following, Poses
from motionmind.transcription.recorded import Recorded

STRETCH_RATIO = 2.0  # by which a move may take longer or shorter than in the first take
N_BESIDE = 3  # frames on either side of the nearest one that may be a key
MAX_VISITS = 20  # of the recording to a posture, the nearest ones
_CHANGED_RATIO = 1e-5  # price of another duration to that of a row


class Take(NamedTuple):
    """Frames that can be written in the postures of keys.

    Attributes:
        mirrored: whether in their mirror images.
        frames: the frames of the postures of a key and of those after it [N].
    """

    mirrored: bool
    frames: Ints


class Phrase(NamedTuple):
    """Keys that recur.

    Attributes:
        key: number of the first key.
        length: how many.
        takes: further takes of them, without overlaps.
    """

    key: int
    length: int
    takes: list[Take]


def match_takes(following: Following, keys: Ints, phrases: list[Phrase], tolerance: float) -> tuple[Recorded, Ints]:
    """Write further takes of phrases in the postures of the first.

    Args:
        following: the test of the recording.
        keys: its fewest key frames [K].
        phrases: the phrases, and their takes.
        tolerance: degrees.

    Returns:
        The recording with these postures at their frames, and the fewest key frames, these among them, between which
        every frame is followed.
    """
    recorded = following.recorded
    body, written, root = recorded.bones.body, recorded.written, recorded.root.copy()
    degrees, rotations = written.degrees.copy(), written.rotations.copy()
    chains = list[Ints]()
    for phrase in phrases:
        own = keys[phrase.key : phrase.key + phrase.length]
        chains.append(own)
        for mirrored, frames in phrase.takes:
            degrees[frames] = _other_side(body, degrees[own]) if mirrored else degrees[own]
            rotations[frames] = rotations_of(body, degrees[frames])
            root[frames, 1] = 0.01 * recorded.up[frames] - _lowest(body, rotations[frames])
            chains.append(frames)
    matched = replace(recorded, written=written._replace(degrees=degrees, rotations=rotations), root=root)
    after = Following(matched, tolerance)
    out, reached = [np.zeros(1, dtype=np.int64)], 0
    for chain in sorted(chains, key=lambda frames: int(frames[0])):
        out += [after.fewest_keys(reached, int(chain[0]) + 1)[1:], chain[1:]]
        reached = int(chain[-1])
    out.append(after.fewest_keys(reached, len(root))[1:])
    return matched, np.concatenate(out)


def find_takes(following: Following, keys: Ints) -> list[list[Take]]:
    """Return, for each key, the takes that begin with its posture, each as long as it goes on."""
    recorded, bones = following.recorded, following.recorded.bones
    facing = rot.about_vertical(np.radians(recorded.written.facing))
    ahead = rot.mul_vec(rot.inv(facing)[:, None], following.directions)
    degrees = recorded.written.degrees[keys]
    out: list[list[Take]] = [[] for _ in keys]
    for mirrored in (False, True):
        rotations = rotations_of(bones.body, _other_side(bones.body, degrees) if mirrored else degrees)
        height = -_lowest(bones.body, rotations)
        directions = bones.directions(rotations)
        later: tuple[Poses, Floats, list[Ints]] | None = None  # of the next key: places, rows to go, frames to come
        for k in range(len(keys) - 1, -1, -1):
            off = (rot.norm(ahead - directions[k]) / following.allowed).max(axis=1)
            bears = recorded.bears[keys[k]][::-1] if mirrored else recorded.bears[keys[k]]
            off[(recorded.bears != bears).any(axis=1)] = np.inf
            off[np.abs(0.01 * recorded.up + height[k] - recorded.root[:, 1]) > following.metres] = np.inf
            visits = _visits(off, -1 if mirrored else int(keys[k]))
            frames = np.concatenate([np.zeros(0, dtype=np.int64), *visits])
            turned = np.repeat(rotations[k][None], len(frames), axis=0)
            turned[:, 0] = rot.mul(facing[frames], turned[:, 0])
            root = recorded.root[frames]
            root[:, 1] = 0.01 * recorded.up[frames] + height[k]
            poses = Poses(turned, root, frames)
            rows, paths = np.ones(len(frames)), [frames[[i]] for i in range(len(frames))]
            if later is not None and len(frames) and len(later[0].frames):
                span = int(keys[k + 1] - keys[k])
                first, last = _moves(following, poses, later[0], span)
                total = 1.0 + later[1][last] - _CHANGED_RATIO * (later[0].frames[last] - frames[first] != span)
                for i in np.argsort(total, kind="stable").tolist():  # the best last
                    rows[first[i]] = total[i]
                    paths[first[i]] = np.append(frames[first[i]], later[2][last[i]])
            later = poses, rows, paths
            begin = 0
            for visit in visits:
                best = begin + int(rows[begin : begin + len(visit)].argmax())
                if len(paths[best]) > 1:
                    out[k].append(Take(mirrored, paths[best]))
                begin += len(visit)
    return out


def _moves(following: Following, poses: Poses, later: Poses, span: int) -> tuple[Ints, Ints]:
    """Return the pairs of places between which movement follows the recording: their numbers in both poses [N].

    Args:
        following: the test.
        poses, later: places of a key's posture, and of the next key's.
        span: frames between the two keys.
    """
    spans = later.frames[None] - poses.frames[:, None]
    longest = min(STRETCH_RATIO * span, following.longest)
    first, last = np.nonzero((spans > 0) & (spans * STRETCH_RATIO >= span) & (spans <= longest))
    both = Poses(*(np.concatenate(pair) for pair in zip(poses, later, strict=True)))
    for offset in range(1, int(longest)):
        long = spans[first, last] > offset
        if not long.any():
            break
        kept = np.ones(len(first), dtype=np.bool_)
        kept[long] = following.follows(
            both, first[long], last[long] + len(poses.frames), poses.frames[first[long]] + offset
        )
        first, last = first[kept], last[kept]
    return first, last


def _visits(off: Floats, key: int) -> list[Ints]:
    """Return the frames at which a posture may be a key, of each visit of the recording to it.

    Args:
        off: distance of each frame from the posture, in tolerances [T].
        key: the frame whose visit is left out; -1 for none.
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[0], (off <= 1.0).astype(np.int8), [0]])))
    visits = [
        (float(off[start:stop].min()), start, stop)
        for start, stop in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
        if not start <= key < stop
    ]
    out = []
    for _, start, stop in sorted(sorted(visits)[:MAX_VISITS], key=lambda visit: visit[1]):
        nearest = start + int(off[start:stop].argmin())
        beside = np.arange(max(start, nearest - N_BESIDE), min(stop, nearest + N_BESIDE + 1))
        out.append(np.unique(np.concatenate([[start, stop - 1], beside])))
    return out


def choose_phrases(takes: list[list[Take]], keys: Ints, count: int) -> list[Phrase]:
    """Choose phrases and takes of them that do not overlap, the one first that saves the most rows.

    Args:
        takes: the takes that begin with each key's posture.
        keys: the key frames [K].
        count: number of frames.
    """
    free = np.ones(count, dtype=np.bool_)
    heap = [(-saved, k, phrase) for k in range(len(keys)) for saved, phrase in _best(k, takes[k], keys, free)]
    heapq.heapify(heap)
    out = list[Phrase]()
    while heap:
        saved, k, phrase = heapq.heappop(heap)
        now = list(_best(k, takes[k], keys, free))
        if not now:
            continue
        if now[0][0] < -saved:  # less than before: others may save more
            heapq.heappush(heap, (-now[0][0], k, now[0][1]))
            continue
        phrase = now[0][1]
        out.append(phrase)
        for frames in (keys[k : k + phrase.length], *(take.frames for take in phrase.takes)):
            free[frames[0] : frames[-1] + 1] = False
    return out


def _best(k: int, takes: list[Take], keys: Ints, free: Bools) -> Iterator[tuple[int, Phrase]]:
    """Yield the phrase from key `k` on that saves the most rows, and how many; nothing if none saves any."""
    busy = np.concatenate([[0], np.cumsum(~free)])
    takes = [Take(take.mirrored, frames) for take in takes if len(frames := _free_part(take.frames, busy)) > 1]
    own = _free_part(keys[k:], busy)
    longest = min(len(own), max((len(take.frames) for take in takes), default=0))
    best: tuple[int, Phrase] | None = None
    for n in range(2, longest + 1):
        chosen, saved, reached = list[Take](), -2, -1
        for take in sorted((take for take in takes if len(take.frames) >= n), key=lambda take: int(take.frames[n - 1])):
            first, last = int(take.frames[0]), int(take.frames[n - 1])
            if first > reached and (last < own[0] or first > own[n - 1]):
                chosen.append(Take(take.mirrored, take.frames[:n]))
                saved += int(np.searchsorted(keys, last + 1) - np.searchsorted(keys, first)) - 1
                reached = last
        if chosen and saved > (best[0] if best else 0):
            best = saved, Phrase(k, n, chosen)
    if best:
        yield best


def _free_part(frames: Ints, busy: Ints) -> Ints:
    """Return the frames up to the first that is taken, or after which one is; `busy` counts taken frames [T + 1]."""
    taken = np.flatnonzero(busy[frames + 1] > busy[frames[0]])
    return frames[: taken[0]] if len(taken) else frames


def _other_side(body: Anatomy, degrees: Floats) -> Floats:
    """Return the angles [T, J, 3] of the mirror images of postures."""
    partners = find_sides(body.skeleton).partners
    middle = partners == np.arange(len(partners))
    out = degrees[:, partners].copy()
    out[:, middle] = mirror_trunk(out[:, middle])
    return out


def _lowest(body: Anatomy, rotations: Floats) -> Floats:
    """Return the height of the lowest point of postures [N] below the pelvis."""
    return lowest_point(body, rotations, np.zeros((len(rotations), 3)))[0]
