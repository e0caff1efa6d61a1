"""Floor plans: paths, facings and footprints lie where the movement has them, and stages are measured from the path."""

from __future__ import annotations

from dataclasses import replace
from math import cos, radians, sin

import numpy as np
import pytest
from damages import recording

from motionmind import MotionMindError
from motionmind._typing import Floats
from motionmind.body.motion import Motion
from motionmind.clean.stances import find_foot_stances
from motionmind.geometry import rotations as rot
from motionmind.music import Beats
from motionmind.plots import Plate, draw_floor_plan, find_overstep
from motionmind.plots.marks import Dot, Line, Words

WALK = recording(60.0)


def lines(plate: Plate, title: str) -> list[Line]:
    return [mark for mark in plate.marks if isinstance(mark, Line) and title in mark.title]


def words(plate: Plate) -> list[str]:
    return [mark.text for mark in plate.marks if isinstance(mark, Words)]


def dot(plate: Plate, title: str) -> Floats:
    (found,) = (mark for mark in plate.marks if isinstance(mark, Dot) and mark.title == title)
    return np.array(found.at)


def moved(motion: Motion, x: float = 0.0, z: float = 0.0) -> Motion:
    return replace(motion, root=motion.root + np.array([x, 0.0, z]))


def turned(motion: Motion, degrees: float) -> Motion:
    """Return a movement turned about the vertical through the origin."""
    turn = rot.about_vertical(radians(degrees))
    rotations = motion.rotations.copy()
    rotations[:, 0] = rot.mul(turn, rotations[:, 0])
    return replace(motion, rotations=rotations, root=rot.mul_vec(turn, motion.root))


def test_the_path_is_to_scale_and_a_print_marks_every_stance() -> None:
    plate = draw_floor_plan(WALK)
    (path,) = lines(plate, "path of the pelvis")
    at = WALK.root[:, [0, 2]]
    scales = np.ptp(path.points, axis=0)[np.ptp(at, axis=0) > 0.01] / np.ptp(at, axis=0)[np.ptp(at, axis=0) > 0.01]
    np.testing.assert_allclose(scales, scales[0])
    np.testing.assert_allclose(path.points, path.points[0] + scales[0] * (at - at[0]), atol=1e-6)
    np.testing.assert_allclose(dot(plate, "start"), path.points[0])
    np.testing.assert_allclose(dot(plate, "end"), path.points[-1])
    _, feet = find_foot_stances(WALK)
    for one, side in zip(feet, ("left", "right"), strict=True):
        assert len(lines(plate, f"{side} foot")) == len(one.stances) > 0
    prints = np.concatenate([line.points.mean(axis=0, keepdims=True) for line in lines(plate, " foot")])
    nearest = np.linalg.norm(prints[:, None] - path.points, axis=-1).min(axis=1)
    assert nearest.max() < 0.6 * scales[0], "no foot stands far from the body"


@pytest.mark.parametrize("degrees", [0.0, 30.0, 135.0, -80.0])
def test_arrows_point_where_the_body_faces(degrees: float) -> None:
    rest = WALK.slice(0, 2)
    rotations = np.zeros_like(rest.rotations)
    rotations[..., 3] = 1.0
    still = turned(replace(rest, rotations=rotations), degrees)
    (shaft, _head) = lines(draw_floor_plan(still), "s")[-2:]
    along = shaft.points[1] - shaft.points[0]
    np.testing.assert_allclose(along / np.linalg.norm(along), [sin(radians(degrees)), cos(radians(degrees))], atol=1e-6)


def test_facings_are_written_in_counts_or_seconds() -> None:
    seconds = WALK.times[-1] - WALK.times[0]
    assert {"0"} <= set(words(draw_floor_plan(WALK, every=1.0)))
    arrows = lines(draw_floor_plan(WALK, tempo=120.0, every=1.0), "count")
    numbers = [int(line.title.split()[1].split("-")[0]) for line in arrows[::2]]
    assert numbers == sorted(numbers)
    assert numbers[0] == 1
    last = int(arrows[-1].title.split()[1].split("-")[-1])
    assert last == int(2.0 * seconds + 1e-6) + 1


def test_counts_of_even_beats_are_those_of_a_tempo_and_of_uneven_ones_where_the_body_is_at_them() -> None:
    far = replace(WALK, root=WALK.root + WALK.times[:, None] * [1.0, 0.0, 0.0])
    even = draw_floor_plan(far, beats=Beats(np.arange(4) * 0.5 + 0.3), every=1.0)
    titles = [line.title for line in lines(draw_floor_plan(far, tempo=120.0, every=1.0), "count")]
    assert [line.title for line in lines(even, "count")] == titles
    uneven = Beats([0.2, 0.5, 1.4, 2.0])
    late = lines(draw_floor_plan(far, beats=uneven, every=1.0), "count")
    there = next(line for line in late if line.title == "counts 3").points[0]
    (path,) = lines(even, "path of the pelvis")
    at = np.searchsorted(far.times - far.times[0], 1.2 - 1e-6)
    np.testing.assert_allclose(there, path.points[at], atol=1e-6)
    with pytest.raises(MotionMindError, match="tempo and beats both set the counts"):
        draw_floor_plan(WALK, tempo=60.0, beats=uneven)


def test_a_body_that_stays_has_one_arrow() -> None:
    still = WALK.slice(0, 2)
    still = replace(still, rotations=still.rotations[[0, 0]], root=still.root[[0, 0]], times=np.array([0.0, 8.0]))
    assert [line.title for line in lines(draw_floor_plan(still, tempo=60.0), "count")] == ["counts 1-9"] * 2


@pytest.mark.parametrize("seed", range(8))
def test_a_path_that_is_moved_as_proposed_stays_on_the_stage(seed: int) -> None:
    rng = np.random.default_rng(seed)
    size = rng.uniform(1.0, 4.0, 2)
    far = moved(WALK, *rng.uniform(-6.0, 6.0, 2))
    stage = float(size[0]), float(size[1])
    beyond = find_overstep(far, stage)
    fits = bool((np.ptp(far.root[:, [0, 2]], axis=0) <= size).all())
    if beyond is None:
        assert (np.abs(far.root[:, [0, 2]]) <= 0.5 * size).all()
        return
    assert (beyond.shift is not None) == fits
    assert beyond.metres == pytest.approx(float((np.abs(far.root[:, [0, 2]]) - 0.5 * size).max()))
    if beyond.shift is not None:
        rest = find_overstep(moved(far, *beyond.shift), stage)
        assert rest is None or rest.metres < 1e-9


@pytest.mark.parametrize(
    ("x", "z", "side"), [(9.0, 0.0, "left"), (-9.0, 0.0, "right"), (0.0, 9.0, "downstage"), (0.0, -9.0, "upstage")]
)
def test_sides_are_those_of_the_performer(x: float, z: float, side: str) -> None:
    beyond = find_overstep(moved(WALK.slice(0, 1), x, z), (4.0, 4.0))
    assert beyond is not None
    assert beyond.side == side


def test_stances_do_not_depend_on_a_floor_that_tilts() -> None:
    _, level = find_foot_stances(WALK)
    sinking = np.zeros_like(WALK.root)
    sinking[:, 1] = np.linspace(0.0, -0.2, len(WALK))  # as where a body crosses a floor that falls by 20 cm
    _, found = find_foot_stances(replace(WALK, root=WALK.root + sinking))
    for own, other in zip(level, found, strict=True):
        frames = [np.concatenate([np.arange(*stance) for stance in one.stances]) for one in (own, other)]
        assert len(np.intersect1d(*frames)) >= 0.9 * len(frames[0])


@pytest.mark.parametrize(
    ("given", "words_of_error"),
    [
        ({"stage": (0.5, 6.0)}, "from 1 to 200 m"),
        ({"stage": (8.0, 6.0, 2.0)}, "width and depth"),
        ({"stage": (8.0, float("nan"))}, "width and depth"),
        ({"tempo": 0.0}, "from 1 to 6000"),
        ({"tempo": float("nan")}, "from 1 to 6000"),
        ({"every": -1.0}, "above 0"),
        ({"every": float("inf")}, "above 0"),
    ],
)
def test_what_makes_no_plan_is_refused(given: dict[str, object], words_of_error: str) -> None:
    with pytest.raises(MotionMindError, match=words_of_error):
        draw_floor_plan(WALK, **given)  # type: ignore[arg-type]


def test_plans_are_written_as_svg_and_png() -> None:
    plate = draw_floor_plan(WALK, stage=(4.0, 3.0))
    assert plate.encode(".svg").startswith(b"<svg")
    assert plate.encode(".png").startswith(b"\x89PNG")
    assert len(lines(plate, "stage, 4 x 3 m")) == 1
