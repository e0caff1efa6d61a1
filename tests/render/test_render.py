"""Laws of the pictures: what is where, what hides what, and that all of it is there."""

from __future__ import annotations

import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bodies import ant
from bundled_clips import ballet_clip
from command_line import Run
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image, ImageDraw

from motionmind._typing import Bools, Floats, Pixels
from motionmind.body.human import human23
from motionmind.body.mirror import LEFT, MIDDLE, RIGHT, sides_of
from motionmind.body.motion import Insertion, Motion, Posture
from motionmind.body.skeleton import Skeleton
from motionmind.errors import MotionMindError
from motionmind.files import write_atomically
from motionmind.formats import read_motion, read_posture, write_motion
from motionmind.geometry import rotations as rot
from motionmind.render import sheet as sheets
from motionmind.render.body_shape import shape_of
from motionmind.render.body_solids import BodyShape
from motionmind.render.camera import SAMPLES_PER_PX
from motionmind.render.depth_buffer import DepthBuffer
from motionmind.render.figure import bridge_balls, colour, draw, given_colours, halved, inserted_colours
from motionmind.render.palette import COLOURS, FACE, INK, INSERTED, SHEET
from motionmind.render.sheet import MAX_SHEET_POSTURES, draw_sheet
from motionmind.render.solids import EMPTY_CODE, Cones, Ellipsoids
from motionmind.render.view import ABOVE, FRONT, STAGE_LEFT, STAGE_RIGHT, View, to_view

BALLET = Path(__file__).parents[2] / "corpora" / "ballet"
SCALE = 100.0  # pixels a metre
HALF = 1.5  # metres from the middle of a test's buffer to its edges
VIEWS = [FRONT, STAGE_RIGHT, STAGE_LEFT, ABOVE]
NAMES = human23().names
seeds = st.integers(0, 2**32 - 1)


def standing(**turns: Floats) -> Posture:
    """human23 at rest, its pelvis in the origin, but for some joints' rotation vectors [3], radians."""
    rotations = np.tile(rot.IDENTITY, (len(NAMES), 1))
    for joint, turn in turns.items():
        rotations[NAMES.index(joint)] = rot.exp(np.array(turn, dtype=np.float64))
    return Posture(human23(), rotations, np.zeros(3))


def random_posture(seed: int, skeleton: Skeleton | None = None, most: float = np.pi) -> Posture:
    """Joints turned anywhere, up to `most` radians."""
    rng = np.random.default_rng(seed)
    skeleton = skeleton or human23()
    axes = rng.normal(size=(len(skeleton), 3))
    axes /= np.linalg.norm(axes, axis=-1, keepdims=True)
    return Posture(skeleton, rot.exp(axes * rng.uniform(0.0, most, (len(skeleton), 1))), rng.uniform(-1.0, 1.0, 3))


def mirrored(posture: Posture) -> Posture:
    """The posture of human23 in a mirror that exchanges left and right."""
    swap = {"left": "right", "right": "left"}
    other = [NAMES.index(re.sub("^(left|right)", lambda side: swap[side[0]], name)) for name in NAMES]
    return Posture(posture.skeleton, rot.mirror(posture.rotations[other]), posture.root * [-1.0, 1.0, 1.0])


def drawn(posture: Posture, view: View, origin: Floats | None = None) -> tuple[BodyShape, DepthBuffer]:
    """A body on a buffer of 3 m by 3 m about the origin, which is the root's place by default."""
    body = shape_of(posture.skeleton)
    buffer = DepthBuffer(-HALF, HALF, int(2 * HALF * SCALE), int(2 * HALF * SCALE), SCALE)
    solids = body.solids(posture.rotations, posture.root)
    draw(buffer, *to_view(*solids, view, posture.root if origin is None else origin))
    return body, buffer


def shown(body: BodyShape, buffer: DepthBuffer, *, part: str = "", paint: str = "") -> Bools:
    """Which pixels [H, W] show a part, or a paint."""
    wanted = [part in {"", p} and paint in {"", c} for p, c in zip(body.parts, body.paints, strict=True)]
    return np.array([*wanted, False])[buffer.solid]


def centre(pixels: Bools) -> Floats:
    """The middle (x, y) of pixels [H, W], metres from the canvas's middle."""
    rows, columns = np.nonzero(pixels)
    return np.array([(columns.mean() + 0.5) / SCALE - HALF, HALF - (rows.mean() + 0.5) / SCALE])


def place(posture: Posture, joint: str, view: View) -> Floats:
    """Where a joint is in a picture about the root (x, y, and z towards the viewer), metres."""
    joints = posture.skeleton.positions(posture.rotations, np.zeros(3))
    return view.axes @ joints[posture.skeleton.index(joint)]


def clip(postures: int = 6, skeleton: Skeleton | None = None) -> Motion:
    """Postures of nobody's, ten a second."""
    rows = [random_posture(seed, skeleton, 0.6) for seed in range(postures)]
    rotations, root = np.stack([row.rotations for row in rows]), np.stack([row.root for row in rows])
    root[:, 1] = 1.0
    return Motion(rows[0].skeleton, rotations, root, np.arange(postures) / 10.0, name="clip")


def moved(motion: Motion, *by: float) -> Motion:
    """The motion elsewhere, metres."""
    return replace(motion, root=np.add(motion.root, by))


def cone(buffer: DepthBuffer, number: int, a: Floats, b: Floats, a_radius: float, b_radius: float) -> None:
    """Draw one round cone."""
    one = Cones(a[None], b[None], np.array([a_radius]), np.array([b_radius]))
    buffer.draw(one, Ellipsoids(np.empty((0, 3)), np.empty((0, 3, 3))), np.array([number], dtype=np.int16))


def ellipsoid(buffer: DepthBuffer, number: int, centre: Floats, axes: Floats) -> None:
    """Draw one ellipsoid."""
    none = Cones(*np.empty((2, 0, 3)), *np.empty((2, 0)))
    buffer.draw(none, Ellipsoids(centre[None], axes[None]), np.array([number], dtype=np.int16))


# --- solids ---------------------------------------------------------------------------------------------------------


@given(seeds)
@settings(max_examples=30)
def test_a_cone_is_the_union_of_its_balls(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = rng.uniform(-0.8, 0.8, (2, 3)) * rng.choice([1.0, 0.1], (2, 3))
    radii = rng.uniform(0.02, 0.4, 2)
    buffer = DepthBuffer(-1.5, 1.5, 60, 60, 20.0)
    cone(buffer, 7, a, b, *radii)
    balls = DepthBuffer(-1.5, 1.5, 60, 60, 20.0)
    for t in np.linspace(0.0, 1.0, 250):
        radius = radii[0] + t * (radii[1] - radii[0])
        ellipsoid(balls, 7, a + t * (b - a), radius * np.eye(3))
    if np.linalg.norm((b - a)[:2]) > abs(radii[1] - radii[0]):  # else it is drawn as the two balls at its ends
        assert (buffer.solid != balls.solid).mean() < 0.003  # pixels at the very rim
        both = (buffer.solid == 7) & (balls.solid == 7)
        assert np.abs(buffer.depth[both] - balls.depth[both]).max() < 0.02
        assert np.abs(buffer.depth[both] - balls.depth[both]).mean() < 1e-3
    else:
        assert not ((buffer.solid == 7) & (balls.solid == EMPTY_CODE)).any()


@given(seeds)
@settings(max_examples=30)
def test_an_ellipsoid_contains_its_axes_ends_and_no_more(seed: int) -> None:
    rng = np.random.default_rng(seed)
    radii = rng.uniform(0.1, 0.5, 3)
    axes = rot.to_matrix(rot.normalise(rng.normal(size=4))) * radii
    buffer = DepthBuffer(-1.0, 1.0, 200, 200, 100.0)
    ellipsoid(buffer, 0, np.zeros(3), axes)
    rows, columns = np.nonzero(buffer.solid == 0)
    x, y, z = (columns + 0.5) / 100 - 1.0, 1.0 - (rows + 0.5) / 100, buffer.depth[rows, columns]
    on = np.linalg.norm(np.linalg.inv(axes) @ np.stack([x, y, z]), axis=0)
    assert np.abs(on - 1.0).max() < 1e-4
    # Its shadow is an ellipse, whose area is known.
    shadow = axes[:2] @ axes[:2].T
    assert len(rows) / 1e4 == pytest.approx(np.pi * np.sqrt(np.linalg.det(shadow)), rel=0.05)


def test_solids_drawn_together_hide_one_another_as_if_drawn_one_by_one() -> None:
    posture = random_posture(4)
    _, together = drawn(posture, FRONT)
    cones, balls = to_view(*shape_of(human23()).solids(posture.rotations, posture.root), FRONT, posture.root)
    alone = DepthBuffer(-HALF, HALF, int(2 * HALF * SCALE), int(2 * HALF * SCALE), SCALE)
    for number in range(len(cones.a) + len(balls.centre)):
        draw(alone, cones, balls, frozenset([number]))
    assert np.array_equal(together.depth, alone.depth)
    assert np.isclose(together.shade, alone.shade, atol=0.01).mean() > 0.999  # two that touch are as near
    alone.clear()
    assert (alone.solid == EMPTY_CODE).all()


def test_a_canvas_shows_its_part_of_what_a_larger_one_shows() -> None:
    posture = random_posture(9)
    _, whole = drawn(posture, FRONT)
    solids = to_view(*shape_of(human23()).solids(posture.rotations, posture.root), FRONT, posture.root)
    rows, columns = slice(135, 165), slice(130, 170)  # the trunk and what is about it, cut on all sides
    part = DepthBuffer(columns.start / SCALE - HALF, HALF - rows.start / SCALE, 40, 30, SCALE)
    draw(part, *solids)
    assert all((whole.solid[rows, columns][edge] != EMPTY_CODE).any() for edge in np.s_[0, -1, (..., 0), (..., -1)])
    assert (part.solid != whole.solid[rows, columns]).mean() < 0.002
    same = part.solid == whole.solid[rows, columns]
    assert np.allclose(part.depth[same], whole.depth[rows, columns][same], atol=1e-4)


def test_what_goes_through_something_is_seen_on_both_sides_of_it() -> None:
    buffer = DepthBuffer(-1.0, 1.0, 100, 100, 50.0)
    cone(buffer, 0, np.array([-0.8, 0.0, 0.0]), np.array([0.8, 0.0, 0.0]), 0.1, 0.1)
    cone(buffer, 1, np.array([-0.8, 0.0, -0.5]), np.array([0.8, 0.0, 0.5]), 0.1, 0.1)
    middle_row = buffer.solid[50]
    assert (middle_row[20:45] == 0).all()
    assert (middle_row[55:80] == 1).all()


@pytest.mark.parametrize("view", VIEWS, ids=lambda view: view.name)
def test_views_are_right_handed_rotations(view: View) -> None:
    assert np.allclose(view.axes @ view.axes.T, np.eye(3))
    assert np.linalg.det(view.axes) == pytest.approx(1.0)


# --- bodies ---------------------------------------------------------------------------------------------------------


def test_a_part_pulls_the_centre_of_mass_by_its_share_of_the_mass() -> None:
    posture = standing()
    body = shape_of(human23())
    cones, balls = body.solids(posture.rotations, posture.root)
    before = body.centre_of_mass(cones, balls)
    for part, share in {"head": 0.0694, "trunk": 0.4346, "left_thigh": 0.1416, "right_foot": 0.0137}.items():
        mine = np.array([p == part for p in body.parts], dtype=float)[:, None] * [0.0, 0.0, 1.0]  # a metre ahead
        ahead = np.split(mine, [len(body.cones)])
        moved_on = (
            replace(cones, a=cones.a + ahead[0], b=cones.b + ahead[0]),
            replace(balls, centre=balls.centre + ahead[1]),
        )
        assert np.allclose(body.centre_of_mass(*moved_on) - before, [0.0, 0.0, share])
    assert sum(body.masses.values()) == pytest.approx(1.0)


def test_the_centre_of_mass_of_a_standing_body_is_over_its_feet_at_the_height_of_its_hips() -> None:
    posture = standing()
    body = shape_of(human23())
    x, y, z = body.centre_of_mass(*body.solids(posture.rotations, posture.root))
    feet = human23().positions_and_tips(posture.rotations, posture.root)
    floor = feet[:, 1].min()
    assert x == pytest.approx(0.0, abs=1e-9)
    assert 0.53 < (y - floor) / human23().height < 0.62  # 55 to 57 % in people
    assert feet[NAMES.index("left_ankle"), 2] - 0.04 < z < feet[NAMES.index("left_toes"), 2]


def test_sizes_grow_with_the_body() -> None:
    small = replace(human23(), name="child", offsets=human23().offsets / 2.0, tips=human23().tips / 2.0)
    rotations = random_posture(3).rotations
    for whole, half in zip(
        shape_of(human23()).solids(rotations, np.zeros(3)), shape_of(small).solids(rotations, np.zeros(3)), strict=True
    ):
        assert np.allclose(whole.bounds(), 2.0 * half.bounds())


def test_the_soles_stand_on_the_floor() -> None:
    posture = standing()
    floor = human23().positions_and_tips(posture.rotations, posture.root)[:, 1].min()
    cones, balls = shape_of(human23()).solids(posture.rotations, posture.root)
    assert min(cones.bounds()[0, :, 1].min(), balls.bounds()[0, :, 1].min()) == pytest.approx(floor, abs=0.004)


def test_sides_are_told_by_the_words_of_the_names() -> None:
    names = ("Hips", "LeftUpLeg", "RightUpLeg", "l_hand", "lShldr", "rThigh", "left_mid_leg", "belly", "thumb", "clef")
    skeleton = Skeleton("some", names, (-1, 0, 0, 0, 0, 0, 0, 0, 3, 0), np.zeros((10, 3)))
    expected = [MIDDLE, LEFT, RIGHT, LEFT, LEFT, RIGHT, LEFT, MIDDLE, LEFT, MIDDLE]
    assert sides_of(skeleton) == expected


def with_joints_between(skeleton: Skeleton) -> Skeleton:
    """human23 with a joint in the middle of each shank and forearm, and single fingers."""
    names, parents = list(skeleton.names), [-1, *(skeleton.names[p] for p in skeleton.parents[1:])]
    offsets, tips = [*skeleton.offsets.copy()], [*skeleton.tips]
    for joint in ("left_ankle", "right_ankle", "left_wrist", "right_wrist"):
        at = names.index(joint)
        names.insert(at, f"{joint}_roll")
        parents.insert(at, parents[at])
        parents[at + 1] = f"{joint}_roll"
        offsets[at] = offsets[at] / 2.0
        offsets.insert(at, offsets[at])
        tips.insert(at, np.zeros(3))
    for side, out in (("left", 1.0), ("right", -1.0)):
        for finger in ("little", "index"):
            names.append(f"{side}_{finger}")
            parents.append(f"{side}_wrist")
            offsets.append(np.array([0.1 * out, 0.0, 0.0]))
            tips.append(np.array([0.05 * out, 0.0, 0.0]))
    indices = tuple(-1 if p == -1 else names.index(p) for p in parents)
    return Skeleton("more", tuple(names), indices, np.array(offsets), np.array(tips))


def test_a_body_with_more_joints_than_human23_looks_the_same() -> None:
    more = with_joints_between(human23())
    rotations = np.tile(rot.IDENTITY, (len(more), 1))
    for view in VIEWS:
        _, one = drawn(standing(), view)
        body, other = drawn(Posture(more, rotations, np.zeros(3)), view)
        assert ((one.solid == EMPTY_CODE) != (other.solid == EMPTY_CODE)).mean() < 1e-3
    assert {"left_little", "right_index"} <= set(body.parts)


def test_names_of_a_person_on_another_tree_make_no_person() -> None:
    person = human23()
    parents = (-1, *([0] * (len(person) - 1)))
    body = shape_of(replace(person, parents=parents))
    assert FACE not in body.paints
    assert len(body.parts) >= len(person) - 1


def test_a_body_without_any_extent_can_be_drawn() -> None:
    for names in (("point",), NAMES):
        skeleton = Skeleton("none", names, human23().parents[: len(names)], np.zeros((len(names), 3)))
        rotations = np.tile(rot.IDENTITY, (1, len(names), 1))
        assert draw_sheet(Motion(skeleton, rotations, np.zeros((1, 3)), np.zeros(1))).width > 1


# --- one posture ----------------------------------------------------------------------------------------------------


def test_the_performers_left_is_on_the_audiences_right() -> None:
    body, buffer = drawn(standing(), FRONT)
    assert centre(shown(body, buffer, paint=LEFT))[0] > 0.1
    assert centre(shown(body, buffer, paint=RIGHT))[0] < -0.1
    picture = colour(buffer, body, np.full((*buffer.solid.shape, 3), 255, dtype=np.uint8)).astype(int)
    warm = picture[..., 0] - picture[..., 2]
    assert np.median(warm[shown(body, buffer, paint=LEFT)]) > 80
    assert np.median(warm[shown(body, buffer, paint=RIGHT)]) < -80


@pytest.mark.parametrize(("view", "front"), [(STAGE_RIGHT, 1.0), (STAGE_LEFT, -1.0)], ids=["right", "left"])
def test_from_the_side_the_face_and_the_toes_look_to_the_audience(view: View, front: float) -> None:
    body, buffer = drawn(standing(), view)
    head = centre(shown(body, buffer, part="head"))
    assert front * (centre(shown(body, buffer, paint=FACE))[0] - head[0]) > 0.02
    near = RIGHT if view is STAGE_RIGHT else LEFT
    assert front * centre(shown(body, buffer, part=f"{near}_foot"))[0] > 0.02
    assert not shown(body, buffer, part=f"{LEFT if near == RIGHT else RIGHT}_thigh").any()


def test_the_face_is_seen_only_by_those_whom_it_looks_at() -> None:
    ahead = shown(*drawn(standing(), FRONT), paint=FACE).sum()
    behind = shown(*drawn(standing(pelvis=[0.0, np.pi, 0.0]), FRONT), paint=FACE).sum()
    assert ahead > 100
    assert behind < 0.1 * ahead


@given(st.floats(0.0, 2.2), st.floats(-np.pi, np.pi), st.floats(0.0, 1.2))
@settings(max_examples=60)
def test_the_kneecap_is_on_the_side_to_which_the_knee_points(flexion: float, turn: float, lift: float) -> None:
    lifted = rot.mul(rot.about_vertical(turn), rot.exp(np.array([-lift, 0.0, 0.0])))
    posture = standing(left_hip=rot.log(lifted), left_knee=np.array([flexion, 0.0, 0.0]))
    ahead = rot.mul_vec(rot.mul(lifted, rot.exp(np.array([flexion / 2.0, 0.0, 0.0]))), np.array([0.0, 0.0, 1.0]))
    cones, _ = shape_of(human23()).solids(posture.rotations, posture.root)
    knee = human23().positions(posture.rotations, posture.root)[NAMES.index("left_knee")]
    beak = cones.b[shape_of(human23()).parts.index("left_kneecap")] - knee
    assert np.allclose(beak / np.linalg.norm(beak), ahead)
    for view in (FRONT, STAGE_RIGHT):
        points = view.axes @ ahead
        body, buffer = drawn(posture, view)
        cap, limb = shown(body, buffer, part="left_kneecap"), shown(body, buffer, part="left_thigh")
        if abs(points[0]) > 0.4 and cap.any() and limb.any():
            offset = centre(cap) - place(posture, "left_knee", view)[:2]
            assert points[0] * offset[0] > 0.0
        if points[2] < -0.8:
            assert cap.sum() < 10
        if view is FRONT and points[2] > 0.8 and abs(lift) < 0.5:  # nothing of the body's is before it
            assert cap.sum() > 20


@pytest.mark.parametrize("front", ["left", "right"])
def test_the_nearer_leg_covers_the_farther(front: str) -> None:
    """The shanks cross at the middle, and the one in front swings forward too."""
    swing = {"left": -0.13, "right": 0.13}
    posture = standing(
        **{
            f"{side}_hip": rot.log(rot.mul(rot.exp(np.array([ahead, 0.0, 0.0])), rot.exp(np.array([0.0, 0.0, z]))))
            for (side, z), ahead in zip(swing.items(), (-0.25, 0.25) if front == "left" else (0.25, -0.25), strict=True)
        }
    )
    body, buffer = drawn(posture, FRONT)
    both = np.ones(buffer.solid.shape, dtype=bool)
    for side in swing:
        alone = DepthBuffer(-HALF, HALF, 300, 300, SCALE)
        only = frozenset(i for i, part in enumerate(body.parts) if part == f"{side}_shank")
        draw(alone, *to_view(*body.solids(posture.rotations, posture.root), FRONT, posture.root), only)
        both &= alone.solid != EMPTY_CODE
    assert both.sum() > 100
    other = "right" if front == "left" else "left"
    assert not shown(body, buffer, part=f"{other}_shank")[both].any()


@given(seeds)
@settings(max_examples=30)
def test_each_pixel_shows_the_nearest_solid(seed: int) -> None:
    posture = random_posture(seed)
    body, buffer = drawn(posture, FRONT)
    solids = to_view(*body.solids(posture.rotations, posture.root), FRONT, posture.root)
    for solid in np.random.default_rng(seed).choice(len(body.parts), 5):
        alone = DepthBuffer(-HALF, HALF, 300, 300, SCALE)
        draw(alone, *solids, frozenset({int(solid)}))
        assert (buffer.depth >= alone.depth).all()
        mine = buffer.solid == solid
        assert np.allclose(
            buffer.depth[mine], alone.depth[mine], rtol=0.0, atol=0.002 / SCALE
        )  # but for who touches it


@pytest.mark.long
@given(seeds)
@settings(max_examples=30)
def test_a_mirrored_posture_gives_the_mirrored_picture_with_the_colours_exchanged(seed: int) -> None:
    posture = random_posture(seed)
    body, buffer = drawn(posture, FRONT)
    _, other = drawn(mirrored(posture), FRONT)
    swap = {LEFT: RIGHT, RIGHT: LEFT}
    differ = np.zeros(buffer.solid.shape, dtype=bool)
    for paint in set(body.paints):
        here, there = shown(body, buffer, paint=paint), shown(body, other, paint=swap.get(paint, paint))
        differ |= here != there[:, ::-1]
    assert differ.mean() < 2e-4  # pixels whose middle is on an edge to the last digit
    assert np.abs(buffer.shade - other.shade[:, ::-1])[~differ].max() < 0.02


@pytest.mark.parametrize("view", [FRONT, STAGE_RIGHT], ids=["front", "side"])
def test_a_limb_before_another_has_a_line_round_it_and_one_that_goes_on_has_none(view: View) -> None:
    crossed = standing(left_shoulder=[0.0, -1.9, 0.0], left_elbow=[0.0, -0.4, 0.0])
    body, buffer = drawn(crossed, FRONT)
    picture = colour(buffer, body, np.full((*buffer.solid.shape, 3), 255, dtype=np.uint8))
    ink = (picture == INK).all(axis=-1)
    arm = shown(body, buffer, part="left_forearm") | shown(body, buffer, part="left_hand")
    beside = np.zeros_like(arm)
    beside[1:] |= arm[:-1]
    beside &= shown(body, buffer, part="trunk")
    assert beside.sum() > 10
    assert ink[beside].mean() > 0.9

    body, buffer = drawn(standing(), view)
    picture = colour(buffer, body, np.full((*buffer.solid.shape, 3), 255, dtype=np.uint8))
    ink = (picture == INK).all(axis=-1)
    x, y, _ = place(standing(), "right_knee", view)
    row, column = int((HALF - y) * SCALE), int((x + HALF) * SCALE)
    assert not ink[row + 8 : row + 14, column - 1 : column + 2].any()  # thigh and shank are one leg


def lines(buffer: DepthBuffer, parts: Floats, step: float, width: int) -> Bools:
    """Pixels with one of another part that is nearer by a step within `width` above, below or beside them."""
    part = np.where(buffer.solid == EMPTY_CODE, -1, parts[buffer.solid])
    here, found = np.s_[width:-width, width:-width], np.zeros(part.shape, dtype=bool)
    for by in range(1, width + 1):
        for shift, axis in ((by, 0), (-by, 0), (by, 1), (-by, 1)):
            other, depth = (np.roll(array, shift, axis) for array in (part, buffer.depth))
            found[here] |= ((part != other) & (depth > buffer.depth + step))[here]
    return found


@pytest.mark.parametrize("width", [1, 2, 5])
def test_lines_are_where_a_nearer_part_is_near(width: int) -> None:
    body, buffer = drawn(random_posture(12), STAGE_RIGHT)
    parts = np.unique(body.parts, return_inverse=True)[1].astype(float)
    picture = colour(buffer, body, np.full((*buffer.solid.shape, 3), 255, dtype=np.uint8), width)
    assert np.array_equal((picture == INK).all(axis=-1), lines(buffer, parts, 0.016 * body.size, width))


def test_what_is_farther_is_paler() -> None:
    posture, aside = standing(), np.array([0.8, 0.0, 0.0])
    _, behind = drawn(posture, STAGE_LEFT, aside)  # the middle of the view is between the viewer and the body
    body, before = drawn(posture, STAGE_LEFT, -aside)
    white = np.full((*before.solid.shape, 3), 255, dtype=np.uint8)
    thigh = shown(body, before, part="left_thigh")
    assert np.array_equal(thigh, shown(body, behind, part="left_thigh"))
    near, pale = colour(before, body, white), colour(behind, body, white)
    assert pale[thigh].mean() > near[thigh].mean() + 20


# --- sheets ---------------------------------------------------------------------------------------------------------


@pytest.fixture
def words(monkeypatch: pytest.MonkeyPatch) -> list[tuple[float, float, str]]:
    """What is written on pictures, with its place."""
    said: list[tuple[float, float, str]] = []
    write = ImageDraw.ImageDraw.text

    def text(self: ImageDraw.ImageDraw, xy: tuple[float, float], text: str, *rest: object, **options: object) -> None:
        said.append((*xy, text))
        write(self, xy, text, *rest, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(ImageDraw.ImageDraw, "text", text)
    return said


@pytest.mark.parametrize("columns", [1, 3, 4, 99])
def test_a_sheet_has_one_numbered_cell_a_posture(columns: int, words: list[tuple[float, float, str]]) -> None:
    frames = [0, 2, 3, 5, 7, 8, 9]
    picture = draw_sheet(clip(10), frames, columns=columns)
    numbers = [(y, x, text) for x, y, text in words if text.isdigit()]
    assert [text for _, _, text in numbers] == [str(frame) for frame in frames]
    assert numbers == sorted(numbers)  # row by row, from left to right
    assert len({y for y, _, _ in numbers}) == -(-len(frames) // min(columns, len(frames)))
    assert len({x for _, x, _ in numbers}) == min(columns, len(frames))
    assert [text for _, _, text in words if text.endswith(" s")] == [f"{frame / 10:.2f} s" for frame in frames]
    cell = picture.width // min(columns, len(frames))
    for y, x, _ in numbers:
        body = np.asarray(picture.crop((x // cell * cell + 1, y - 200, x // cell * cell + cell - 1, y - 10)))
        assert (np.ptp(body, axis=-1) > 60).sum() > 300  # there are limbs in it


@given(seeds, st.sampled_from(["human", "insect"]))
@settings(max_examples=40)
def test_nothing_is_cut_off(seed: int, kind: str) -> None:
    rows = [random_posture(seed + i, ant() if kind == "insect" else None) for i in range(3)]
    motion = Motion(
        rows[0].skeleton,
        np.stack([row.rotations for row in rows]),
        np.stack([row.root for row in rows]) * (0.01 if kind == "insect" else 1.0),
        np.arange(3.0),
    )
    sheet = sheets._Sheet(motion, [0, 1, 2], STAGE_RIGHT)
    for at in range(3):
        for window in sheet.windows:
            buffer = window.buffer()
            draw(buffer, *sheet._solids(at, window.view))
            edge = np.concatenate([buffer.solid[0], buffer.solid[-1], buffer.solid[:, 0], buffer.solid[:, -1]])
            assert (edge == EMPTY_CODE).all()
            assert (buffer.solid != EMPTY_CODE).sum() > 200


def test_one_floor_and_one_scale_for_the_whole_sheet() -> None:
    low, high = (read_posture(BALLET / "postures" / f"{name}.json") for name in ("grand-plie", "releve"))
    rotations, root = np.stack([low.rotations, high.rotations]), np.stack([low.root, high.root])
    sheet = sheets._Sheet(Motion(low.skeleton, rotations, root, np.arange(2.0)), [0, 1], STAGE_RIGHT)
    for window in sheet.windows:
        pictures = [np.asarray(sheet._view(at, window)).astype(int) for at in (0, 1)]
        tops = []
        for pixels in pictures:
            floor = round(window.to_samples(0.0, 0.0)[1]) // SAMPLES_PER_PX
            assert (pixels[floor, [0, -1]] == SHEET.floor).all()
            assert (pixels[floor - 1, [0, -1]] == SHEET.paper).all()
            assert (np.ptp(pixels[floor - 5 : floor], axis=-1) > 60).any()  # feet on it
            tops.append(np.flatnonzero((pixels < 128).any(axis=(1, 2)))[0])
        assert tops[0] > tops[1] + 20  # who stands on the toes is taller than who bends


def test_the_camera_follows_the_body_across_the_stage_and_not_up() -> None:
    posture = read_posture(BALLET / "postures" / "fifth.json")
    motion = posture.as_motion()
    still = draw_sheet(motion)
    far = draw_sheet(moved(motion, 3.0, 0.0, -2.0))
    assert np.abs(np.asarray(still).astype(int) - np.asarray(far)).max() < 60
    assert np.mean(np.asarray(still) != np.asarray(far)) < 0.01
    leapt = draw_sheet(moved(motion, 0.0, 0.5, 0.0))
    assert leapt.height > still.height  # there is air under the feet, and no feet from above below it


def test_what_is_under_the_floor_is_marked() -> None:
    motion = read_posture(BALLET / "postures" / "fifth.json").as_motion()

    def marked(sinks: float) -> int:
        sheet = sheets._Sheet(moved(motion, 0.0, -sinks, 0.0), [0], STAGE_RIGHT)
        pixels = np.asarray(sheet._view(0, sheet.windows[0])).astype(int)
        return int((np.abs(pixels - SHEET.sunk).max(axis=-1) < 30).sum())

    assert marked(0.0) == 0
    assert marked(0.05) > 50
    assert marked(0.2) > marked(0.05)


def test_turned_out_feet_are_wider_from_above() -> None:
    def plan(**turns: Floats) -> Floats:
        posture = standing(**turns)
        body = shape_of(posture.skeleton)
        feet = DepthBuffer(-HALF, HALF, 300, 300, SCALE)
        only = frozenset(i for i, part in enumerate(body.parts) if part.endswith("_foot"))
        draw(feet, *to_view(*body.solids(posture.rotations, posture.root), ABOVE, posture.root), only)
        return np.ptp(np.argwhere(feet.solid != EMPTY_CODE), axis=0) / SCALE

    ahead = plan()
    out = plan(left_hip=np.array([0.0, 1.4, 0.0]), right_hip=np.array([0.0, -1.4, 0.0]))
    assert out[1] > ahead[1] + 0.2
    assert out[0] < ahead[0] - 0.05


def test_a_foot_in_the_air_is_not_on_the_floor() -> None:
    arabesque = read_posture(BALLET / "postures" / "arabesque.json").as_motion()
    sheet = sheets._Sheet(arabesque, [0], STAGE_RIGHT)
    assert {sheet.body.parts[solid] for solid in sheet.standing[0]} == {"left_foot"}
    leapt = sheets._Sheet(moved(arabesque, 0.0, 0.3, 0.0), [0], STAGE_RIGHT)
    assert leapt.standing == [frozenset()]
    assert leapt.plan is None


def test_an_insect_has_six_legs_in_two_colours() -> None:
    skeleton = ant()
    rotations = np.tile(rot.IDENTITY, (len(skeleton), 1))
    body = shape_of(skeleton)
    assert sum(paint == LEFT for paint in body.paints) == sum(paint == RIGHT for paint in body.paints) == 9
    picture = draw_sheet(Motion(skeleton, rotations[None], np.array([[0.0, 0.006, 0.0]]), np.zeros(1)))
    pixels = np.asarray(picture).astype(int)[70:]
    front = pixels[:, : pixels.shape[1] // 2]
    warm = front[..., 0] - front[..., 2]
    assert np.nonzero(warm > 60)[1].mean() > np.nonzero(warm < -60)[1].mean() + 20
    assert (np.abs(pixels - COLOURS[FACE]).max(axis=-1) < 5).sum() == 0


@pytest.mark.long
def test_a_sheet_has_bounds() -> None:
    many = clip(1, ant())
    times = np.arange(MAX_SHEET_POSTURES + 1.0)
    many = Motion(
        many.skeleton,
        many.rotations[np.zeros(MAX_SHEET_POSTURES + 1, dtype=int)],
        np.zeros((MAX_SHEET_POSTURES + 1, 3)),
        times,
        "long",
    )
    with pytest.raises(MotionMindError, match=r"^long: a sheet holds 400 postures, not 401; .* --every 2$"):
        draw_sheet(many)
    with pytest.raises(MotionMindError, match="no frame to draw"):
        draw_sheet(many, [])
    with pytest.raises(MotionMindError, match="frames 0 to 400, no frame 401"):
        draw_sheet(many, [401])
    full = draw_sheet(many, range(MAX_SHEET_POSTURES))
    assert full.width * full.height < 1.3 * sheets._MAX_PIXELS
    leaps = replace(clip(2), root=np.array([[0.0, 1.0, 0.0], [0.0, 1e6, 0.0]]))
    picture = draw_sheet(leaps)
    assert max(picture.size) < 2000


def test_half_a_picture_is_the_means_of_its_pixels() -> None:
    picture = np.random.default_rng(0).integers(0, 256, (48, 34, 3), dtype=np.uint8)
    assert np.array_equal(halved(picture), np.asarray(Image.fromarray(picture).reduce(2)))


# --- what the engine made -------------------------------------------------------------------------------------------


def tween(*bridged: tuple[str, int]) -> Motion:
    """Three postures, of which the engine made the second."""
    return replace(clip(3), insertions=(Insertion(np.array([0.0, 0.2]), bridged),))


@pytest.mark.parametrize("joint", NAMES)
def test_the_ball_of_a_bridged_joint_is_around_it_and_seen_from_somewhere(joint: str) -> None:
    posture = standing()
    body, which = shape_of(human23()), np.arange(len(NAMES)) == NAMES.index(joint)
    joints = human23().positions(posture.rotations, posture.root)
    cones, balls = body.solids(posture.rotations, posture.root)
    ball = bridge_balls(body, joints, which)
    assert np.allclose(ball.centre, joints[NAMES.index(joint)])
    assert bridge_balls(body, joints, ~which).centre.shape == (len(NAMES) - 1, 3)
    green = 0
    for view in VIEWS:
        buffer = DepthBuffer(-HALF, HALF, 300, 300, SCALE)
        draw(buffer, *to_view(cones, balls.joined(ball), view, posture.root))
        assert buffer.solid.max() <= len(body.parts)
        picture = colour(buffer, body, np.full((300, 300, 3), 255, dtype=np.uint8)).astype(int)
        ball_itself = picture[(buffer.solid == len(body.parts)) & (picture != INK).any(axis=-1)]
        assert (ball_itself[:, 1] > ball_itself[:, [0, 2]].max(axis=-1)).all()
        green += len(ball_itself)
    assert green > 60


def test_what_the_engine_made_has_other_colours_and_its_marks_keep_theirs() -> None:
    body, buffer = drawn(standing(), FRONT)
    white = np.full((*buffer.solid.shape, 3), 255, dtype=np.uint8)
    recorded, made = colour(buffer, body, white), colour(buffer, body, white, paints=inserted_colours(body))
    assert np.array_equal(colour(buffer, body, white, paints=given_colours(body)), recorded)
    for paint in COLOURS:
        there = shown(body, buffer, paint=paint) & (recorded != INK).any(axis=-1)
        assert (made[there] != recorded[there]).any() == (COLOURS[paint] != INSERTED[paint])
    left, right = (made[shown(body, buffer, paint=side)].astype(int) for side in (LEFT, RIGHT))
    assert np.median(left[:, 0] - left[:, 2]) > 20 > -20 > np.median(right[:, 0] - right[:, 2])


def test_a_sheet_tells_what_the_engine_made(words: list[tuple[float, float, str]]) -> None:
    def coloured(motion: Motion) -> Floats:
        """How many pixels of the three postures are violet, and how many green: [3, 2]."""
        sheet = sheets._Sheet(motion, [0, 1, 2], STAGE_RIGHT)
        pictures = [np.asarray(sheet._view(at, sheet.windows[0])).astype(int) for at in range(3)]
        channels = [np.moveaxis(picture, -1, 0) for picture in pictures]
        return np.array([[((r > g + 15) & (b > g + 50)).sum(), (g > b + 35).sum()] for r, g, b in channels])

    recorded, made, bridged = replace(tween(), insertions=()), tween(), tween(("left_hip", 0), ("right_wrist", 0))
    counts = coloured(made) - coloured(recorded)
    assert (counts[:, 0] > 300).tolist() == [False, True, False]
    assert (counts[:, 1] > 100).tolist() == [False, False, False]
    counts = coloured(bridged) - coloured(made)
    assert (counts[:, 1] > 100).tolist() == [False, True, False]
    for motion, legend in ((recorded, set()), (made, {"violet"}), (bridged, {"violet", "ball"})):
        words.clear()
        draw_sheet(motion)
        assert {text.split(":")[0] for _, _, text in words} & {"violet", "ball"} == legend


def test_the_balls_of_bridges_have_room() -> None:
    motion = tween(("right_fingers", 0), ("left_toes", 0), ("atlantal", 0))
    sheet = sheets._Sheet(motion, [1], STAGE_RIGHT)
    for window in sheet.windows:
        buffer, _ = sheet._backdrop(window)
        draw(buffer, *sheet._solids(0, window.view))
        assert (buffer.solid >= len(sheet.body.parts)).any()
        for edge in np.s_[0, -1, (..., 0), (..., -1)]:
            assert (buffer.solid[edge] == EMPTY_CODE).all()


# --- the command ----------------------------------------------------------------------------------------------------


def opened(path: str) -> Pixels:
    with Image.open(path) as picture:
        return np.asarray(picture)


@pytest.fixture(scope="module")
def clips(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of clips of the bundled corpus."""
    folder = tmp_path_factory.mktemp("clips")
    for name in ("plies", "jump"):
        write_motion(folder / f"{name}.json", ballet_clip(name))
    return folder


@pytest.fixture
def plies(clips: Path) -> Path:
    return clips / "plies.json"


@pytest.fixture
def jump(clips: Path) -> Path:
    """Seven postures."""
    return clips / "jump.json"


def test_the_command_draws_the_frames_that_are_asked_for(
    run: Run, plies: Path, words: list[tuple[float, float, str]]
) -> None:
    code, out, err = run("sheet", plies, "-o", "plies.png", "--from", 3, "--to", -40, "--every", 6, "--columns", 2)
    assert (code, err) == (0, "")
    with Image.open("plies.png") as picture:
        assert picture.format == "PNG"
    frames = list(range(3, len(read_motion(plies)) - 39, 6))
    drawn = f"{len(frames)} postures of {len(read_motion(plies))}"
    assert out == f"plies.png: {drawn}, {picture.width} x {picture.height} pixels\n"
    assert [text for _, _, text in words if text.isdigit()] == [str(frame) for frame in frames]


@pytest.mark.long
def test_the_file_has_the_colours_that_were_drawn(run: Run, jump: Path) -> None:
    assert run("sheet", jump, "-o", "jump.png")[0] == 0
    drawn = np.asarray(draw_sheet(read_motion(jump))).astype(int)
    with Image.open("jump.png") as picture:
        written = np.asarray(picture.convert("RGB")).astype(int)
    off = np.abs(written - drawn).max(axis=-1)
    grounds, counts = np.unique(drawn.reshape(-1, 3), axis=0, return_counts=True)
    for ground in grounds[np.argsort(counts)[-2:]]:  # the paper and the floor
        assert off[(drawn == ground).all(axis=-1)].max() <= 2
    assert np.quantile(off, 0.999) <= 16


@pytest.mark.parametrize(
    ("options", "frames"),
    [
        (("--postures", 4), [0, 2, 4, 6]),
        (("--postures", 3, "--from", 1), [1, 4, 6]),
        (("--postures", 1), [0]),
        (("--postures", 99), list(range(7))),
        (("--from", -2), [5, 6]),
        (("--every", 99), [0]),
    ],
)
def test_some_of_the_frames(
    options: tuple[object, ...], frames: list[int], run: Run, jump: Path, words: list[tuple[float, float, str]]
) -> None:
    assert run("sheet", jump, "-o", "sheet.png", *options)[0] == 0
    drawn = [int(text) for _, _, text in words if text.isdigit()]
    assert len(drawn) == len(frames)
    assert np.abs(np.subtract(drawn, frames)).max() <= 1  # a half may be rounded either way
    assert (drawn[0], drawn[-1]) == (frames[0], frames[-1])


def test_the_command_reads_every_format_and_one_posture(run: Run, jump: Path) -> None:
    motion = read_motion(jump)
    for name in ("jump.bvh", "jump.txt"):
        write_motion(name, motion.resample(5.0))
    for source in ("jump.bvh", "jump.txt", BALLET / "postures" / "fifth.json"):
        assert run("sheet", source, "-o", "sheet.png")[0] == 0
    sizes = {}
    for side in ("left", "right"):
        assert run("sheet", BALLET / "postures" / "arabesque.json", "-o", "sheet.png", "--side", side)[0] == 0
        sizes[side] = opened("sheet.png")
    assert sizes["left"].shape[1] == sizes["right"].shape[1]
    assert not np.array_equal(sizes["left"][-200:], sizes["right"][-200:])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("-o", "sheet.jpg"), r"sheet\.jpg: cannot be written: the name must end in one of \.png"),
        (("-o", "nowhere/sheet.png"), r"nowhere/sheet\.png: cannot be written: there is no folder"),
        ((), r"Missing option '-o' / '--output'"),
        (("-o", "sheet.png", "--every", 0), r"'--every': 0 is not in the range"),
        (("-o", "sheet.png", "--columns", 0), r"'--columns': 0 is not in the range"),
        (("-o", "sheet.png", "--from", 999), r"plies\.json: frames are 0 to \d+, there is no frame 999"),
        (("-o", "sheet.png", "--to", -999), r"plies\.json: frames are 0 to \d+, there is no frame -999"),
        (("-o", "sheet.png", "--from", 9, "--to", 8), r"plies\.json: the last frame, 8, lies before the first, 9"),
        (("-o", "sheet.png", "--every", 2, "--postures", 3), r"--every and --postures both choose the frames to draw"),
        (("-o", "sheet.png", "--postures", 0), r"'--postures': 0 is not in the range"),
        (("-o", "sheet.png", "--side", "top"), r"'--side': 'top' is not one of 'right', 'left'"),
    ],
)
def test_bad_input_is_one_line(
    options: tuple[object, ...], message: str, run: Run, plies: Path, tmp_path: Path
) -> None:
    code, out, err = run("sheet", plies, *options)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert err.startswith("error: ")
    assert re.search(message, err)
    assert not list(tmp_path.iterdir())


@pytest.mark.long
def test_a_long_clip_is_refused_before_it_is_drawn(run: Run, tmp_path: Path) -> None:
    write_motion("long.bvh", ballet_clip("plies").resample(100.0))
    code, _, err = run("sheet", "long.bvh", "-o", "sheet.png")
    assert code == 2
    assert re.search(r"error: long: a sheet holds 400 postures, not 3\d\d\d; take fewer, as with --every [89]\n$", err)
    assert [path.name for path in tmp_path.iterdir()] == ["long.bvh"]
    assert run("sheet", "long.bvh", "-o", "sheet.png", "--every", 100)[0] == 0


@pytest.mark.long
def test_a_score_is_drawn_clip_by_clip(run: Run, plies: Path) -> None:
    score = BALLET / "barre.score"
    code, out, err = run("sheet", score, "--clip", "plies", "-o", "one.png")
    assert (code, err) == (0, "")
    assert run("sheet", plies, "-o", "file.png")[0] == 0
    assert opened("one.png").shape == opened("file.png").shape  # and the file's numbers are rounded
    taken = ("--clip", "plies", "--clip", "tendus", "--clip", "plies")
    code, out, err = run("sheet", score, *taken, "-o", "new/sheets", "--postures", 3)
    assert (code, err) == (0, "")
    assert sorted(path.name for path in Path("new/sheets").iterdir()) == ["plies.png", "tendus.png"]
    first, second = out.splitlines()
    assert first.startswith(f"{Path('new/sheets/plies.png')}: 3 postures of ")
    assert second.startswith(f"{Path('new/sheets/tendus.png')}: 3 postures of ")


def test_a_score_of_one_clip_needs_no_name(run: Run) -> None:
    macarena = BALLET.parent / "macarena" / "macarena.score"
    assert run("sheet", macarena, "-o", "dance.png", "--postures", 2)[0] == 0
    assert opened("dance.png").size


@pytest.mark.parametrize("by", ["name", "folder"])
def test_a_corpus_is_drawn_clip_by_clip(by: str, run: Run, tmp_path: Path) -> None:
    corpus = "walk-hexapod" if by == "name" else BALLET.parent / "walk-hexapod"
    Path("sheets").mkdir()
    Path("sheets", "notes.txt").write_text("kept")
    assert run("sheet", corpus, "-o", "sheets", "--postures", 2)[0] == 0
    drawn = {path.name for path in (tmp_path / "sheets").iterdir()}
    assert drawn == {"tripod.png", "turn.png", "wave.png", "rest.png", "notes.txt"}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("balet", "-o", "sheets"), r"balet: there is no such file or corpus; did you mean ballet\?"),
        ((BALLET / "postures", "-o", "sheets"), r".*postures: is a folder, and no corpus"),
        (
            ("walk-hexapod", "-o", "x.png"),
            r"x\.png: walk-hexapod holds 4 clips, tripod, turn, wave, rest; choose one by --clip, or give a folder",
        ),
        (("walk-hexapod", "-o", "x.jpg"), r"x\.jpg: cannot be written: the name must end in one of \.png"),
        (
            ("walk-hexapod", "-o", "sheets", "--clip", "trippod"),
            r"walk-hexapod: no clip 'trippod'; did you mean tripod\?",
        ),
        (("walk-hexapod", "-o", "sheets", "--from", 9999), r"\w+: frames are 0 to \d+, there is no frame 9999"),
        ((BALLET / "vocabulary.score", "-o", "sheets"), r"vocabulary\.score: holds no clips"),
        ((BALLET / "nothing.score", "-o", "sheets"), r"nothing\.score: cannot be read: there is no such file"),
        (
            (BALLET / "postures" / "fifth.json", "-o", "x.png", "--clip", "plies"),
            r"--clip is only for a score, a corpus or a glTF file",
        ),
    ],
)
def test_bad_clips_are_one_line(arguments: tuple[object, ...], message: str, run: Run, tmp_path: Path) -> None:
    code, out, err = run("sheet", *arguments)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert re.match(f"error: .*{message}", err)
    assert not list(tmp_path.iterdir())


def test_of_sheets_that_cannot_all_be_written_none_is_left(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(path: Path, data: bytes) -> None:
        if path.name == "wave.png":
            raise MotionMindError(f"{path}: cannot be written: the disk is full")
        write_atomically(path, data)

    monkeypatch.setattr("motionmind.files.write_atomically", full)
    code, _, err = run("sheet", "walk-hexapod", "-o", "sheets", "--postures", 1)
    assert code == 2
    assert err == f"error: {Path('sheets/wave.png')}: cannot be written: the disk is full\n"
    assert not list((tmp_path / "sheets").glob("*"))


def test_other_commands_do_not_pay_for_pictures() -> None:
    code = "import sys, motionmind, motionmind.cli; sys.exit(any(name.startswith('PIL') for name in sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize("options", [{"columns": 0}, {"columns": -3}, {"side": "top"}])
def test_a_sheet_has_columns_and_two_sides(options: dict[str, object]) -> None:
    with pytest.raises(MotionMindError, match=r"side must be 'right' or 'left'|columns must be 1 or more"):
        draw_sheet(clip(2), **options)  # type: ignore[arg-type]


def test_a_body_far_under_or_over_the_floor_keeps_its_colours() -> None:
    for height in (-30.0, 30.0):
        pixels = np.asarray(draw_sheet(moved(standing().as_motion(), 0.0, height, 0.0))).astype(int)
        assert (np.abs(pixels - SHEET.sunk).max(axis=-1) < 30).sum() < 300  # but for the words that explain it
        assert (pixels[..., 0] - pixels[..., 2] > 60).sum() > 500
