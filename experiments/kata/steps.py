"""Steps of a score: which foot goes where, when, and how the steps of two scores are aligned."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

from experiments.material import recordings
from motionmind._typing import Bools, Floats, Ints
from motionmind.body.anatomy import SIDES
from motionmind.geometry import rotations as rot
from motionmind.laban.measured import measure
from motionmind.notation.compose import compose, find_clip, played
from motionmind.notation.read import read_score
from motionmind.transcription import transcribe

KATA = Path(__file__).parents[2] / "corpora" / "karate" / "kata.score"
SHORTEST_STEP_M = 0.25  # a foot's length; a foot that turns about its heel moves by less
N_SECTORS = 8  # of 45 degrees, counted to the left from the front of the start
GAP_COST = 0.5  # of a step that one score has alone: two of them cost as much as a step the opposite way
RATE_HZ = 30.0  # at which supports are compared
TOLERANCE_DEG = 6.0  # of the transcription


class Step(NamedTuple):
    """The displacement of a foot from stance to stance.

    Attributes:
        foot: 0 left, 1 right.
        leaves, lands: seconds.
        to: direction of the step, degrees to the left of the front of the start.
        facing: of the pelvis when the next step begins, likewise to the left.
    """

    foot: int
    leaves: float
    lands: float
    to: float
    facing: float


@dataclass(frozen=True, eq=False)
class Danced:
    """The supports and steps of a kata.

    Attributes:
        times: of its postures [K], seconds from the first.
        bears: whether the left and the right foot bear weight in each [K, 2].
        steps: in the order in which they land.
    """

    times: Floats
    bears: Bools
    steps: tuple[Step, ...]

    @property
    def feet(self) -> Ints:
        return np.array([step.foot for step in self.steps])

    @property
    def sectors(self) -> Ints:
        """Directions of the steps, in sectors [N]."""
        return sector_of(np.array([step.to for step in self.steps]))

    def supports(self, times: Floats) -> Ints:
        """Return the feet that bear at some times: 0 none, 1 left, 2 right, 3 both.

        During a move the feet bear that bear both before and after it.
        """
        before = np.clip(np.searchsorted(self.times, times, side="right") - 1, 0, len(self.times) - 2)
        bears = self.bears[before] & self.bears[before + 1]
        return np.asarray(bears @ np.array([1, 2]))

    def turned(self, sectors: int, mirrored: bool) -> Danced:
        """Return the kata as if it began with another front, or on the other side."""
        sign, angle = (-1.0 if mirrored else 1.0), 360.0 / N_SECTORS * sectors
        steps = [
            step._replace(
                foot=1 - step.foot if mirrored else step.foot,
                to=sign * step.to + angle,
                facing=sign * step.facing + angle,
            )
            for step in self.steps
        ]
        return replace(self, bears=self.bears[:, ::-1] if mirrored else self.bears, steps=tuple(steps))

    def in_order(self, order: Ints) -> Danced:
        """Return the same steps in another order."""
        return replace(self, steps=tuple(self.steps[k] for k in order))


def sector_of(degrees: Floats) -> Ints:
    return np.asarray(np.round(degrees * N_SECTORS / 360.0).astype(np.int64) % N_SECTORS)


@lru_cache(maxsize=16)
def danced(data: str | None, source: str) -> Danced:
    """Return a kata: "karate/CLIP" as it is written, "transcribed/CLIP" as its movement is transcribed, or a recording.

    A recording is transcribed, too.
    """
    name, _, clip = source.partition("/")
    if name == "karate":
        return _steps_of(KATA, clip)
    if name == "transcribed":
        motion = compose(KATA, clip)
    else:
        assert data is not None
        motion = next(motion for motion in recordings(data, name) if motion.name == clip)
    found = transcribe(motion, TOLERANCE_DEG, repeats=False)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "kata.score"
        path.write_text(found.text, encoding="utf-8")
        return _steps_of(path, None)


def _steps_of(path: Path, name: str | None) -> Danced:
    """Read the supports and steps of a score's clip."""
    score = read_score(path)
    ((rows, motion),) = played(score, [find_clip(score, name)])
    measured = measure(score.body, rows, motion)
    heading = np.unwrap(rot.heading(motion.rotations[:, 0]))
    places = measured.feet[..., [0, 2]] - motion.root[0, [0, 2]]
    sine, cosine = np.sin(heading[0]), np.cos(heading[0])
    places = places @ np.array([[cosine, sine], [-sine, cosine]])
    times = motion.times - motion.times[0]
    steps = [step for foot in range(len(SIDES)) for step in _steps(foot, times, measured.bears[:, foot], places)]
    steps.sort(key=lambda step: step.lands)
    degrees = np.degrees(heading - heading[0])
    ends = [*(step.leaves for step in steps[1:]), times[-1]]
    steps = [
        step._replace(facing=float(np.interp(max(end, step.lands), times, degrees)))
        for step, end in zip(steps, ends, strict=True)
    ]
    return Danced(times, measured.bears, tuple(steps))


def _steps(foot: int, times: Floats, bears: Bools, places: Floats) -> list[Step]:
    """Return the steps of a foot, given the postures in which it bears [K] and where the feet are [K, 2, 2]."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], bears.astype(np.int8), [0]]))).reshape(-1, 2)
    if len(edges) == 0:
        return []
    stances = [(start, stop, np.median(places[start:stop, foot], axis=0)) for start, stop in edges.tolist()]
    out, (_, left, last) = list[Step](), stances[0]
    for start, stop, place in stances[1:]:
        way = place - last
        if np.hypot(*way) >= SHORTEST_STEP_M:
            to = float(np.degrees(np.arctan2(*way)))
            out.append(Step(foot, float(times[left - 1]), float(times[start]), to, 0.0))
            last = place
        left = stop  # also of a foot that only turned, or rested its weight
    return out


# --- alignment --------------------------------------------------------------------------------------------------------


class Aligned(NamedTuple):
    """Two kata aligned.

    Attributes:
        cost: of the pairs and gaps.
        one, other: the kata, the second turned.
        sectors: by how many sectors to the left.
        mirrored: whether it is mirrored, too.
        pairs: numbers of two steps, in order; None for a step that the other kata does not have.
    """

    cost: float
    one: Danced
    other: Danced
    sectors: int
    mirrored: bool
    pairs: list[tuple[int | None, int | None]]


def align(one: Danced, whole: Danced, sectors: int, mirrored: bool) -> Aligned:
    """Align two kata's steps at least cost, as in an edit distance.

    Steps of the same foot cost their directions' difference, 1 if opposite; those of different feet are no pair.
    """
    other = whole.turned(sectors, mirrored)
    apart = np.abs(one.sectors[:, None] - other.sectors[None])
    unlike = np.minimum(apart, N_SECTORS - apart) / (N_SECTORS // 2)
    unlike = np.where(one.feet[:, None] == other.feet[None], unlike, np.inf)
    count, others = unlike.shape
    cost = np.zeros((count + 1, others + 1))
    cost[:, 0], cost[0] = GAP_COST * np.arange(count + 1), GAP_COST * np.arange(others + 1)
    for i, j in product(range(count), range(others)):
        cost[i + 1, j + 1] = min(cost[i, j] + unlike[i, j], cost[i, j + 1] + GAP_COST, cost[i + 1, j] + GAP_COST)
    pairs, i, j = list[tuple[int | None, int | None]](), count, others
    while i or j:
        if i and j and cost[i, j] == cost[i - 1, j - 1] + unlike[i - 1, j - 1]:
            i, j = i - 1, j - 1
            pairs.append((i, j))
        elif i and cost[i, j] == cost[i - 1, j] + GAP_COST:
            i -= 1
            pairs.append((i, None))
        else:
            j -= 1
            pairs.append((None, j))
    return Aligned(float(cost[count, others]), one, other, sectors, mirrored, pairs[::-1])


def best_alignment(one: Danced, other: Danced, mirrors: tuple[bool, ...] = (False, True)) -> Aligned:
    """Align a kata with another at its best front and, if allowed, on its better side."""
    return min(
        (align(one, other, sectors, mirrored) for mirrored in mirrors for sectors in range(N_SECTORS)),
        key=lambda found: found.cost,
    )


def aligned_supports(aligned: Aligned) -> tuple[Ints, Ints]:
    """Return the supports of two kata at the same places of their alignment [T].

    Paired steps leave and land together; between them time runs evenly.
    """
    one, other, anchors = aligned.one, aligned.other, [(0.0, 0.0)]
    for i, j in aligned.pairs:
        if i is None or j is None:
            continue
        a, b = one.steps[i], other.steps[j]
        for pair in ((a.leaves, b.leaves), (a.lands, b.lands)):
            if pair[0] > anchors[-1][0] and pair[1] > anchors[-1][1]:
                anchors.append(pair)
    anchors.append((float(one.times[-1]), float(other.times[-1])))
    times = np.arange(0.0, one.times[-1], 1.0 / RATE_HZ)
    mapped = np.interp(times, *np.array(anchors).T)
    return one.supports(times), other.supports(mapped)
