"""Read an untrusted motion file in a child process with limited memory and time.

The parent puts the file and an order into an empty folder and starts `python -m motionmind.studio.reading` there. The
child answers with `facts.json`, which holds any error as one line, and with a file of arrays for each clip.
"""

from __future__ import annotations

import atexit
import gc
import os
import re
import sys
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np

from motionmind.display import displayed
from motionmind.errors import FormatError, MotionMindError
from motionmind.studio.score_files import take_together

if TYPE_CHECKING:
    from motionmind.body.motion import Motion
    from motionmind.corpus.clip import JointFlip
    from motionmind.notation.posture_line import Row

READABLE_SUFFIXES = (".bvh", ".glb", ".vrm", ".vrma", ".amc", ".npz", ".json", ".score")  # without a second file
TIME_LIMIT_S = 60.0
ORDER_FILE, FACTS_FILE = "order.json", "facts.json"
_MAX_CLIPS = 500
_MAX_NOTES = 12


class Order(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A file to read, and how.

    Attributes:
        file: name of the file in the folder.
        name: its original name.
        unit: its unit of length; None guesses it.
        fps: its frames a second; None takes the file's own.
        asf: name of the file with an AMC's skeleton.
        scores: files of other uploaded scores, by their original names.
    """

    file: str
    name: str
    unit: str | None = None
    fps: float | None = None
    asf: str | None = None
    scores: dict[str, str] = {}


class Fault(msgspec.Struct, frozen=True):
    """A joint that jumps farther than a body can.

    Attributes:
        joint: its name.
        times: number of jumps.
        seconds: time of the first jump in the clip.
        degrees: largest jump.
        clip: number of the clip.
    """

    joint: str
    times: int
    seconds: float
    degrees: float
    clip: int = 0


class ClipFacts(msgspec.Struct, frozen=True):
    """A clip that was read.

    Attributes:
        name: its name.
        frames: number of its frames.
        seconds: its duration.
        fps: its frames a second; None for keyframes, which have times of their own.
        posed_first: whether its first frame seems to be a pose, such as a T-pose, added before the recording.
    """

    name: str
    frames: int
    seconds: float
    fps: float | None
    posed_first: bool


class Body(msgspec.Struct, frozen=True):
    """A body that was read.

    Attributes:
        names: names of joints [J].
        parents: parents of joints [J].
        offsets: offsets of joints [J][3], metres.
        tips: tips of joints [J][3], metres.
        name: name of the skeleton.
    """

    name: str
    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: list[list[float]]
    tips: list[list[float]]


class Facts(msgspec.Struct, frozen=True):
    """Facts of a file that was read.

    Attributes:
        clips: its clips.
        body: their body; the corpora's body if the file's joints map to it.
        joints: number of the file's own joints.
        rig: name of the rig, if its joints are known; otherwise "".
        people: whether the body is human23 or human44.
        filled: joints of the corpora's body that the file lacks.
        height: height of a person with such bones, metres, as a check of the unit.
        unit: the unit in use; "" if the format defines it.
        is_guessed: whether the unit was guessed.
        doubt: how the movement contradicts the clock; "" if it does not.
        faults: joints that jump, the most frequent first, without jumps from an added first frame.
        notes: warnings and repairs from reading.
    """

    clips: tuple[ClipFacts, ...] = ()
    body: Body | None = None
    joints: int = 0
    rig: str = ""
    people: bool = False
    filled: tuple[str, ...] = ()
    height: float = 0.0
    unit: str = ""
    is_guessed: bool = False
    doubt: str = ""
    faults: tuple[Fault, ...] = ()
    notes: tuple[str, ...] = ()


class Answer(msgspec.Struct, frozen=True):
    """The child's answer: facts, or an error."""

    facts: Facts | None = None
    error: str = ""


def clip_file(number: int) -> str:
    """Return the name of the file that holds a clip's arrays."""
    return f"clip-{number}.npz"


def load_clip(folder: Path, facts: Facts, number: int) -> Motion:
    """Load a clip that the child has read.

    Raises:
        MotionMindError: there is no such clip.
    """
    from motionmind.body.motion import Motion
    from motionmind.body.skeleton import Skeleton

    if not (0 <= number < len(facts.clips) and facts.body):
        raise MotionMindError(f"no clip {number + 1}: the file has {len(facts.clips)}")
    body, clip = facts.body, facts.clips[number]
    shape = len(body.names), 3
    skeleton = Skeleton(
        body.name, body.names, body.parents, np.reshape(body.offsets, shape), np.reshape(body.tips, shape)
    )
    with np.load(folder / clip_file(number), allow_pickle=False) as arrays:
        return Motion(
            skeleton, arrays["rotations"], arrays["root"], arrays["times"], name=clip.name, keyframed=clip.fps is None
        )


def lines_of(rows: Sequence[Row]) -> dict[str, list[int]]:
    """Return the line of each posture of a score, and the line of the clip that calls it or is it; from 1."""
    return {"lines": [row.where.line for row in rows], "calls": [row.line for row in rows]}


def load_lines(folder: Path, number: int) -> dict[str, list[int]]:
    """Return the lines of a score's clip that the child has read, as `lines_of`."""
    with np.load(folder / clip_file(number), allow_pickle=False) as arrays:
        return {name: arrays[name].tolist() for name in ("lines", "calls")}


# --- in the child -----------------------------------------------------------------------------------------------------


def main() -> None:
    """Read the file of the order in this folder, and write the answer."""
    _limit()
    order = msgspec.json.decode(Path(ORDER_FILE).read_bytes(), type=Order)
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            motions, lines = _read(order)
            facts = _understand(order, motions, lines)
        notes = tuple(dict.fromkeys(_worded(str(one.message), order) for one in caught))[:_MAX_NOTES]
        answer = Answer(msgspec.structs.replace(facts, notes=notes))
    except MotionMindError as error:
        answer = Answer(error=_worded(str(error), order))
    except MemoryError:
        answer = Answer(error=f"{displayed(order.name)}: needs more memory than allowed")
    Path(FACTS_FILE).write_bytes(msgspec.json.encode(answer))


def _limit() -> None:
    """Limit the resources of this process, if the system can."""
    if sys.platform == "win32":
        return
    import resource

    for kind, limit in (
        (resource.RLIMIT_AS, 2 * 2**30),  # Python's libraries take a few hundred MB of it
        (resource.RLIMIT_CPU, int(TIME_LIMIT_S)),
        (resource.RLIMIT_FSIZE, 2**30),
        (resource.RLIMIT_CORE, 0),
    ):
        _, hard = resource.getrlimit(kind)
        resource.setrlimit(kind, (limit if hard == resource.RLIM_INFINITY else min(limit, hard), hard))


def _worded(message: str, order: Order) -> str:
    """Return a message in one line, with the file's original name."""
    for file, name in ((order.file, order.name), (order.asf or "", "the .asf")):
        message = message.replace(file, name) if file else message
    return displayed(message.replace(f"{Path.cwd()}{os.sep}", ""), 400)


def _read(order: Order) -> tuple[list[Motion], list[dict[str, list[int]]]]:
    """Read the clips of a file, on the file's own joints, and the lines of a score's (`lines_of`)."""
    from motionmind.formats import read_clips

    path, stem = Path(order.file), displayed(Path(order.name).stem)
    if path.suffix == ".score":
        from motionmind.notation.compose import played
        from motionmind.notation.read import read_score

        taken = take_together(order.file, displayed(order.name), order.scores)
        try:
            found = played(read_score(next(iter(taken))))
        except MotionMindError as error:
            message = re.sub("|".join(map(re.escape, taken)), lambda match: taken[match[0]], str(error))
            raise MotionMindError(message) from error
        if not found:
            raise FormatError("has no clip: write one that passes through its postures", path=path)
        if len(found) > _MAX_CLIPS:
            raise FormatError(f"has {len(found)} clips: at most {_MAX_CLIPS} are allowed", path=path)
        return [replace(one, name=displayed(one.name)) for _, one in found], [lines_of(rows) for rows, _ in found]
    clips = list(islice(read_clips(path, unit=order.unit, asf=order.asf, fps=order.fps), _MAX_CLIPS + 1))
    if len(clips) > _MAX_CLIPS:
        raise FormatError(f"has more than {_MAX_CLIPS} clips, which is too many", path=path)
    names = [stem + displayed(one.name.removeprefix(path.stem)) for one in clips] if len(clips) > 1 else [stem]
    return [replace(one, name=name) for one, name in zip(clips, names, strict=True)], [lines_of([]) for _ in clips]


def _understand(order: Order, motions: list[Motion], lines: list[dict[str, list[int]]]) -> Facts:
    """Write the clips, on the corpora's body if their joints map to it, and return the facts."""
    from motionmind.body.human import human23, human44
    from motionmind.body.tempo import question_tempo
    from motionmind.corpus.flips import find_flips
    from motionmind.formats.units import HEIGHT_PER_SPAN_RATIO, bone_span
    from motionmind.retarget.joint_mapping import filled_joints, known_rig
    from motionmind.retarget.retarget import own_skeleton

    raw = motions[0].skeleton
    known = known_rig(raw)
    own = [own_skeleton(motion) for motion in motions]
    body = own[0].skeleton
    faults: list[Fault] = []
    clips = []
    for number, motion in enumerate(own):
        rows = {name: np.array(values, dtype=np.int64) for name, values in lines[number].items()}
        arrays: dict[str, Any] = {"rotations": motion.rotations, "root": motion.root, "times": motion.times, **rows}
        np.savez(clip_file(number), **arrays)
        is_posed = is_posed_first(motion)
        faults += _faults([flip for flip in find_flips(motion) if not (is_posed and flip.frame == 1)], motion, number)
        seconds, still = float(motion.times[-1] - motion.times[0]), motion.keyframed or len(motion) == 1
        clips.append(ClipFacts(motion.name, len(motion), seconds, None if still else float(motion.fps), is_posed))
    unit, is_guessed = _unit(order)
    return Facts(
        clips=tuple(clips),
        body=Body(
            displayed(Path(order.name).stem) if body.name == Path(order.file).stem else body.name,
            body.names,
            tuple(map(int, body.parents)),
            body.offsets.tolist(),
            body.tips.tolist(),
        ),
        joints=len(raw),
        rig=known[0].name if known else "",
        people=any(human().difference(body) is None for human in (human23, human44)),
        filled=tuple(filled_joints(known[1])) if known and len(body) == 23 else (),
        height=HEIGHT_PER_SPAN_RATIO * bone_span(np.array(raw.parents), raw.offsets, raw.tips),
        unit=unit,
        is_guessed=is_guessed,
        doubt=next(filter(None, map(question_tempo, own)), ""),
        faults=tuple(sorted(faults, key=lambda fault: -fault.times)[:_MAX_NOTES]),
    )


def _faults(flips: Sequence[JointFlip], motion: Motion, clip: int) -> Iterator[Fault]:
    """Yield the joints of a clip that jump."""
    for joint in dict.fromkeys(flip.joint for flip in flips):
        own = [flip for flip in flips if flip.joint == joint]
        first = float(motion.times[min(flip.frame for flip in own)])
        yield Fault(displayed(joint), len(own), first, max(flip.degrees for flip in own), clip)


def _unit(order: Order) -> tuple[str, bool]:
    """Return the unit of a file, "" if its format defines one, and whether it was guessed."""
    if order.unit is not None:
        return order.unit, False
    if not order.file.endswith(".bvh"):
        return "", False
    from motionmind.formats.bvh import bvh_unit

    return bvh_unit(order.file)[0], True


def is_posed_first(motion: Motion) -> bool:
    """Return whether the first frame of a recording seems to be a pose that a program added, such as a T-pose.

    The body turns at least four times as far from such a pose as between any two of the next frames, or several joints
    jump (`added_frames`). The pose either rotates no joint or stretches out both arms level.
    """
    from motionmind.corpus.recordings import added_frames
    from motionmind.geometry import rotations as rot

    if len(motion) < 10 or motion.keyframed:
        return False
    turned = rot.angle(motion.rotations[:9], motion.rotations[1:10]).max(axis=1)
    if turned[0] < np.radians(10.0) or (turned[0] < 4.0 * turned[1:].max() and added_frames(motion) != 1):
        return False
    unrotated = float(rot.angle(motion.rotations[0, 1:], np.array([0.0, 0.0, 0.0, 1.0])).max()) < 1e-3
    return unrotated or _has_level_arms(motion)


def _has_level_arms(motion: Motion) -> bool:
    """Return whether both arms rise or fall by less than 0.35 of their length in the first frame.

    False for a body without human arms.
    """
    names = motion.skeleton.names
    if not {"left_shoulder", "left_wrist", "right_shoulder", "right_wrist"} <= set(names):
        return False
    place = motion.skeleton.positions(motion.rotations[:1], motion.root[:1])[0]
    arms = [place[names.index(f"{side}_wrist")] - place[names.index(f"{side}_shoulder")] for side in ("left", "right")]
    return all(abs(arm[1]) < 0.35 * np.linalg.norm(arm) for arm in arms)


if __name__ == "__main__":
    atexit.register(gc.freeze)  # skips the garbage collection at exit, which is slow
    main()
