"""Kimodo's movements on human23, the key frames in them, and the corpora that the engine learns from."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from time import process_time
from typing import NamedTuple

import numpy as np

from experiments.material import FPS, RATE, movement, recordings
from motionmind import Engine, Motion, Posture, own_skeleton, read_motion
from motionmind._typing import Floats
from motionmind.body.contact import find_floor, skating
from motionmind.corpus.gather import gather
from motionmind.discretize import make_discretization
from motionmind.geometry import rotations as rot
from motionmind.metrics.smoothness import angular_jerk

FOLDER = "kimodo"
ASKED = "asked"  # key frames of constraints.json; others are so many seconds apart
STAND_IN = "karate"  # whose clips stand for Kimodo's movements in a trial
OTHERS = "the demos' others"


@dataclass(frozen=True, eq=False)
class Demo:
    """A movement, and the postures that were asked of it.

    Attributes:
        motion: the movement, 30 frames a second.
        asked: the postures at frames, by frame.
    """

    motion: Motion
    asked: dict[int, Posture]

    def keys(self, given: str) -> dict[int, Posture]:
        """Return the key frames by frame: the first frame, those asked or at a distance ("1 s"), and the last."""
        last = len(self.motion) - 1
        if given == ASKED:
            inner = self.asked
        else:
            step = round(float(given.removesuffix(" s")) * FPS)
            # The last gap is at least half as long as the others.
            inner = {frame: self.motion.posture(frame) for frame in range(step, last - step // 2 + 1, step)}
        return {0: self.motion.posture(0), **inner, last: self.motion.posture(last)}


def names(data: str | None) -> list[str]:
    """Return the names of the movements; of the first two clips of bundled movement without `data`."""
    if data is None:
        return list(movement(None, STAND_IN, 2 * FPS))[:2]
    return sorted(path.parent.name for path in Path(data, FOLDER).glob("*/motion.npz"))


@lru_cache(maxsize=16)
def demo(data: str | None, name: str) -> Demo:
    """Return a movement on human23, and the full-body key frames that were asked of it."""
    if data is None:
        motion = movement(None, STAND_IN, 2 * FPS)[name][0].slice(0, 3 * FPS + 1)
        return Demo(motion, {FPS: motion.posture(FPS)})
    folder = Path(data, FOLDER, name)
    motion = replace(read_motion(folder / "motion.npz"), name=name)
    frames, rotations, root = _asked(folder / "constraints.json")
    # Both are retargeted together, so that one fit holds for both.
    count = len(motion) + len(frames)
    both = Motion(
        motion.skeleton,
        np.concatenate([motion.rotations, rotations.reshape(-1, len(motion.skeleton), 4)]),
        np.concatenate([motion.root, root.reshape(-1, 3)]),
        np.arange(count) / FPS,
        name,
    )
    person = own_skeleton(both)
    asked = {frame: person.posture(len(motion) + number) for number, frame in enumerate(frames)}
    return Demo(person.slice(0, len(motion)), asked)


def _asked(path: Path) -> tuple[list[int], Floats, Floats]:
    """Return the frames [K], rotations [K, J, 4] and places [K, 3] of a file's full-body key frames; none without it.

    It holds rotation vectors [K, J, 3] of the joints, relative to their parents.
    """
    rows = json.loads(path.read_text()) if path.exists() else []
    found = [row for row in rows if row["type"] == "fullbody"]
    frames = [int(frame) for row in found for frame in row["frame_indices"]]
    turns = np.array([turn for row in found for turn in row["local_joints_rot"]])
    root = np.array([place for row in found for place in row["root_positions"]])
    return frames, rot.exp(turns) if len(turns) else turns, root


def marked_slide(data: str | None, name: str) -> float:
    """Return the mean step of ankles and toes that a file marks as standing, on its own body, mm; NaN without marks."""
    if data is None:
        return float("nan")
    path = Path(data, FOLDER, name, "motion.npz")
    motion = read_motion(path)
    joints = [motion.skeleton.index(f"{side}{joint}") for side in ("Left", "Right") for joint in ("Foot", "ToeBase")]
    steps = rot.norm(np.diff(motion.positions()[:, joints][..., [0, 2]], axis=0))
    with np.load(path) as arrays:
        marks = arrays["foot_contacts"]
    return float(1000.0 * steps[marks[1:] & marks[:-1]].mean())


class Lesson(NamedTuple):
    """A corpus that was learned from.

    Attributes:
        engine: an engine of it.
        seconds: processor time that learning took.
        jerk, skating: means of its own movement, rad/s^3 and the share of frames.
    """

    engine: Engine
    seconds: float
    jerk: float
    skating: float


@lru_cache(maxsize=2)
def learned(data: str | None, teacher: str, left_out: str) -> Lesson:
    """Learn from a corpus; of the demos' movements, and of bundled ones in a trial, without one."""
    if data is None:
        motions = [piece for take, (piece, *_) in movement(None, STAND_IN, 1).items() if take != left_out]
    elif teacher == OTHERS:
        motions = [demo(data, name).motion for name in names(data) if name != left_out]
    else:
        motions = list(recordings(data, teacher))
    began = process_time()
    corpus = gather(teacher, motions, rate=RATE)
    engine = Engine.learn(corpus, make_discretization("codebook", 15.0))
    spent = process_time() - began
    first = corpus.motion(corpus.clips[0])
    engine.tween(first.posture(0), first.posture(min(5, len(first) - 1)), duration=1.0)  # load compiled code
    even = [motion.resample(FPS) for motion in motions]
    jerks = [angular_jerk(one.rotations, FPS).mean() for one in even]
    floors = [find_floor(one.skeleton, one.rotations, one.root) for one in even]
    skates = [skating(one.skeleton, one.rotations, one.root, floor) for one, floor in zip(even, floors, strict=True)]
    lengths = [len(one) for one in even]
    return Lesson(engine, spent, *(float(np.average(values, weights=lengths)) for values in (jerks, skates)))
