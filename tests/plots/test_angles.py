"""Curves of joint angles: where they are drawn, in which colours, and of which joints."""

from __future__ import annotations

import re
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

from motionmind import Engine, Motion, MotionMindError, Skeleton, SkeletonError
from motionmind.body.motion import Insertion
from motionmind.geometry import rotations as rot
from motionmind.plots import draw_angles
from motionmind.plots.canvas import png
from motionmind.plots.marks import Line
from motionmind.render.markup import hexadecimal
from motionmind.render.palette import BRIDGED, PLOT, VIOLET

ARM = Skeleton("arm", ("shoulder", "elbow"), (-1, 0), np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]]))


def swinging(*insertions: Insertion) -> Motion:
    """An arm whose shoulder stays at 30 degrees and whose elbow bends evenly from 0 to 100 degrees in a second."""
    angles = np.stack([np.full(11, 30.0), np.linspace(0.0, 100.0, 11)], axis=-1)
    rotations = rot.from_axis_angle(np.array([0.0, 0.0, 1.0]), np.radians(angles))
    return Motion(ARM, rotations, np.zeros((11, 3)), np.linspace(0.0, 1.0, 11), "swing", insertions)


def curves(motion: Motion, *joints: str) -> list[Line]:
    plate = draw_angles(motion, joints or None)
    return [mark for mark in plate.marks if isinstance(mark, Line) and mark.ink in (PLOT.piece, VIOLET, BRIDGED)]


def test_equal_turns_are_equally_high_and_equal_times_equally_wide() -> None:
    shoulder, elbow = [line.points for line in curves(swinging()) if line.title]
    assert np.ptp(shoulder[:, 1]) < 1e-6
    steps = np.diff(elbow, axis=0)
    np.testing.assert_allclose(steps, steps[:1].repeat(10, axis=0), atol=1e-6)
    assert steps[0, 1] < 0.0 < steps[0, 0]  # up, as angles grow, and to the right
    faster = [line.points for line in curves(swinging(), "elbow", "elbow") if line.title]
    assert np.ptp(faster[0][:, 1]) == pytest.approx(np.ptp(faster[1][:, 1]))


def test_inserted_and_bridged_movement_have_their_colours() -> None:
    motion = swinging(Insertion(np.array([0.3, 0.5, 0.7]), bridged=(("elbow", 1),)))
    found = [(line.ink, len(line.points)) for line in curves(motion, "elbow") if line.title]
    assert found == [(PLOT.piece, 4), (PLOT.piece, 4), (VIOLET, 5), (BRIDGED, 4)]
    assert [line for line in curves(motion, "shoulder") if line.ink == BRIDGED and line.title] == []


def test_the_joints_that_turn_most_are_drawn_unless_others_are_asked_for() -> None:
    engine = Engine.load("ballet")
    motion = engine.corpus.motion(engine.corpus.clips[0])
    spans = dict(
        zip(motion.skeleton.names, np.ptp(motion.to_dataframe().xs("degrees", axis=1, level=1), 0), strict=True)
    )
    drawn = list(dict.fromkeys(line.title for line in curves(motion) if line.title))
    assert sorted(drawn) == sorted(sorted(spans, key=lambda name: -spans[name])[:8])
    assert drawn == [name for name in motion.skeleton.names if name in drawn]
    assert {line.title for line in curves(motion, "right_knee") if line.title} == {"right_knee"}


def test_the_picture_is_whole_whatever_turns(tmp_path: Path) -> None:
    """Each curve lies within its own two lines, and the words within the picture."""
    engine = Engine.load("walk-hexapod")
    plate = draw_angles(engine.corpus.motion(engine.corpus.clips[0]), engine.corpus.skeleton.names)
    plate.save(tmp_path / "chart.svg")
    root = ElementTree.parse(tmp_path / "chart.svg").getroot()
    assert root.attrib["viewBox"] == f"0 0 {plate.width} {plate.height}"
    for line in root.iter("{http://www.w3.org/2000/svg}polyline"):
        points = np.array([pair.split(",") for pair in line.attrib["points"].split()], float)
        assert (points >= 0.0).all()
        assert (points <= [plate.width, plate.height]).all()
    assert hexadecimal(PLOT.piece) in (tmp_path / "chart.svg").read_text()
    assert Image.open(BytesIO(png(plate))).size == (plate.width, plate.height)
    assert plate._repr_svg_().startswith("<svg")
    assert len(repr(plate)) < 200


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda: draw_angles(swinging().slice(0, 1)), MotionMindError, "swing has one frame"),
        (lambda: draw_angles(swinging(), ["tail"]), SkeletonError, "no joint 'tail'"),
        (lambda: draw_angles(swinging(), []), MotionMindError, "one joint or more"),
        (lambda: draw_angles(swinging(), "elbow"), MotionMindError, re.escape("write ['elbow']")),
        (lambda: draw_angles(swinging()).save("chart.gif"), MotionMindError, "chart.gif: suffix '.gif' is unknown"),
    ],
)
def test_what_cannot_be_drawn_is_refused(call: Callable[[], Any], error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        call()
