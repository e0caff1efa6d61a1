"""Dancers on one stage, and their movement on one clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from motionmind._typing import Floats
from motionmind.body.mirror import mirrored
from motionmind.body.motion import Motion
from motionmind.body.rates import check_size
from motionmind.footing.smoothing import smoothstep
from motionmind.geometry import rotations as rot
from motionmind.tween.counts import seconds_to_count

LEAST_RATE_HZ = 25.0  # of an ensemble: scores have a posture or two a second


class Way(NamedTuple):
    """A way over the floor, straight, slow at both ends, during which a dancer's piece waits.

    Attributes:
        start, end: when, seconds.
        shift: displacement from the dancer's place, x and z, metres.
    """

    start: float
    end: float
    shift: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Dancer:
    """A dancer of an ensemble.

    Attributes:
        name: the dancer's name.
        piece: the dancer's movement.
        place: where it begins, x and z, metres.
        facing: by how much it is turned to the left about that place, radians.
        entry: when it begins, seconds.
        is_mirrored: whether left and right are exchanged.
        ways: its ways over the floor, in order, none before the last has ended.
        source: the name or the path of the piece, as the ensemble's file has it; "" without a file.
    """

    name: str
    piece: Motion
    place: tuple[float, float]
    facing: float = 0.0
    entry: float = 0.0
    is_mirrored: bool = False
    ways: tuple[Way, ...] = ()
    source: str = ""

    @property
    def end(self) -> float:
        """The time at which the dancer comes to rest, seconds."""
        danced = self.clock(np.array([float(self.piece.times[-1] - self.piece.times[0])]))[0]
        return max(float(danced), *(way.end for way in self.ways), 0.0)

    def own(self, times: Floats) -> Floats:
        """Return for how long the piece has been danced at times of the ensemble, seconds; the inverse of `clock`."""
        waited = sum(
            (np.clip(times, max(one.start, self.entry), one.end) - max(one.start, self.entry))
            for one in self.ways
            if one.end > self.entry
        )
        return np.asarray((times - self.entry).clip(0.0) - waited)

    def clock(self, own: Floats) -> Floats:
        """Return the times of the ensemble at which the piece has been danced for so long, seconds."""
        times = own + self.entry
        for way in self.ways:
            start = max(way.start, self.entry)
            times = np.where(times > start, times + max(way.end - start, 0.0), times)
        return np.asarray(times)

    def at(self, times: Floats) -> Motion:
        """Return the dancer's movement at increasing times of the ensemble [T], seconds.

        Before the entry and after the end it stands still; on a way its posture is carried, and the feet slide.
        """
        placed = self.placed()
        own, frames = np.unique(placed.times[0] + self.own(times), return_inverse=True)
        danced = placed.at(own)
        root = danced.root[frames] + self._carried(times)
        insertions = tuple(replace(one, times=self.clock(one.times - placed.times[0])) for one in placed.insertions)
        rotations = danced.rotations[frames]
        return replace(danced, rotations=rotations, root=root, times=times, insertions=insertions)

    def where(self, seconds: float) -> Floats:
        """Return the place of the root at a time of the ensemble, x and z [2], metres."""
        times = np.array([seconds])
        begin = self.piece.times[0]
        sampled = self.piece.at(np.unique([begin, begin + self.own(times)[0]]))  # a place is relative to the first
        short = replace(self, piece=replace(sampled, insertions=()))
        return np.asarray(short.placed().root[-1, [0, 2]] + self._carried(times)[0, [0, 2]])

    def _carried(self, times: Floats) -> Floats:
        """Return how far its ways have carried the dancer at times [T], metres [T, 3]."""
        carried = np.zeros((len(times), 3))
        for way in self.ways:
            share = smoothstep((times - way.start) / (way.end - way.start))
            carried += share[:, None] * [way.shift[0], 0.0, way.shift[1]]
        return carried

    def placed(self) -> Motion:
        """Return the piece at the dancer's place, turned and mirrored, on a clock that begins with its entry."""
        piece = mirrored(self.piece) if self.is_mirrored else self.piece
        start = piece.root[0] * [1.0, 0.0, 1.0]
        turn = rot.about_vertical(self.facing)
        rotations = piece.rotations.copy()
        rotations[:, 0] = rot.mul(turn, rotations[:, 0])
        root = rot.mul_vec(turn, piece.root - start) + np.array([self.place[0], 0.0, self.place[1]])
        later = self.entry - piece.times[0]
        insertions = tuple(replace(one, times=one.times + later) for one in piece.insertions)
        times = piece.times + later
        return replace(piece, name=self.name, rotations=rotations, root=root, times=times, insertions=insertions)


@dataclass(frozen=True, eq=False)
class Ensemble:
    """Several dancers.

    Attributes:
        name: its name.
        dancers: the dancers, one at least.
        tempo: counts a minute; None if it has none.
        stage: width and depth of the stage around the origin, metres; None if it has none.
        piece_tempo: counts a minute of the pieces as they were read, before they were stretched to `tempo`; None if
            they were not.
    """

    name: str
    dancers: tuple[Dancer, ...]
    tempo: float | None = None
    stage: tuple[float, float] | None = None
    piece_tempo: float | None = None

    @property
    def seconds(self) -> float:
        """Time until the last dancer comes to rest, seconds."""
        return max(dancer.end for dancer in self.dancers)

    @property
    def rate(self) -> float:
        """Frames a second: the greatest rate of a piece, from 25 on."""
        return max(LEAST_RATE_HZ, *(dancer.piece.fps for dancer in self.dancers if len(dancer.piece) > 1), 0.0)

    def count_frames(self, fps: float | None = None) -> int:
        """Return the number of frames, by default at `rate`; however many, two at least."""
        return max(1, round(self.seconds * (fps or self.rate))) + 1

    def times(self, fps: float | None = None) -> Floats:
        """Return the frames' times [T], seconds, by default at `rate`; MotionMindError if there are too many."""
        count = self.count_frames(fps)
        check_size(len(self.dancers) * float(count), len(self.dancers[0].piece.skeleton), self.name)
        return np.arange(count) / (fps or self.rate)

    def motions(self, times: Floats | None = None) -> list[Motion]:
        """Return each dancer's movement on one clock: before the entry and after the end it stands still."""
        times = self.times() if times is None else times
        return [dancer.at(times) for dancer in self.dancers]

    def counted(self, seconds: float) -> str:
        """Format a time: "count 5.0" at a tempo, else "2.0 s"."""
        return f"{seconds:.1f} s" if self.tempo is None else f"count {seconds_to_count(seconds, self.tempo):.1f}"


@dataclass(frozen=True)
class Approach:
    """The closest approach of two dancers: their names, the distance between their nearest joints, and the time."""

    names: tuple[str, str]
    metres: float
    seconds: float


def find_approaches(motions: Sequence[Motion]) -> list[Approach]:
    """Return the closest approach of each pair of dancers, closest first.

    Args:
        motions: their movements, on one clock.
    """
    places = [motion.positions() for motion in motions]
    out = []
    for i, k in combinations(range(len(places)), 2):
        one, other = places[i], places[k]
        # Two bodies are at least as far apart as their projections onto any line, here the one through both roots.
        across = other[:, 0] - one[:, 0]
        across /= np.linalg.norm(across, axis=-1, keepdims=True).clip(1e-9)
        gaps = np.einsum("tjx,tx->tj", other, across).min(axis=1) - np.einsum("tjx,tx->tj", one, across).max(axis=1)
        least, at = np.inf, 0
        for frame in np.argsort(gaps, kind="stable").tolist():
            if gaps[frame] >= least:
                break
            apart = float(np.linalg.norm(one[frame][:, None] - other[frame][None], axis=-1).min())
            if apart < least:
                least, at = apart, frame
        out.append(Approach((motions[i].name, motions[k].name), least, float(motions[i].times[at])))
    return sorted(out, key=lambda approach: approach.metres)
