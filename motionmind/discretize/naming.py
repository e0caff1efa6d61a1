"""Libraries of joint states made from scores: each state takes its name from the words of the score.

Such a library is a draft for an expert to edit.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping

import numpy as np

from motionmind._typing import Floats
from motionmind.arguments import check_flag, check_items, check_mapping
from motionmind.body.anatomy import Anatomy, Joint
from motionmind.discretize.library import Library
from motionmind.discretize.protocol import check_range, per_joint_values
from motionmind.errors import MotionMindError
from motionmind.geometry import rotations as rot
from motionmind.notation.compose import played
from motionmind.notation.score import Score

_Named = list[tuple[str, Floats]]  # names and rotations [4], most frequent first


def name_states(
    scores: Iterable[Score], tolerance: float, per_joint: Mapping[str, float] | None = None, *, stage: bool = False
) -> Library:
    """Name states for all joints in the scores' clips; every posture is then near a state with a name.

    In order of frequency, each orientation becomes a state unless a state already lies within the tolerance (leader
    clustering: Hartigan, "Clustering Algorithms", 1975, chapter 3). States are rounded to whole degrees, so a posture
    may exceed the tolerance by a degree.

    Args:
        scores: scores for the same body.
        tolerance: degrees.
        per_joint: degrees for single joints, or pairs of joints.
        stage: whether the pelvis' states include the heading, as in a corpus whose facing is `stage`.

    Raises:
        MotionMindError: there is no clip to name states after, scores are for several bodies, or a tolerance is out of
            range.

    >>> from pathlib import Path
    >>> text = '''title  Two bends of the knees
    ... body   human23
    ... legs
    ...   stand = stand out 10 turn 8
    ...   bend = stand out 10 turn 8, bend 30
    ... clip bends: Down and up
    ...   start | stand
    ...   1     | bend
    ...   1     | stand
    ... '''
    >>> _ = Path("bends.score").write_text(text)
    >>> from motionmind import read_score
    >>> from motionmind.discretize import name_states
    >>> name_states([read_score("bends.score")], 12.0).skeleton
    'human23'
    """
    check_mapping("per_joint", per_joint, or_none=True)
    check_flag("stage", stage)
    check_items("scores", scores, "scores")
    scores, per_joint = list(scores), per_joint or {}
    check_items("scores", scores, "scores, as read_score reads", Score)
    check_range("tolerance in degrees", {"": tolerance, **per_joint}, 0.01, 180.0)
    if not any(score.clips for score in scores):
        paths = ", ".join(score.path for score in scores)
        raise MotionMindError(f"{paths or 'no score'}: no clip to name states after")
    body = scores[0].body
    for score in scores:
        if score.body.path != body.path:
            raise MotionMindError(
                f"{score.path} is for {score.body.skeleton.name}, {scores[0].path} for {body.skeleton.name}: "
                "a library is for one body"
            )
    found: dict[str, Counter[tuple[str, bytes]]] = {joint: Counter() for joint in body.joints}
    for score in scores:
        for joint, name, turned in _orientations(score, stage):
            found[joint][name, turned.tobytes()] += 1
    stems = list(body.joints)
    widths = np.radians(per_joint_values(stems, tolerance, per_joint))
    tables = {}
    for joint, width in zip(stems, widths, strict=True):
        named = [(name, np.frombuffer(turned)) for (name, turned), _ in found[joint].most_common()]
        tables[joint] = _table(body, joint, _leaders(named, float(width)))
    return Library(tables, title=scores[0].title, skeleton=body.skeleton.name)


def _orientations(score: Score, stage: bool) -> Iterable[tuple[str, str, Floats]]:
    """Yield the joint, name and rotation [4] of every joint in every posture; mirror those of right joints."""
    body = score.body
    layers = {joint: index for index, joints in enumerate(body.layers.values()) for joint in joints}
    for rows, motion in played(score):
        turned = np.round(motion.rotations, 6)
        if not stage:
            upright = rot.about_vertical(rot.heading(motion.rotations[:, 0]))
            turned[:, 0] = np.round(rot.inv_mul(upright, motion.rotations[:, 0]), 6)
        for index, name in enumerate(body.skeleton.names):
            joint, _ = body.anatomy(name)
            right = name.startswith("right_") and body.paired(joint)
            seen = rot.mirror(turned[:, index]) if right else turned[:, index]
            for t, row in enumerate(rows):
                words = row.words[layers[joint]][int(right)]
                facing = f", facing {row.face % 360:g}" if stage and index == 0 and row.face % 360 else ""
                yield joint, words + facing, seen[t]


def _leaders(named: _Named, width: float) -> _Named:
    """Choose orientations more than `width` radians apart, so that each in `named` lies within it of a chosen one."""
    chosen: _Named = []
    for name, turned in named:
        if not chosen or rot.angle(np.stack([kept for _, kept in chosen]), turned).min() > width:
            chosen.append((name, turned))
    return chosen


def _table(body: Anatomy, joint: str, named: _Named) -> dict[str, str]:
    """Return a library's table: turns by name; states of the same name get numbers."""
    times, out = Counter[str](), dict[str, str]()
    for name, turned in named:
        turns = _turns(body.joints[joint], turned)
        if turns in out.values():
            continue
        times[name] += 1
        out[f"{name} ({times[name]})" if times[name] > 1 else name] = turns
    return out


def _turns(joint: Joint, turned: Floats) -> str:
    """Return a rotation [4] as turns in whole degrees: that about the bone last, or first if its axis is outermost."""
    order = "yxz" if joint.outer else "xzy" if joint.long == "y" and not joint.rest else "yzx"
    first, middle, last = np.round(np.degrees(rot.to_euler(order, turned)))
    # A rotation has two triples of Euler angles; the smaller one is easier to read.
    triples = np.array([[first, middle, last], [first + 180.0, 180.0 - middle, last + 180.0]])
    triples = (triples + 179.0) % 360.0 - 179.0
    degrees = min(triples, key=lambda triple: np.abs(triple).sum())
    return ", ".join(f"{axis} {angle:g}" for axis, angle in zip(order, degrees, strict=True) if angle)
