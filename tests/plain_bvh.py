"""BVH read and written as its format says, in few lines of its own: nothing is guessed, repaired or rescaled."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from motionmind.body.motion import Motion

Floats = NDArray[np.float64]


class PlainBvh:
    """A BVH file: its tree, the channels of its joints, and their values [T, C]."""

    def __init__(self, path: str | Path) -> None:
        self.text = Path(path).read_bytes().decode()
        head, _, tail = self.text.partition("MOTION")
        self.hierarchy = "\n".join(head.rstrip().splitlines())
        self.names: list[str] = []
        self.parents: list[int] = []
        self.offsets: list[list[float]] = []
        self.channels: list[list[str]] = []
        stack: list[int] = []
        for words in (line.split() for line in head.splitlines()):
            if words[:1] in (["ROOT"], ["JOINT"]):
                self.names.append(" ".join(words[1:]).removesuffix("{").rstrip())
                self.parents.append(stack[-1] if stack else -1)
                self.offsets.append([0.0] * 3)
                self.channels.append([])
                stack.append(len(self.names) - 1)
            elif words[:1] == ["End"]:
                stack.append(-1)
            elif words[:1] == ["}"]:
                stack.pop()
            elif words[:1] == ["OFFSET"] and stack[-1] >= 0:
                self.offsets[stack[-1]] = [float(word) for word in words[1:]]
            elif words[:1] == ["CHANNELS"]:
                self.channels[stack[-1]] += words[2:]
        rows = tail.split("\n")
        (self.step,) = (float(row.split(":")[1]) for row in rows if row.startswith("Frame Time"))
        numbers = [row.split() for row in rows if row.strip() and "Frame" not in row]
        self.values: Floats = np.array(numbers, dtype=float)

    def columns(self) -> Iterator[tuple[int, str]]:
        """Yield the joint and the channel of each column."""
        for joint, channels in enumerate(self.channels):
            for channel in channels:
                yield joint, channel

    def is_angle(self) -> NDArray[np.bool_]:
        """Return whether each column is an angle [C]."""
        return np.array([channel.endswith("rotation") for _, channel in self.columns()])

    def world(self, frames: Sequence[int], *, adds: bool = False) -> tuple[Rotation, Floats]:
        """Return the joints' orientations [F * J] and places [F, J, 3] in the file's unit, frame by frame.

        Positions replace OFFSETs, or add to them if `adds`.
        """
        turns, places = [], np.empty((len(frames), len(self.names), 3))
        for row, frame in enumerate(frames):
            here: list[Rotation] = []
            column = 0
            for joint, channels in enumerate(self.channels):
                local, place = Rotation.identity(), np.array(self.offsets[joint])
                for channel in channels:
                    value, axis = self.values[frame, column], channel[0].upper()
                    if channel.endswith("rotation"):
                        local = local * Rotation.from_euler(axis, value, degrees=True)
                    else:
                        place["XYZ".index(axis)] = value + adds * (joint > 0) * place["XYZ".index(axis)]
                    column += 1
                parent = self.parents[joint]
                here.append(here[parent] * local if parent >= 0 else local)
                places[row, joint] = places[row, parent] + here[parent].apply(place) if parent >= 0 else place
            turns += here
        return Rotation.concatenate(turns), places

    def jumps(self) -> float:
        """Return the largest step of an angle between neighbouring frames, degrees."""
        return float(np.abs(np.diff(self.values[:, self.is_angle()], axis=0)).max(initial=0.0))


def degrees_between(one: Rotation, other: Rotation) -> float:
    """Return the largest angle between orientations, degrees."""
    return float(np.degrees((one.inv() * other).magnitude()).max())


def write_plain(
    path: Path,
    motion: Motion,
    *,
    order: Callable[[int], str] = lambda _: "ZXY",
    moving: Callable[[int], bool] = lambda joint: joint == 0,
    places: NDArray[np.float64] | None = None,
    per_metre: float = 100.0,
    newline: str = "\n",
    indent: str = "\t",
    end_sites: bool = True,
    turns_first: bool = False,
) -> Path:
    """Write movement as BVH of any dialect.

    Args:
        path: the file.
        motion: the movement, on joints in depth-first order.
        order: of a joint's rotation channels.
        moving: whether a joint has position channels.
        places: their values [T, J, 3], metres; None for the root's places and the others' offsets.
        per_metre: units of the file in a metre.
        newline: the ends of lines.
        indent: what lines are indented by.
        end_sites: whether leaves have End Sites.
        turns_first: whether rotation channels come before position channels.
    """
    body = motion.skeleton
    if places is None:
        places = np.broadcast_to(body.offsets, (len(motion), len(body), 3)).copy()
        places[:, 0] = motion.root
    lines, stack, columns = ["HIERARCHY"], [], []
    for joint, parent in enumerate(body.parents):
        while stack and stack[-1] != parent:
            stack.pop()
            lines.append(indent * len(stack) + "}")
        tab = indent * len(stack)
        turns = [f"{axis}rotation" for axis in order(joint)]
        moves = [f"{axis}position" for axis in "XYZ"] if moving(joint) else []
        channels = turns + moves if turns_first else moves + turns
        offset = " ".join(f"{number:.8f}" for number in per_metre * body.offsets[joint])
        lines += [
            f"{tab}{'JOINT' if joint else 'ROOT'} {body.names[joint]}",
            f"{tab}{{",
            f"{tab}{indent}OFFSET {offset}",
        ]
        lines += [f"{tab}{indent}CHANNELS {len(channels)} {' '.join(channels)}"] if channels else []
        if joint not in body.parents and end_sites:
            tip = " ".join(f"{number:.8f}" for number in per_metre * body.tips[joint])
            inner = tab + indent
            lines += [f"{inner}End Site", f"{inner}{{", f"{inner}{indent}OFFSET {tip}", f"{inner}}}"]
        stack.append(joint)
        angles = np.zeros((len(motion), 0))
        if turns:
            whole = order(joint) + "".join(axis for axis in "XYZ" if axis not in order(joint))
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UserWarning)  # gimbal lock
                angles = Rotation.from_quat(motion.rotations[:, joint]).as_euler(whole, degrees=True)[:, : len(turns)]
        here = [angles, per_metre * places[:, joint]] if turns_first else [per_metre * places[:, joint], angles]
        columns += here if moves else [angles]
    lines += [indent * depth + "}" for depth in reversed(range(len(stack)))]
    lines += ["MOTION", f"Frames: {len(motion)}", f"Frame Time: {1.0 / motion.fps if len(motion) > 1 else 1 / 30:.9f}"]
    lines += [" ".join(f"{number:.8f}" for number in row) for row in np.concatenate(columns, axis=1)]
    path.write_bytes((newline.join(lines) + newline).encode())
    return path
