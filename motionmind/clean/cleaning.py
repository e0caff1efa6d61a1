"""Cleaning: the steps that repair a recording. Each can be left out.

In this order, they fill *gaps*, repair *flips* as at learning and remove spikes, *filter* jitter, lock standing *feet*
to their places, and set the *floor* to 0. The recording keeps its skeleton and its frames. Frames of a pose that was
added before the movement move with the floor only.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import msgspec
import numpy as np

from motionmind._typing import Floats, Singles
from motionmind.arguments import check_items, check_mapping, check_type
from motionmind.body.contact import find_floor, heels_of
from motionmind.body.motion import Motion
from motionmind.body.rates import FILM_FPS
from motionmind.body.tempo import runs_of
from motionmind.clean.feet import Contact, lock_feet
from motionmind.clean.filling import fill_by_engine
from motionmind.clean.jitter import Filtered, filter_places, filter_rotations
from motionmind.clean.report import (
    CleanReport,
    JointReport,
    StanceReport,
    StepReport,
    jitter_report,
    joint_bounds,
    moved,
    step_report,
)
from motionmind.clean.spikes import repair_spikes
from motionmind.corpus.dropped import LONGEST_EVEN_GAP_S, fill_gaps, go_evenly
from motionmind.corpus.flips import repair_flips
from motionmind.corpus.recordings import added_frames
from motionmind.errors import MotionMindError, NoPathError, SkeletonError
from motionmind.geometry import rotations as rot
from motionmind.retarget.joint_mapping import joint_mapping
from motionmind.retarget.retarget import fit_upright, to_y_up_world
from motionmind.retarget.vertical import Vertical, check_up
from motionmind.tween.engine import Engine

STEPS = ("gaps", "flips", "filter", "feet", "floor")
MIN_FLOOR_M = 1e-4  # a floor nearer to 0 is left alone


@dataclass(frozen=True, eq=False)
class Cleaning:
    """A recording and its repair.

    Attributes:
        original: the recording.
        motion: the repaired recording, on the same skeleton and in the same frames.
        steps: the changes of each step that was taken, in order.
        contacts: the frames in which points of feet stand locked.
        floor: height at which the floor was found, metres; None if it was not looked for.
        jitter: the filter's findings about each joint, and about the root's position; None without it.
        gaps: the gaps that are left: their first frame, and the frame after them.
        moved: how far each step moved each joint in each frame [T, J], metres, by the step's name.

    >>> from motionmind import Engine
    >>> from motionmind.clean import clean_motion
    >>> engine = Engine.load("ballet")
    >>> tween = engine.tween(engine.posture("ballet/arabesque"), engine.posture("ballet/fifth"))
    >>> [step.step for step in clean_motion(tween.motion).steps]
    ['gaps', 'flips', 'filter', 'feet', 'floor']
    """

    original: Motion
    motion: Motion
    steps: tuple[StepReport, ...]
    contacts: tuple[Contact, ...]
    floor: float | None
    jitter: tuple[Filtered, Filtered] | None
    gaps: tuple[tuple[int, int], ...]
    moved: Mapping[str, Singles]

    def report(self) -> dict[str, Any]:
        """Return the report as plain values for JSON: see `CleanReport`."""
        found: dict[str, Any] = msgspec.to_builtins(self.summary())
        return found

    def summary(self) -> CleanReport:
        """Return the report: the steps, and upper bounds of each joint's change."""
        skeleton, jitter = self.original.skeleton, self.jitter
        joints = []
        for number, (mm, degrees) in enumerate(joint_bounds(self.original, self.motion)):
            own = None if jitter is None else jitter_report(jitter[0], number, float(np.degrees(1.0)))
            joints.append(JointReport(skeleton.names[number], mm, degrees, own))
        return CleanReport(
            self.original.name,
            len(self.original),
            round(self.original.fps, 6),
            list(self.steps),
            joints,
            [self._stance(one) for one in self.contacts],
            None if self.floor is None else round(1000.0 * self.floor, 3),
            None if jitter is None else jitter_report(jitter[1], 0, 1000.0),
            [(start, stop - 1) for start, stop in self.gaps],
        )

    def _stance(self, contact: Contact) -> StanceReport:
        skeleton = self.original.skeleton
        count, heels = len(skeleton), [heel.ankle for heel in heels_of(skeleton).values()]
        kind = ("joint", "tip", "heel")[min(contact.point // count, 2)]
        joint = heels[contact.point - 2 * count] if kind == "heel" else contact.point % count
        return StanceReport(skeleton.names[joint], kind, contact.first, contact.last, contact.held)


def clean_motion(
    motion: Motion,
    *,
    without: Collection[str] = (),
    fill: Sequence[tuple[int, int]] = (),
    engine: Engine | None = None,
    joints: Mapping[str, str] | None = None,
    up: str | None = None,
) -> Cleaning:
    """Repair a recording: gaps, flips and spikes, jitter, feet that slide, and a floor off 0.

    Args:
        motion: the recording, on any skeleton.
        without: steps to leave out: "gaps", "flips", "filter", "feet", "floor".
        fill: more gaps than `find_gaps` finds: first and last frame of each, from 0.
        engine: the engine of a corpus, which fills gaps of more than a quarter of a second; None leaves them.
        joints: {recording's joint: human23's joint}, for the engine; None recognises the rig by its names.
        up: "y" or "z", the vertical in the recording; None takes that which people stand along.

    Raises:
        MotionMindError: the motion has keyframes or a single frame, a step is unknown, or a gap is outside the motion,
            at its ends, or too long without an engine.
        SkeletonError: a gap is to be filled by a corpus to whose skeleton the rig does not map.

    >>> import numpy as np
    >>> from motionmind import Motion, human23
    >>> from motionmind.clean import clean_motion
    >>> at_rest = np.tile([0.0, 0.0, 0.0, 1.0], (60, 23, 1))
    >>> floating = Motion(human23(), at_rest, np.tile([0.0, 2.0, 0.0], (60, 1)), np.arange(60) / 30)
    >>> clean_motion(floating).motion.root[0].round(2).tolist()
    [0.0, 0.97, 0.0]
    """
    check_type("motion", motion, Motion)
    check_items("without", without, "names of steps", str)
    check_items("fill", fill, "pairs of frames", tuple)
    check_type("engine", engine, Engine, or_none=True)
    check_mapping("joints", joints, or_none=True)
    check_up(up)
    name = motion.name or "the motion"
    if unknown := [step for step in without if step not in STEPS]:
        raise MotionMindError(f"without: there is no step {unknown[0]!r}; the steps are {', '.join(STEPS)}")
    if motion.keyframed or len(motion) < 2:
        raise MotionMindError(f"{name}: keyframes or a single posture; cleaning is for recordings")
    _check_fill(motion, fill, engine)
    work = _Work(motion, _world(motion, joints, up), joints, fill, engine)
    steps: list[StepReport] = []
    far: dict[str, Singles] = {}
    for step in STEPS:
        if step not in without:
            before = work.motion
            about = work.take(step)
            found = moved(before, work.motion)
            steps.append(step_report(step, before, work.motion, found, about))
            far[step] = found.astype(np.float32)
    contacts, gaps = tuple(work.contacts), tuple(work.left)
    return Cleaning(motion, work.result(), tuple(steps), contacts, work.floor, work.jitter, gaps, far)


def _check_fill(motion: Motion, fill: Sequence[tuple[int, int]], engine: Engine | None) -> None:
    """Raise MotionMindError unless each gap is within the motion, and either short or to be filled by an engine."""
    name = motion.name or "the motion"
    for first, last in fill:
        if not 0 < first <= last < len(motion) - 1:
            raise MotionMindError(
                f"{name}: frames {first}-{last} cannot be filled: a gap lies between frames 1 and {len(motion) - 2}"
            )
        seconds = float(motion.times[last + 1] - motion.times[first - 1])
        if engine is None and seconds > LONGEST_EVEN_GAP_S:
            raise MotionMindError(f"{name}: frames {first}-{last} last {seconds:.2f} s: only a corpus can fill them")


def _world(motion: Motion, joints: Mapping[str, str] | None, up: str | None) -> Floats:
    """Return the rotation [4] from the world of a recording to one with y up."""
    if up is None and joint_mapping(motion.skeleton, joints) is not None:
        try:
            return to_y_up_world(fit_upright(motion, joints, None)[1])
        except SkeletonError:  # its zero pose does not show how it stands
            pass
    return to_y_up_world(Vertical(up or "y"))


class _Work:
    """A recording in the course of its cleaning."""

    def __init__(
        self,
        motion: Motion,
        up: Floats,
        joints: Mapping[str, str] | None,
        fill: Sequence[tuple[int, int]],
        engine: Engine | None,
    ) -> None:
        self.up, self.joints, self.engine = up, joints, engine
        self.is_turned = bool(rot.angle(up, rot.IDENTITY) > 0.0)
        self.motion = self._turned(motion, up) if self.is_turned else motion
        self.fill = [(first, last + 1) for first, last in fill]
        self.begin = added_frames(motion)
        self.left: list[tuple[int, int]] = []
        self.cuts: list[int] = []
        self.contacts: list[Contact] = []
        self.floor: float | None = None
        self.jitter: tuple[Filtered, Filtered] | None = None

    def take(self, step: str) -> str:
        """Take a step; return what it did, in words."""
        does: dict[str, Callable[[], str]] = {
            "gaps": self._gaps,
            "flips": self._flips,
            "filter": self._filter,
            "feet": self._feet,
            "floor": self._floor,
        }
        return does[step]()

    def result(self) -> Motion:
        """Return the recording in the world of its file."""
        return self._turned(self.motion, rot.inv(self.up)) if self.is_turned else self.motion

    def _turned(self, motion: Motion, turn: Floats) -> Motion:
        rotations = motion.rotations.copy()
        rotations[:, 0] = rot.mul(turn, rotations[:, 0])
        return replace(motion, rotations=rotations, root=rot.mul_vec(turn, motion.root))

    def _parts(self) -> Iterator[slice]:
        """Yield the stretches of recorded movement between gaps and leaps, without added frames."""
        known = np.ones(len(self.motion), dtype=np.bool_)
        known[: self.begin] = False
        for start, stop in self.left:
            known[start:stop] = False
        for start, stop in runs_of(known):
            inner = [cut for cut in self.cuts if start < cut < stop]
            for a, b in zip([start, *inner], [*inner, stop], strict=True):
                yield slice(a, b)

    # --- the steps ----------------------------------------------------------------------------------------------------

    def _gaps(self) -> str:
        rotations, root, times = self.motion.rotations.copy(), self.motion.root.copy(), self.motion.times
        long: list[tuple[int, int]] = []
        for start, stop in self.fill:
            if times[stop] - times[start - 1] > LONGEST_EVEN_GAP_S:
                long.append((start, stop))
            else:
                go_evenly(times, rotations, root, start, stop)
        self.motion = replace(self.motion, rotations=rotations, root=root) if self.fill else self.motion
        found = fill_gaps(self.motion, self.begin)
        self.motion = found.motion
        named = set(long)
        leaps = [gap.start for gap in found.left if gap.kind == "leap"]
        self.cuts = [leap for leap in leaps if not any(start <= leap <= stop for start, stop in named)]
        long += [
            (gap.start, gap.stop)
            for gap in found.left
            if gap.kind != "leap" and not any(start < gap.stop and gap.start < stop for start, stop in named)
        ]
        long.sort()
        short = len({(one.start, one.stop) for one in found.repairs}) + len(self.fill) - len(named)
        filled = self._fill_long(long)
        words = [f"{short} short, gone over evenly"] * bool(short)
        words += [found.clock] * bool(found.clock)
        words += [f"{filled} filled from {self.engine.corpus.name}"] if filled and self.engine else []
        words += [f"{len(self.left)} left: " + ", ".join(f"{a}-{b - 1}" for a, b in self.left)] * bool(self.left)
        words += ["leaps before frames " + ", ".join(map(str, self.cuts))] * bool(self.cuts)
        return "; ".join(words) or "none"

    def _fill_long(self, gaps: list[tuple[int, int]]) -> int:
        """Fill gaps by the engine; return their number. Gaps that it cannot fill are left."""
        known = np.ones(len(self.motion), dtype=np.bool_)
        known[: self.begin] = False
        for start, stop in gaps:
            known[start:stop] = False
        filled = 0
        for start, stop in gaps:
            if self.engine is None or not (known[start - 1] and known[stop]):
                self.left.append((start, stop))
                continue
            try:
                self.motion = fill_by_engine(self.motion, (start, stop), known, self.engine, self.joints)
                filled += 1
            except NoPathError:
                self.left.append((start, stop))
        return filled

    def _flips(self) -> str:
        kinds: list[str] = []
        joints: set[str] = set()
        for part in self._parts():
            mended = repair_flips(self.motion.slice(part.start, part.stop))
            if mended.flips:
                self._put(part, mended.motion)
            kinds += [flip.repair for flip in mended.flips]
            joints |= {flip.joint for flip in mended.flips}
            despiked = repair_spikes(self.motion.rotations[part], self.motion.fps)
            if despiked.spikes.any():
                self._put(part, replace(mended.motion, rotations=despiked.rotations))
                kinds += ["spike"] * int(despiked.spikes.sum())
                joints |= {mended.motion.skeleton.names[joint] for joint in np.flatnonzero(despiked.spikes.any(axis=0))}
        if not kinds:
            return "none"
        spikes = f"spike{'s' * (kinds.count('spike') > 1)} removed"
        named = {"put back": "put back", "reconstructed": "reconstructed", "none": "left", "spike": spikes}
        counts = ", ".join(f"{kinds.count(kind)} {word}" for kind, word in named.items() if kind in kinds)
        return f"{counts} ({', '.join(sorted(joints))})"

    def _filter(self) -> str:
        motion, parts = self.motion, list(self._parts())
        if motion.fps < FILM_FPS or not motion.is_even:
            return "left out: it needs evenly spaced frames, 15 a second at least"
        rotations, root = motion.rotations.copy(), motion.root.copy()
        found: list[tuple[slice, Filtered, Filtered]] = []
        for part in parts:
            turned = filter_rotations(motion.rotations[part], motion.fps)
            went = filter_places(motion.root[part, None], motion.fps)
            rotations[part], root[part] = turned.values, went.values[:, 0]
            found.append((part, turned, went))
        self.motion = replace(motion, rotations=rotations, root=root)
        self.jitter = _joined([(one[0], one[1]) for one in found]), _joined([(one[0], one[2]) for one in found])
        return _describe_jitter(*self.jitter)

    def _feet(self) -> str:
        if self.motion.fps < FILM_FPS:
            return "left out: it needs 15 frames a second at least"
        for part in self._parts():
            locked = lock_feet(self.motion.slice(part.start, part.stop))
            self._put(part, locked.motion)
            for one in locked.contacts:
                self.contacts.append(one._replace(first=one.first + part.start, last=one.last + part.start))
        held = sum(one.held for one in self.contacts)
        missed = f", {len(self.contacts) - held} not held" * (held < len(self.contacts))
        return f"{held} contacts held{missed}" if self.contacts else "none stand"

    def _floor(self) -> str:
        moving = slice(self.begin, None)
        body, rotations, root = self.motion.skeleton, self.motion.rotations[moving], self.motion.root[moving]
        self.floor = find_floor(body, rotations, root, heels=True)
        if abs(self.floor) < MIN_FLOOR_M:
            return "at 0"
        self.motion = replace(self.motion, root=self.motion.root - np.array([0.0, self.floor, 0.0]))
        return f"was {1000.0 * abs(self.floor):.1f} mm {'above' if self.floor > 0.0 else 'below'} 0"

    def _put(self, part: slice, changed: Motion) -> None:
        """Put changed frames in place of a part of the recording."""
        rotations, root = self.motion.rotations.copy(), self.motion.root.copy()
        rotations[part], root[part] = changed.rotations, changed.root
        self.motion = replace(self.motion, rotations=rotations, root=root)


def _joined(parts: Sequence[tuple[slice, Filtered]]) -> Filtered:
    """Join the findings about parts of a recording; the noise is that of the longest."""
    longest = max(parts, key=lambda one: one[0].stop - one[0].start)[1]
    values, cut_offs = (np.concatenate([getattr(one, name) for _, one in parts]) for name in ("values", "cut_offs"))
    return Filtered(values, longest.noise, cut_offs)


def _describe_jitter(turned: Filtered, went: Filtered) -> str:
    """Describe the noise that was filtered, and the cut-off."""
    words = []
    filtered = np.flatnonzero(np.isfinite(turned.cut_offs).any(axis=0))
    if len(filtered):
        finite = turned.cut_offs[np.isfinite(turned.cut_offs)]
        low, middle, high = np.percentile(finite, (5.0, 50.0, 95.0))
        noise = np.degrees(np.median(turned.noise[filtered]))
        joints = f"{len(filtered)} joint{'s' * (len(filtered) != 1)} with {noise:.2g} degrees of noise"
        words.append(f"{joints}, cut-off {middle:.3g} Hz ({low:.3g} to {high:.3g})")
    if np.isfinite(went.cut_offs).any():
        middle = np.median(went.cut_offs[np.isfinite(went.cut_offs)])
        words.append(f"root with {1000.0 * went.noise[0]:.2g} mm, cut-off {middle:.3g} Hz")
    return "; ".join(words) or "cut-off none: no jitter"
