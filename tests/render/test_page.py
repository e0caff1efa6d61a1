"""The page that plays a motion, opened from disk in a browser: what is seen, and what its buttons and keys do."""

from __future__ import annotations

import html
import re
from collections.abc import Callable
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bundled_clips import ballet_clip
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from pages import FINE, SCREENS, SIZE, Opened, near, reachable_controls, readable_words
from PIL import Image

from motionmind._typing import Bools, Floats, Indices
from motionmind.body.contact import find_feet
from motionmind.body.human import human23, human44
from motionmind.body.motion import Insertion, Motion
from motionmind.body.skeleton import Skeleton
from motionmind.credits.credit import Credit
from motionmind.errors import MotionMindError
from motionmind.geometry import rotations as rot
from motionmind.notation.compose import motions
from motionmind.notation.read import read_score
from motionmind.render.body_shape import shape_of
from motionmind.render.page import packed, page, write_page
from motionmind.render.palette import BRIDGED, COLOURS, INSERTED

CORPORA = Path(__file__).parents[2] / "corpora"
seeds = st.integers(0, 2**32 - 1)


def random_motion(skeleton: Skeleton, frames: int, seed: int = 0) -> Motion:
    """Joints turned anywhere, at uneven times."""
    rng = np.random.default_rng(seed)
    rotations = rot.normalise(rng.normal(size=(frames, len(skeleton), 4)))
    times = np.cumsum(rng.uniform(0.1, 0.3, frames))
    return Motion(skeleton, rotations, rng.uniform(-1.0, 1.0, (frames, 3)), times, "random")


def still(frames: int, insertions: tuple[Insertion, ...] = (), name: str = "still") -> Motion:
    """human23 at rest, standing on the floor for `frames` frames, ten a second."""
    rotations = np.tile(rot.IDENTITY, (frames, 23, 1))
    root = np.tile([0.0, 0.97, 0.0], (frames, 1))
    return Motion(human23(), rotations, root, np.arange(frames) / 10.0, name, insertions)


def hexapod() -> Motion:
    score = read_score(CORPORA / "walk-hexapod" / "insect.score")
    return motions(score, score.clips[:1])[0]


def bridged() -> Motion:
    """Standing: two frames, an insertion of four moves up to frame 8, in the third of which an elbow is bridged."""
    insertion = Insertion(np.array([0.1, 0.2, 0.4, 0.6, 0.8]), (("left_elbow", 2),))
    return still(12, (insertion,))


def middle(mask: Bools) -> Floats:
    """Mean x, y of what a mask holds."""
    return np.asarray(np.argwhere(mask)[:, ::-1].mean(axis=0))


# --- without a browser ------------------------------------------------------------------------------------------------


@given(arrays(np.float64, (5, 4), elements=st.floats(-1.0, 1.0)))
def test_packed_quaternions_are_the_same_rotations(numbers: Floats) -> None:
    rotations = rot.normalise(numbers + np.where(np.linalg.norm(numbers, axis=-1) < 0.1, 1.0, 0.0)[:, None])
    words = packed(rotations)
    largest = (words >> np.uint64(60)).astype(int)
    levels = np.stack([(words >> np.uint64(shift)) & np.uint64(0xFFFFF) for shift in (40, 20, 0)], axis=-1)
    others = (levels.astype(float) / (2**19 - 1) - 1.0) / np.sqrt(2.0)
    found = np.array(
        [np.insert(three, at, np.sqrt(1.0 - three @ three)) for three, at in zip(others, largest, strict=True)]
    )
    assert rot.angle(found, rotations).max() < 1e-5


def test_a_long_piece_is_less_than_four_megabytes() -> None:
    for skeleton in (human23(), human44()):
        assert len(page(random_motion(skeleton, 5000)).encode()) < 4_000_000


def test_what_cannot_be_written_is_one_clear_line(tmp_path: Path) -> None:
    with pytest.raises(MotionMindError, match=r"no/page\.html: cannot be written"):
        write_page(tmp_path / "no" / "page.html", still(2))


# --- what is computed -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("skeleton", [human23(), human44(), hexapod().skeleton], ids=lambda skeleton: skeleton.name)
def test_solids_are_where_python_puts_them(show: Callable[..., Opened], skeleton: Skeleton) -> None:
    motion = random_motion(skeleton, 4)
    tab = show(motion)
    cones, balls = shape_of(skeleton).solids(motion.rotations, motion.root)
    joints = skeleton.positions(motion.rotations, motion.root)
    for frame in range(len(motion)):
        found = tab.get(f"motionmind.solids({frame})")
        ends = np.reshape(found["cones"], (-1, 2, 4))
        wanted = np.stack([cones.a[frame], cones.b[frame]], axis=1)
        radii = np.stack([cones.a_radius, cones.b_radius], axis=1)
        np.testing.assert_allclose(ends, np.concatenate([wanted, radii[..., None]], axis=-1), atol=1e-4)
        found_balls = np.reshape(found["balls"], (-1, 4, 3))
        np.testing.assert_allclose(found_balls[:, 0], balls.centre[frame], atol=1e-4)
        np.testing.assert_allclose(found_balls[:, 1:], np.swapaxes(balls.axes[frame], -1, -2), atol=1e-4)
        np.testing.assert_allclose(np.reshape(found["joints"], (-1, 3)), joints[frame], atol=1e-4)


@pytest.mark.parametrize("skeleton", [human23(), hexapod().skeleton], ids=lambda skeleton: skeleton.name)
def test_trails_lead_through_the_places_of_their_joints(show: Callable[..., Opened], skeleton: Skeleton) -> None:
    random = random_motion(skeleton, 60)
    motion = replace(random, times=np.arange(60) / 15.0)  # a trail has a place for each frame
    tab = show(motion)
    is_made = "motionmind.stage.trails !== undefined"
    assert not tab.get(is_made)  # until one is shown, they cost nothing
    named = {end: [at for at, name in enumerate(skeleton.names) if name.endswith(end)] for end in ("wrist", "ankle")}
    wanted = {"hands": named["wrist"], "feet": named["ankle"] or find_feet(skeleton), "pelvis": [0]}
    places = skeleton.positions(motion.rotations, motion.root)
    for part, joints in wanted.items():
        tab.get(f"motionmind.stage.show(2.03, {{ ends: false, onion: 0, trails: ['{part}'] }})")
        if not joints:
            assert not tab.get(is_made)
            continue
        count, *found = tab.get(
            "(() => { const { places, geometry } = motionmind.stage.trails.tubes; const count = geometry.instanceCount;"
            "return [count, ...places.array.slice(0, 8 * count)] })()"
        )
        assert count == 35 * len(joints)  # from 1.2 s before to 1.2 s after
        ends = np.reshape(found, (35, len(joints), 2, 4))
        np.testing.assert_allclose(ends[:, :, 0, :3], places[13:48, joints], atol=1e-4)
        np.testing.assert_allclose(ends[:, :, 1, :3], places[14:49, joints], atol=1e-4)
        thickest = ends[..., 3].max(axis=(1, 2)).argmax()
        assert thickest in (16, 17, 18)  # now
    tab.get("motionmind.stage.show(2.03, { ends: false, onion: 0 })")
    assert not tab.get("motionmind.stage.trails.mesh.visible")


def test_between_frames_rotations_are_slerped_and_the_root_is_linear(show: Callable[..., Opened]) -> None:
    motion = random_motion(human23(), 3)
    tab = show(motion)
    for share in (0.0, 0.3, 0.9):
        time = (1.0 - share) * motion.times[1] + share * motion.times[2]
        rotations, root = tab.get(
            "(() => { const q = Array(92), p = Array(3); motionmind.motion.sample(" + repr(float(time)) + ", q, p); "
            "return [q, p] })()"
        )
        wanted = rot.slerp(motion.rotations[1], motion.rotations[2], share)
        assert rot.angle(rot.normalise(np.reshape(rotations, (-1, 4))), wanted).max() < 1e-4
        np.testing.assert_allclose(root, (1.0 - share) * motion.root[1] + share * motion.root[2], atol=1e-5)


def test_what_is_inserted_and_bridged_is_what_the_motion_says(show: Callable[..., Opened]) -> None:
    motion = bridged()
    tab = show(motion)
    inserted = tab.get("[...motionmind.motion.times].map(time => motionmind.motion.insertedAt(time))")
    joints = tab.get("[...motionmind.motion.times].map(time => motionmind.motion.bridgedAt(time))")
    assert inserted == motion.inserted().tolist()
    assert joints == [np.flatnonzero(row).tolist() for row in motion.bridged()]


# --- what is seen -----------------------------------------------------------------------------------------------------


def test_left_is_warm_and_on_the_right_of_the_front_view(show: Callable[..., Opened]) -> None:
    tab = show(still(2), **FINE)
    tab.click("front")
    picture = tab.picture()
    warm, cool = near(picture, COLOURS["left"]), near(picture, COLOURS["right"])
    assert warm.sum() > 500
    assert cool.sum() > 500
    assert middle(warm)[0] > SIZE["width"] / 2 + 10
    assert abs(middle(warm)[0] + middle(cool)[0] - SIZE["width"]) < 4  # a symmetric posture looks symmetric
    assert abs(warm.sum() - cool.sum()) < 0.1 * warm.sum()


@pytest.mark.long
def test_cameras_look_from_where_they_say(show: Callable[..., Opened]) -> None:
    tab = show(still(2), **FINE)
    extents = {}
    for view in ("front", "side", "top", "quarter"):
        tab.click(view)
        assert tab.get(f"document.getElementById('{view}').ariaPressed") == "true"
        picture = tab.picture()
        body = picture.min(axis=-1) < 200  # darker than floor and paper
        rows, columns = np.flatnonzero(body.any(axis=1)), np.flatnonzero(body.any(axis=0))
        assert rows[0] > 0
        assert columns[0] > 0
        assert columns[-1] < SIZE["width"] - 1
        extents[view] = np.ptp(columns) / np.ptp(rows)
        warm, cool = near(picture, COLOURS["left"]), near(picture, COLOURS["right"])
        if view == "side":
            assert cool.sum() > 3 * warm.sum()  # from stage right, where the body's right is
        else:
            assert middle(cool)[0] < middle(warm)[0]
        if view == "top":  # the audience is below, and the kneecaps and toes point there
            assert middle(near(picture, COLOURS["hair"]))[1] < rows[-1] - 0.5 * np.ptp(rows)
    assert extents["front"] > 0.9  # a T-pose is about as wide as it is tall
    assert extents["side"] < 0.4
    assert extents["top"] > 3.0
    assert 0.4 < extents["quarter"] < extents["front"]


@pytest.mark.long
def test_the_floor_plan_shows_path_and_facings_from_above(show: Callable[..., Opened]) -> None:
    tab = show(bridged(), **FINE)
    facing = (42, 148, 99)  # of plan.js
    assert near(tab.picture(), facing).sum() == 0
    for toggle in (lambda: tab.click("plan"), lambda: tab.press("f")):
        toggle()
        assert tab.get("document.getElementById('plan').ariaPressed") == "true"
        assert tab.get("motionmind.stage.view") == "top"
        assert near(tab.picture(), facing).sum() > 20
        toggle()
        assert tab.get("document.getElementById('plan').ariaPressed") == "false"
        assert tab.get("motionmind.stage.view") == "quarter"
        assert near(tab.picture(), facing).sum() == 0
    found = tab.get("import('motionmind/plan').then(({ facings }) => facings(motionmind.motion))")
    motion = bridged()
    seconds = np.arange(int(motion.times[-1] - motion.times[0] + 1e-6) + 1)
    there = motion.at(motion.times[0] + seconds)
    headings = rot.heading(there.rotations[:, 0])
    np.testing.assert_allclose([one["at"] for one in found], there.root[:, [0, 2]], atol=1e-4)
    towards = np.stack([np.sin(headings), np.cos(headings)], axis=1)
    np.testing.assert_allclose([one["towards"] for one in found], towards, atol=1e-3)


@pytest.mark.long
def test_the_floor_plan_shows_the_edge_of_the_stage_and_all_of_it(show: Callable[..., Opened]) -> None:
    tab = show(bridged(), stage=(6.0, 4.0), **FINE)
    line = (141, 141, 148)  # of lines.js
    assert near(tab.picture(), line).sum() < 20
    tab.click("plan")
    tab.wait("motionmind.stage.edge?.parent")
    picture = tab.picture()
    drawn = near(picture, line)
    rows, columns = np.flatnonzero(drawn.any(axis=1)), np.flatnonzero(drawn.any(axis=0))
    assert 0 < rows[0] < rows[-1] < drawn.shape[0] - 1
    assert np.ptp(columns) / np.ptp(rows) == pytest.approx(6.0 / 4.0, rel=0.05)
    tab.click("plan")
    tab.wait("!motionmind.stage.edge")
    assert near(tab.picture(), line).sum() < 20


def test_dragging_turns_the_camera_and_reset_brings_it_back(show: Callable[..., Opened]) -> None:
    tab = show(still(2))
    before = tab.get("motionmind.stage.camera.position.toArray()")
    tab.page.mouse.move(300, 200)
    tab.page.mouse.down()
    tab.page.mouse.move(380, 230)
    tab.page.mouse.up()
    after = tab.get("motionmind.stage.camera.position.toArray()")
    assert np.linalg.norm(np.subtract(after, before)) > 0.5
    assert tab.get("document.querySelectorAll('#views [aria-pressed=true]').length") == 0
    tab.press("r")
    np.testing.assert_allclose(tab.get("motionmind.stage.camera.position.toArray()"), before, atol=1e-6)


@pytest.mark.long
def test_inserted_frames_are_violet_and_bridged_joints_emerald(show: Callable[..., Opened]) -> None:
    tab = show(bridged(), **FINE)
    tab.click("front")
    tab.click("ends")  # ghosts off
    seen = {}
    for time in (0.0, 0.3, 0.5):
        tab.get(f"motionmind.player.seek({time})")
        picture = tab.picture()
        colours = (INSERTED["middle"], COLOURS["left"], BRIDGED)
        seen[time] = [int(near(picture, colour).sum()) for colour in colours]
        words = [tab.page.is_visible("#inserted"), tab.page.is_visible("#bridged")]
        assert words == [time > 0.0, time == 0.5]
    (violet, warm, emerald), none, few = zip(seen[0.0], seen[0.3], seen[0.5], strict=True), 20, 500
    assert violet[0] < none
    assert violet[1] > few
    assert warm[0] > few
    assert warm[1] < none
    assert emerald[1] < none
    assert emerald[2] > 1.5 * none
    assert tab.page.inner_text("#bridged") == "bridged: left_elbow"


@pytest.mark.long
def test_ghosts_of_a_and_b_and_the_onion_skin_can_be_switched(show: Callable[..., Opened]) -> None:
    motion = bridged()
    moving = replace(motion, root=motion.root + np.outer(np.arange(12), [0.25, 0.0, 0.0]))
    tab = show(moving, **FINE)
    tab.click("front")
    tab.get("motionmind.player.seek(0.4)")
    pictures = {"both": tab.picture()}
    tab.press("a")
    pictures["none"] = tab.picture()
    tab.press("o")
    pictures["onion"] = tab.picture()
    tab.page.select_option("#apart", "1")
    pictures["narrow"] = tab.picture()

    def changed(name: str) -> Indices:
        return np.flatnonzero((np.abs(pictures[name] - pictures["none"]).max(axis=-1) > 8).any(axis=0))

    body = np.flatnonzero((pictures["none"].min(axis=-1) < 150).any(axis=0))
    for name in ("both", "onion", "narrow"):
        assert changed(name)[0] < body[0]  # ghosts on both sides of the body
        assert changed(name)[-1] > body[-1]
    assert np.ptp(changed("narrow")) < np.ptp(changed("onion"))
    tab.press("o")
    assert np.array_equal(tab.picture(), pictures["none"])
    tab.page.select_option("#apart", "3")  # who says how far apart wants to see them
    assert np.array_equal(tab.picture(), pictures["onion"])


@pytest.mark.long
def test_the_shadow_is_under_the_body_and_fades_as_it_rises(show: Callable[..., Opened]) -> None:
    motion = still(3)
    rising = replace(motion, root=motion.root + np.outer([0.0, 0.1, 1.0], [0.0, 1.0, 0.0]))
    tab = show(rising, **FINE)
    darkness = []
    for time in (0.0, 0.1, 0.2):
        tab.get(f"motionmind.player.seek({time}); motionmind.stage.figure.group.visible = false")
        picture = tab.picture().mean(axis=-1)
        darkness.append(238.0 - picture.min())
    assert darkness[0] > darkness[1] + 10 > 10
    assert darkness[1] > darkness[2] + 10


def test_timeline_shows_insertions_and_bridges(show: Callable[..., Opened]) -> None:
    tab = show(bridged(), **FINE)
    shot = tab.page.locator("#timeline canvas").screenshot()
    picture = np.array(Image.open(BytesIO(shot)).convert("RGB")).astype(np.int16)
    violet = np.flatnonzero(near(picture, INSERTED["middle"]).any(axis=0)) / picture.shape[1]
    emerald = np.flatnonzero(near(picture, BRIDGED).any(axis=0)) / picture.shape[1]
    for found, times in ((violet, (0.1, 0.8)), (emerald, (0.4, 0.6))):
        np.testing.assert_allclose([found[0], found[-1]], np.array(times) / 1.1, atol=0.01)
    box = tab.page.locator("#timeline").bounding_box()
    tab.page.mouse.move(box["x"] + box["width"] * 0.5 / 1.1, box["y"] + 10)
    assert tab.page.inner_text(".hint") == "0.50 s · frame 5 · insertion · move 3 of 4 · bridged: left_elbow"


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_all_words_can_be_read(show: Callable[..., Opened], scheme: str) -> None:
    tab = show(bridged(), color_scheme=scheme)
    tab.get("motionmind.player.seek(0.5)")
    tab.press("c")
    box = tab.page.locator("#timeline").bounding_box()
    tab.page.mouse.move(box["x"] + 50, box["y"] + 10)
    seen = {"h1", "frame", "inserted", "bridged", "front", "quarter", "summary", "li", "label", "speed", "hint"}
    assert seen <= readable_words(tab.page)
    for button in ("#front", "#quarter", "#film", "#help", "summary", "#speed"):
        tab.page.hover(button)
        readable_words(tab.page)
    tab.press("?")
    assert {"keys", "kbd", "dd"} <= readable_words(tab.page)


@pytest.mark.long
def test_the_legend_has_the_colours_that_are_seen(show: Callable[..., Opened]) -> None:
    paints: dict[str, list[tuple[int, int, int]]] = {
        "left": [COLOURS["left"]],
        "right": [COLOURS["right"]],
        "front": [COLOURS["mark"]],
        "inserted": [INSERTED[side] for side in ("left", "right", "middle")],
        "bridged": [BRIDGED],
        "A and B": [COLOURS[side] for side in ("left", "right", "middle")],
    }
    unbridged = still(12, (Insertion(np.array([0.1, 0.2])),))
    for motion, wanted in (
        (bridged(), set(paints)),
        (unbridged, set(paints) - {"bridged"}),
        (bridged().slice(3, 6), set(paints) - {"A and B"}),
        (still(2), {"left", "right", "front"}),
        (hexapod(), {"left", "right"}),
    ):
        tab = show(motion, viewport={"width": 1000, "height": 700})
        assert tab.page.is_visible("#legend ul")
        lines = dict(
            tab.get(
                "[...document.querySelectorAll('#legend li')].map(line => [line.innerText.trim(), "
                "[...line.querySelectorAll('i')].map(one => getComputedStyle(one).backgroundColor)])"
            )
        )
        found = {name: colours for line, colours in lines.items() for name in paints if line.startswith(name)}
        assert len(found) == len(lines)
        assert found == {name: [f"rgb{colour}" for colour in paints[name]] for name in wanted}
        tab.press("c")
        assert not tab.page.is_visible("#legend ul")


def test_a_small_page_begins_without_the_legend(show: Callable[..., Opened]) -> None:
    tab = show(bridged(), **SCREENS["lying"])
    assert not tab.page.is_visible("#legend ul")
    tab.page.tap("#legend summary")
    assert tab.page.is_visible("#legend ul")
    assert "li" in readable_words(tab.page)


@pytest.mark.long
def test_it_is_dark_where_the_system_is_until_it_is_switched(show: Callable[..., Opened]) -> None:
    tab = show(still(2), color_scheme="dark", **FINE)
    dark = tab.picture()
    tab.press("d")
    light = tab.picture()
    tab.page.emulate_media(color_scheme="light")
    tab.page.emulate_media(color_scheme="dark")
    assert np.array_equal(tab.picture(), light)
    tab.click("dark")
    assert np.array_equal(tab.picture(), dark)
    corner = (5, 5)
    for picture, shown in ((dark, "dark"), (light, "light")):
        if shown == "light":
            tab.press("d")
        paper = tab.get("getComputedStyle(document.body).backgroundColor")
        np.testing.assert_allclose(picture[corner], [int(v) for v in re.findall(r"\d+", paper)], atol=1)
    assert light[corner].min() > 200
    assert dark[corner].max() < 60
    grown = np.abs(dark - dark[corner]).max(axis=-1) > 4  # floor, shadow and body are seen on either
    assert grown.mean() > 0.1
    assert near(dark, COLOURS["left"]).sum() > 500


def test_it_follows_the_system_while_nobody_switches(show: Callable[..., Opened]) -> None:
    tab = show(still(2), **FINE)
    light = tab.picture()
    tab.page.emulate_media(color_scheme="dark")
    assert tab.picture()[5, 5].max() < 60
    tab.page.emulate_media(color_scheme="light")
    assert np.array_equal(tab.picture(), light)


# --- what one can do --------------------------------------------------------------------------------------------------


def test_it_plays_by_itself_and_space_pauses(show: Callable[..., Opened]) -> None:
    tab = show(ballet_clip("adagio"), reduced_motion="no-preference")
    tab.wait("motionmind.player.time > 0.2")
    tab.press("Space")
    paused = tab.time
    tab.picture()
    assert tab.time == paused
    assert tab.get("document.getElementById('play').ariaLabel") == "Play"
    tab.page.select_option("#speed", "2")
    assert tab.get("motionmind.player.speed") == 2
    tab.click("play")
    tab.wait(f"motionmind.player.time > {paused} + 0.2")


def test_who_wants_less_motion_starts_it(show: Callable[..., Opened]) -> None:
    tab = show(still(20))
    tab.picture()
    assert tab.time == 0.0
    tab.press("Space")
    tab.wait("motionmind.player.time > 0")


def test_keys_step_and_jump(show: Callable[..., Opened]) -> None:
    tab = show(still(12))
    for key, frame in (
        ("ArrowRight", 1),
        ("ArrowRight", 2),
        ("ArrowLeft", 1),
        ("End", 11),
        ("ArrowRight", 11),
        ("Home", 0),
        ("ArrowLeft", 0),
    ):
        tab.press(key)
        assert tab.get("motionmind.player.frame") == frame
        assert tab.page.inner_text("#frame") == f"frame {frame} of 11"
    tab.get("motionmind.player.seek(0.25)")
    tab.press("ArrowLeft")
    assert tab.time == pytest.approx(0.2)
    tab.press("2")
    assert tab.get("motionmind.stage.view") == "side"


def test_space_plays_after_something_was_clicked(show: Callable[..., Opened]) -> None:
    tab = show(ballet_clip("adagio"), viewport={"width": 1000, "height": 700})
    for choose in (
        lambda: tab.click("loop"),
        lambda: tab.page.click("#legend summary"),
        lambda: tab.page.select_option("#speed", "0.5"),
    ):
        choose()
        tab.press("Space")
        assert tab.get("motionmind.player.playing")
        tab.get("motionmind.player.pause()")
    tab.page.focus("#speed")  # by keys, it keeps them
    tab.press("ArrowDown")
    tab.wait("motionmind.player.speed === 0.75")
    tab.press("ArrowDown")
    tab.wait("motionmind.player.speed === 1")


def test_without_loop_it_ends(show: Callable[..., Opened]) -> None:
    tab = show(still(4))
    tab.press("l")
    tab.press("Space")
    tab.wait("!motionmind.player.playing")
    assert tab.time == pytest.approx(0.3)
    tab.press("l")
    assert tab.get("(() => { const p = motionmind.player; p.play(); p.advance(0.4); return p.time })()") == (
        pytest.approx(0.1)
    )


def test_dragging_the_timeline_scrubs(show: Callable[..., Opened]) -> None:
    tab = show(still(11))
    box = tab.page.locator("#timeline").bounding_box()
    y = box["y"] + box["height"] / 2
    tab.page.mouse.move(box["x"] + 0.2 * box["width"], y)
    tab.page.mouse.down()
    assert tab.time == pytest.approx(0.2, abs=0.01)
    tab.page.mouse.move(box["x"] + 0.7 * box["width"], y - 100)
    assert tab.time == pytest.approx(0.7, abs=0.01)
    assert float(tab.get("document.getElementById('timeline').ariaValueNow")) == pytest.approx(0.7, abs=0.01)
    playhead = tab.page.locator(".playhead").bounding_box()
    assert playhead["x"] == pytest.approx(box["x"] + 0.7 * box["width"], abs=2)
    tab.page.mouse.up()
    tab.page.mouse.move(box["x"], y)
    assert tab.time == pytest.approx(0.7, abs=0.01)


def three_insertions() -> Motion:
    """Standing for 4 s; in the middle of the three insertions two joints are bridged, one of them twice."""
    bridges = (("left_elbow", 0), ("left_elbow", 1), ("right_hip", 1))
    stretches = ([0.5, 0.9], [1.5, 2.0, 2.5], [3.0, 3.1, 3.2, 3.3])
    return still(41, tuple(Insertion(np.array(at), bridges if len(at) == 3 else ()) for at in stretches))


def test_insertions_are_named_where_the_pointer_is(show: Callable[..., Opened]) -> None:
    tab = show(three_insertions(), viewport={"width": 360, "height": 480})
    box = tab.page.locator("#timeline").bounding_box()
    for time, words in (
        (0.2, ""),
        (0.7, "insertion 1 of 3 · move 1 of 1"),
        (1.7, "insertion 2 of 3 · move 1 of 2 · bridged: left_elbow"),
        (2.2, "insertion 2 of 3 · move 2 of 2 · bridged: left_elbow, right_hip"),
        (2.7, ""),
        (3.15, "insertion 3 of 3 · move 2 of 3"),
    ):
        x = box["x"] + box["width"] * time / 4.0
        tab.page.mouse.move(x, box["y"] + 15)
        assert tab.page.inner_text(".hint").partition(" · ")[2].partition(" · ")[2] == words
        hint = tab.page.locator(".hint").bounding_box()
        assert hint["x"] >= box["x"] - 1
        assert hint["x"] + hint["width"] <= box["x"] + box["width"] + 1
        marked = tab.get("[...document.querySelectorAll('.under')].map(one => one.getBoundingClientRect().toJSON())")
        assert len(marked) == (words != "")
        assert all(one["left"] <= x <= one["right"] for one in marked)
    tab.page.mouse.down()  # on an insertion, and drags
    assert tab.time == pytest.approx(3.15, abs=0.02)
    tab.page.mouse.up()
    tab.page.mouse.move(box["x"] + 10, 10)
    assert not tab.page.is_visible(".hint")
    assert tab.get("document.querySelectorAll('.under').length") == 0


def test_keys_reach_each_insertion_and_go_there(show: Callable[..., Opened]) -> None:
    motion = three_insertions()
    tab = show(motion)
    tab.page.focus("#timeline")
    tab.press("Tab")
    names = [
        "insertion 1 of 3, 0.50 to 0.90 s, 1 move",
        "insertion 2 of 3, 1.50 to 2.50 s, 2 moves, bridged: left_elbow, right_hip",
        "insertion 3 of 3, 3.00 to 3.30 s, 3 moves",
    ]
    focused = "document.activeElement.ariaLabel"
    for insertion, name in zip(motion.insertions, names, strict=True):
        assert tab.get(focused) == name
        assert tab.page.inner_text(".hint") == name.replace(", ", " · ").replace("w · r", "w, r")
        before = tab.time
        tab.press("ArrowRight")  # to the next one; frames stay
        assert tab.time == before
        if name != names[-1]:
            tab.press("ArrowLeft")
        tab.press("Enter")
        assert tab.time == insertion.times[0]
        tab.press("ArrowRight")
    assert tab.get(focused) == names[-1]
    tab.press("Home")
    assert tab.get(focused) == names[0]
    tab.press("Tab")  # one stop for all
    assert tab.get("document.activeElement.id") == "back"
    assert not tab.page.is_visible(".hint")
    tab.press("Shift+Tab")
    assert tab.get(focused) == names[0]
    tab.get("motionmind.player.seek(2.2)")
    spoken = tab.get("document.getElementById('timeline').ariaValueText")
    assert spoken == "frame 22, 2.20 seconds, insertion 2 of 3, move 2 of 2"


def test_n_and_p_go_from_insertion_to_insertion_and_round(show: Callable[..., Opened]) -> None:
    tab = show(three_insertions())
    for key, time in (("n", 0.5), ("n", 1.5), ("n", 3.0), ("n", 0.5), ("p", 3.0), ("p", 1.5), ("End", 4.0), ("p", 3.0)):
        tab.press(key)
        assert tab.time == time


@pytest.mark.long
def test_credits_are_shown_and_open_where_somebody_should_beware(show: Callable[..., Opened]) -> None:
    free = Credit(1.0, "<b>plies", "Ada", "ballet", licence="CC0-1.0")
    bound = Credit(1.0, "jump", "Eve", "other", licence="CC-BY-ND-4.0")
    for credit, is_open in ((free, False), (bound, True)):
        tab = show(still(12, (Insertion(np.array([0.1, 0.8]), credits=(credit,)),)))
        assert not tab.get("document.querySelector('#credits').hidden")
        assert tab.get("document.querySelector('#credits').open") == is_open
        words = tab.get("document.querySelector('#credits dl').textContent")
        assert f"{credit.corpus}: {credit.clip}, {credit.performer}" in words
    assert show(still(3)).get("document.querySelector('#credits').hidden")


# --- in a frame -------------------------------------------------------------------------------------------------------


@pytest.mark.long
@pytest.mark.parametrize("rights", ["allow-scripts", "allow-scripts allow-downloads"])
def test_it_works_in_a_frame_that_may_do_nothing_else(browser: Any, tmp_path: Path, rights: str) -> None:
    motion = bridged()
    insertion = Insertion(0.3 * motion.insertions[0].times)
    frame = html.escape(page(replace(motion, times=0.3 * motion.times, insertions=(insertion,))), quote=True)
    host = f'<!doctype html><iframe sandbox="{rights}" srcdoc="{frame}" style="width: 640px; height: 400px"></iframe>'
    (tmp_path / "host.html").write_text(host, "utf-8")
    context = browser.new_context(reduced_motion="reduce")
    tab = context.new_page()
    said: list[str] = []
    asked: list[str] = []
    tab.on("console", lambda message: said.append(message.text))
    tab.on("pageerror", lambda error: said.append(str(error)))
    tab.on("request", lambda request: asked.append(request.url))
    tab.goto((tmp_path / "host.html").as_uri())
    inner = next(one for one in tab.frames if one != tab.main_frame)

    def wait(condition: str) -> None:
        """Keys reach the frame's own process in their time."""
        for _ in range(500):
            if inner.evaluate(condition):
                return
            tab.wait_for_timeout(20)
        raise AssertionError(condition)

    wait("!!window.motionmind")
    assert inner.evaluate("document.documentElement.scrollHeight") == 400
    # A frame in a process of its own may be told after it has begun that its viewer wants less motion, and then plays.
    inner.evaluate("motionmind.player.pause()")
    inner.click("#play")
    wait("motionmind.player.time > 0.0 && document.hasFocus()")
    tab.keyboard.press("Space")  # the clicked frame has the keys
    wait("!motionmind.player.playing")
    inner.evaluate("motionmind.player.seek(0.15)")
    tab.keyboard.press("?")
    inner.wait_for_selector("#sheet", state="visible")
    tab.keyboard.press("Escape")
    shot = np.array(Image.open(BytesIO(inner.locator("#canvas").screenshot())).convert("RGB")).astype(np.int16)
    assert near(shot, INSERTED["middle"]).sum() > 300
    assert [line for line in said if "GPU stall" not in line] == []
    files: list[str] = []
    tab.on("download", lambda download: files.append(download.suggested_filename))
    inner.click("#film")
    for _ in range(500):
        if inner.is_visible("#filming a"):
            break
        tab.wait_for_timeout(20)
    assert inner.inner_text("#filming a") == "Save still.webm"
    assert "open the page by itself" in inner.inner_text("#filming")
    tab.wait_for_timeout(200)
    assert files == (["still.webm"] if "downloads" in rights else [])
    context.close()
    assert [url for url in asked if not url.startswith(("data:", "file:", "about:", "blob:"))] == []


# --- odd ones ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "motion",
    [
        still(1),
        still(3, (Insertion(np.array([0.1])),)),
        hexapod(),
        Motion(
            Skeleton("point", ("root",), (-1,), np.zeros((1, 3))), still(2).rotations[:, :1], np.zeros((2, 3)), [0, 1]
        ),
        replace(still(2), root=np.tile([0.0, 50.0, 0.0], (2, 1))),
    ],
    ids=["one posture", "no moves", "six legs", "a point", "far above the floor"],
)
def test_it_shows_odd_motions(show: Callable[..., Opened], motion: Motion) -> None:
    tab = show(motion, **FINE)
    picture = tab.picture()
    body = picture.min(axis=-1) < 200
    assert body.sum() > 50
    assert not body[0].any()
    assert not body[:, [0, -1]].any()
    assert tab.page.is_visible("#timeline") == (len(motion) > 1)


def test_names_are_only_text(show: Callable[..., Opened]) -> None:
    name = "</script><script>alert(1)</script> \"q\" & 'é' \u2028 $title 舞"
    skeleton = replace(human23(), names=tuple(f"{joint}<b>&" for joint in human23().names))
    motion = replace(
        bridged(), name=name, skeleton=skeleton, insertions=(Insertion(np.array([0.0, 1.1]), (("pelvis<b>&", 0),)),)
    )
    tab = show(motion)
    tab.get("motionmind.player.seek(0.5)")
    shown = name.replace("\u2028", r"\u2028")
    assert tab.get("motionmind.motion.name") == shown
    assert tab.get("document.querySelector('h1').textContent") == shown
    assert tab.get("document.getElementById('bridged').innerText") == "bridged: pelvis<b>&"
    assert tab.get("document.querySelectorAll('b').length") == 0


def test_without_webgl_it_says_so(show: Callable[..., Opened]) -> None:
    tab = show(
        still(2),
        ready="!document.getElementById('message').hidden",
        script="HTMLCanvasElement.prototype.getContext = () => null",
    )
    assert "WebGL" in tab.page.inner_text("#message")
    assert not tab.page.is_visible("#timeline")
    tab.said.clear()  # three.js says it too


@pytest.mark.long
@pytest.mark.parametrize("screen", SCREENS)
def test_it_fits_every_screen(show: Callable[..., Opened], screen: str) -> None:
    tab = show(replace(still(1500, bridged().insertions), name="x" * 60), **SCREENS[screen])
    controls = reachable_controls(tab.page, 44 if SCREENS[screen].get("has_touch") else 32)
    assert {"canvas", "timeline", "play", "speed", "apart", "front", "dark", "help", "Colours"} <= controls
    room = "(({ clientWidth, clientHeight }) => [clientWidth, clientHeight])(document.getElementById('canvas'))"
    size = tab.get(room)
    assert size[1] > 180
    for time in (0.0, 0.3, 0.5, 149.9):  # words come and go, and the picture stays as large
        tab.get(f"motionmind.player.seek({time})")
        assert tab.get(room) == size
    line = "(({ scrollWidth, clientWidth }) => scrollWidth <= clientWidth)(document.querySelector('header p'))"
    assert tab.get(line)
    assert tab.page.inner_text("header p").split() == ["frame", "1499", "of", "1499", "149.90", "s"]


def test_a_telephone_has_enough_of_two_pixels_to_one(show: Callable[..., Opened]) -> None:
    tab = show(bridged(), **SCREENS["upright"], device_scale_factor=3)
    assert tab.get("document.getElementById('canvas').width") == 780
    tab.page.tap("#top")
    assert tab.get("motionmind.stage.view") == "top"


def test_a_page_that_is_zoomed_out_is_drawn_with_twice_its_screens_pixels_at_most(show: Callable[..., Opened]) -> None:
    tab = show(still(2), device_scale_factor=0.5)
    tab.picture()
    assert tab.get("motionmind.stage.renderer.getPixelRatio()") <= 1.0


def test_every_control_has_a_name(show: Callable[..., Opened]) -> None:
    tab = show(bridged())
    tab.get(
        "controls = [...document.querySelectorAll('button, summary, canvas[tabindex], [role=slider], [role=group]')]"
    )
    assert tab.get("controls.filter(one => !one.ariaLabel && !one.textContent.trim()).map(one => one.id)") == []
    labels = "[...document.querySelectorAll('select')].map(one => [...one.labels].map(l => l.firstChild.data.trim()))"
    assert tab.get(labels) == [["Speed"], ["Apart"]]  # words that are seen


@pytest.mark.long
def test_the_sheet_of_keys_holds_all_that_act_and_each_acts(show: Callable[..., Opened]) -> None:
    tab = show(bridged())
    tab.press("?")
    shown = tab.get(
        "[...document.querySelectorAll('#sheet dt')].map(one => [...one.querySelectorAll('kbd')].map(k => k.innerText))"
    )
    assert tab.page.is_visible("#sheet")
    tab.press("End")  # belongs to the sheet now
    assert tab.time == 0.0
    closed = "!document.getElementById('sheet').contains(document.activeElement)"
    tab.press("Escape")
    tab.wait(closed)
    assert not tab.page.is_visible("#sheet")

    state = (
        "JSON.stringify([motionmind.player.time, motionmind.player.playing, motionmind.player.loop, "
        "motionmind.stage.camera.position.toArray(), document.getElementById('sheet').open, "
        "document.getElementById('legend').open, document.activeElement.id || document.activeElement.className, "
        "...[...document.querySelectorAll('[aria-pressed]')].map(one => one.ariaPressed)])"
    )
    names = {"Space": "Space", "←": "ArrowLeft", "→": "ArrowRight"}
    for row in shown:
        if row == ["Shift", "arrows"]:
            presses = [f"Shift+Arrow{way}" for way in ("Left", "Right", "Up", "Down")]
        else:
            presses = [names.get(key, key) for key in row]
        for press in presses:
            tab.get("motionmind.player.pause(); motionmind.player.seek(0.55); motionmind.stage.look('quarter')")
            if press in {"4", "R"}:
                tab.press("1")
            before = tab.get(state)
            tab.press(press)
            assert tab.get(state) != before, press
            tab.press("Escape")
            tab.wait(closed)
    assert not tab.get("motionmind.player.playing")


@pytest.mark.long
def test_keys_that_would_do_nothing_are_not_on_the_sheet(show: Callable[..., Opened]) -> None:
    listed = "[...document.querySelectorAll('#sheet dt')].map(one => one.innerText)"
    assert {"A", "N", "P", "Space", "1"} <= set(show(bridged()).get(listed))
    assert {"A", "N", "P", "Space", "1"} & set(show(still(3)).get(listed)) == {"Space", "1"}
    assert {"A", "N", "P", "Space", "1"} & set(show(still(1)).get(listed)) == {"1"}


def test_keys_turn_the_camera_as_dragging_does(show: Callable[..., Opened]) -> None:
    tab = show(still(2))
    place = "motionmind.stage.camera.position.clone().sub(motionmind.stage.controls.target).toArray()"

    def angles() -> tuple[float, float, float]:
        x, y, z = tab.get(place)
        far = float(np.linalg.norm([x, y, z]))
        return float(np.degrees(np.arctan2(x, z))), float(np.degrees(np.arcsin(y / far))), far

    before = angles()
    tab.press("Shift+ArrowLeft")
    turned = angles()
    assert turned[0] == pytest.approx(before[0] - 7.5)
    assert turned[1:] == pytest.approx(before[1:])
    tab.press("Shift+ArrowRight")
    assert angles() == pytest.approx(before)
    tab.press("Shift+ArrowUp")
    assert angles()[1] == pytest.approx(before[1] + 7.5)
    tab.press("r")
    tab.press("+")
    assert angles()[2] == pytest.approx(0.9 * before[2])
    tab.press("-")
    assert angles() == pytest.approx(before)
    assert tab.time == 0.0
    assert tab.get("document.querySelectorAll('#views [aria-pressed=true]').length") == 0


def test_pictures_are_drawn_while_it_plays_and_none_while_it_rests(show: Callable[..., Opened]) -> None:
    tab = show(still(3))
    tab.get(
        "window.asked = 0; const ask = requestAnimationFrame; "
        "window.requestAnimationFrame = (draw) => { asked++; return ask(draw) }; 0"
    )

    def asked_at_rest() -> int:
        seen, before = int(tab.get("asked")), -1
        for _ in range(50):
            if seen == before:
                return seen
            tab.page.wait_for_timeout(200)
            seen, before = int(tab.get("asked")), seen
        raise AssertionError("it never rests")

    before = asked_at_rest()
    tab.press("1")
    assert asked_at_rest() > before
    tab.press("Space")
    tab.wait(f"asked > {before + 20}")
    tab.press("Space")
    asked_at_rest()


def test_a_part_has_only_the_ghosts_that_it_holds(show: Callable[..., Opened]) -> None:
    motion = bridged()
    for part, ends in ((motion, 2), (motion.slice(3, 12), 1), (motion.slice(3, 6), 0)):
        tab = show(part)
        assert tab.get("motionmind.motion.insertions.map(one => motionmind.motion.ends(one).length)") == [ends]
        assert tab.get("document.getElementById('ends').hidden") == (ends == 0)


def test_a_leap_of_one_frame_amid_many_is_seen_whole(show: Callable[..., Opened]) -> None:
    motion = still(700)
    root = motion.root.copy()
    root[433, 1] += 3.0
    tab = show(replace(motion, root=root))
    assert tab.get("Math.max(...motionmind.stage.cloud.map(place => place.y))") > 3.5
