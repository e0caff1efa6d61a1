"""Laws of films: where the body is in the picture, what shadows, ghosts and colours tell, and what a file holds."""

from __future__ import annotations

import subprocess
import sys
import weakref
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from bodies import ant
from bundled_clips import ballet_clip
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from motionmind._typing import Bools, Floats, Ints, Pixels
from motionmind.body.human import human23, human44
from motionmind.body.mirror import mirrored
from motionmind.body.motion import Insertion, Motion
from motionmind.body.skeleton import Skeleton
from motionmind.errors import MotionMindError
from motionmind.geometry import rotations as rot
from motionmind.render import film
from motionmind.render.camera import SAMPLES_PER_PX
from motionmind.render.film import write_film, write_still
from motionmind.render.palette import BRIDGED, COLOURS, INSERTED
from motionmind.render.solids import EMPTY_CODE
from motionmind.render.stage import MAX_HEIGHT_PX, MIN_HEIGHT_PX, FigurePlate, Stage
from motionmind.render.timing import HOLD_S, frame_times
from motionmind.render.view import VIEWS

SMALL = 200  # pixels: pictures for tests
UP = human23().height * 0.55  # metres from the floor to the root of a person who stands


def movement(
    skeleton: Skeleton | None = None, *, frames: int = 5, most: float = 0.8, seed: int = 1, fps: float = 10.0
) -> Motion:
    """Nobody's movement: random postures, joints turned up to `most` radians, the root at the height of a person's."""
    skeleton, rng = skeleton or human23(), np.random.default_rng(seed)
    turns = rng.normal(size=(frames, len(skeleton), 3))
    turns *= rng.uniform(0.0, most, (frames, len(skeleton), 1)) / np.linalg.norm(turns, axis=-1, keepdims=True)
    root = np.add(rng.uniform(-0.1, 0.1, (frames, 3)), [0.0, UP, 0.0])
    return Motion(skeleton, rot.exp(turns), root, np.arange(frames) / fps, name="movement")


def still(*, height: float = UP, frames: int = 1) -> Motion:
    """human23 at rest, its root at a height, metres."""
    rotations = np.tile(rot.IDENTITY, (frames, len(human23()), 1))
    return Motion(human23(), rotations, np.tile([0.0, height, 0.0], (frames, 1)), np.arange(frames) / 10.0)


def scaled(skeleton: Skeleton, factor: float) -> Skeleton:
    return replace(skeleton, offsets=skeleton.offsets * factor, tips=skeleton.tips * factor)


def chain() -> Skeleton:
    """Two bones of half a metre, one on the other."""
    return Skeleton("chain", ("a", "b", "c"), (-1, 0, 1), np.array([[0.0, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.5, 0.0]]))


def along(motion: Motion, *end: float) -> Motion:
    """The motion, carried evenly to a place, metres, that far from its own."""
    return replace(motion, root=motion.root + np.linspace(0.0, 1.0, len(motion))[:, None] * end)


def moved(motion: Motion, *by: float) -> Motion:
    """The motion elsewhere, metres."""
    return replace(motion, root=np.add(motion.root, by))


def lying() -> Motion:
    motion = along(still(frames=3, height=0.1), 0.0, 0.0, 0.4)
    rotations = motion.rotations.copy()
    rotations[:, 0] = rot.exp(np.array([-np.pi / 2, 0.0, 0.0]))
    return replace(motion, rotations=rotations)


def leaping() -> Motion:
    motion = movement(frames=9)
    return replace(motion, root=motion.root + np.sin(np.linspace(0.0, np.pi, 9))[:, None] * [0.0, 2.5, 0.0])


def of_size(factor: float) -> Motion:
    motion = movement(scaled(human23(), factor))
    return replace(motion, root=motion.root * factor)


def bridged(motion: Motion, *joints: str) -> Motion:
    """The motion as one that the engine made in two moves, the second of which bridges joints."""
    times = motion.times[[0, len(motion) // 2, -1]]
    return replace(motion, insertions=(Insertion(times, tuple((joint, 1) for joint in joints)),))


ODD = {
    "one posture": lambda: movement(frames=1),
    "six legs": lambda: movement(ant()),
    "44 joints": lambda: movement(human44()),
    "leaping": leaping,
    "lying": lying,
    "walking 10 m": lambda: along(movement(frames=30), 10.0, 0.0, 3.0),
    "walking 40 m away": lambda: along(movement(frames=150), 0.0, 0.0, -40.0),
    "5 mm tall": lambda: of_size(0.003),
    "30 m tall": lambda: of_size(18.0),
    "one joint": lambda: movement(Skeleton("dot", ("dot",), (-1,), np.zeros((1, 3)))),
    "a kilometre from the middle": lambda: along(moved(movement(), 1000.0, 0.0, 500.0), 1.0),
    "far above the floor": lambda: moved(movement(), 0.0, 12.0, 0.0),
    "far below it": lambda: moved(movement(), 0.0, -12.0, 0.0),
    "sunk to the knees": lambda: moved(movement(), 0.0, -0.5, 0.0),
    "bridged at its end": lambda: bridged(movement(chain()), "c"),
}


def touched(drawing: FigurePlate, stage: Stage) -> tuple[Floats, Floats]:
    """The rows and columns of the picture, pixels, that a body covers."""
    rows, columns = np.nonzero(drawing.buffer.solid != EMPTY_CODE)
    x, y = drawing.corner
    return rows / SAMPLES_PER_PX + y, columns / SAMPLES_PER_PX + x


def near(picture: Pixels, colour: tuple[int, int, int]) -> Bools:
    """Which pixels [H, W] have a colour's hue: what shade and haze leave of it."""
    samples, wanted = picture.astype(float) - picture.mean(axis=-1, keepdims=True), np.array(colour) - np.mean(colour)
    length = np.linalg.norm(samples, axis=-1)
    return (samples @ wanted > 0.97 * length * np.linalg.norm(wanted)) & (length > 40.0)


# --- stage ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("name", ODD)
def test_all_of_the_body_is_in_the_picture(name: str, view: str) -> None:
    stage = Stage(ODD[name](), view=view, size=SMALL)
    camera = stage.camera
    assert camera.width <= 2 * SMALL
    assert camera.height <= SMALL
    assert camera.width % 2 == camera.height % 2 == 0
    largest = 0.0
    for number in {*range(0, len(stage), 1 + len(stage) // 10), len(stage) - 1}:
        for drawing in (stage.drawing(number), *stage.ghosts(number)):
            rows, columns = touched(drawing, stage)
            free = camera.margin - 1.0
            assert free <= rows.min() <= rows.max() <= camera.height - stage.strip - free
            assert free <= columns.min() <= columns.max() <= camera.width - free
            largest = max(largest, np.ptp(rows), np.ptp(columns))
            edge = drawing.buffer.solid.copy()
            edge[1:-1, 1:-1] = EMPTY_CODE
            assert (edge == EMPTY_CODE).all()  # nothing is cut off by its own box
        assert stage.picture(number).shape == (camera.height, camera.width, 3)
    path = np.ptp(stage.motion.root, axis=0).max() / stage.body.height
    if name != "one joint" and path < 0.5:
        assert largest > 0.35 * SMALL


@given(st.sampled_from(sorted(VIEWS)), st.integers(0, 2**32 - 1))
@settings(max_examples=20, deadline=None)
def test_the_floor_is_under_its_pixels(view: str, seed: int) -> None:
    camera = Stage(movement(), view=view, size=SMALL).camera
    spots = np.random.default_rng(seed).uniform(-3.0, 3.0, (5, 3)) * [1.0, 0.0, 1.0]
    pixels = camera.to_pixels(spots)
    found = np.column_stack([pixels, np.ones(5)]) @ camera.on_floor.T
    assert np.allclose(found, (spots - camera.origin)[:, [0, 2]], atol=1e-9)


def test_a_floor_that_is_far_off_is_left_out() -> None:
    assert Stage(still()).ground is not None
    for height in (-10.0, 10.0):
        stage = Stage(still(height=height), size=SMALL)
        assert stage.ground is None
        assert stage.shadow(0) is None
        assert (stage.backdrop(0) == stage.backdrop(0)[0, 0]).all()


def test_shadows_are_darker_the_nearer_the_body_is_to_the_floor() -> None:
    dark = []
    for height in UP + np.array([0.0, 0.1, 0.3, 0.6, 1.2]):
        shadow = Stage(still(height=height), size=SMALL).shadow(0)
        assert shadow is not None
        dark.append(float(shadow.dark.max()))
        assert shadow.dark.min() >= 0.0
    assert all(more > less + 0.01 for more, less in pairwise([*dark, 0.0]))
    assert dark[0] > 2.0 * dark[-1]


@pytest.mark.parametrize("view", VIEWS)
def test_the_shadow_is_under_the_feet(view: str) -> None:
    stage = Stage(along(still(frames=3), 2.0, 0.0, 1.0), view=view, size=SMALL)
    for number in range(3):
        shadow = stage.shadow(number)
        assert shadow is not None
        rows, columns = np.nonzero(shadow.dark > 0.7 * shadow.dark.max())
        middle = np.array([columns.mean() + 0.5, rows.mean() + 0.5]) + shadow.corner
        under = stage.motion.root[number] * [1.0, 0.0, 1.0] + [0.0, 0.0, 0.03]  # feet point forward
        assert np.abs(middle - stage.camera.to_pixels(under)).max() < 0.08 * stage.camera.scale


def test_shadows_darken_the_floor_and_no_ghost() -> None:
    stage = Stage(bridged(along(movement(frames=7), 1.5, 0.2, 0.0)), size=SMALL)
    for number in range(7):
        shadow, picture, behind = stage.shadow(number), stage.picture(number), stage.backdrop(number)
        assert shadow is not None
        (x, y), (height, width) = shadow.corner, shadow.dark.shape
        dark = np.zeros(picture.shape[:2])
        dark[y : y + height, x : x + width] = shadow.dark
        dark[-stage.strip :] = 0.0
        dark[stage.drawing(number).box] = 0.0
        haunted = np.zeros(dark.shape, dtype=bool)
        for ghost in stage.ghosts(number):
            haunted[ghost.box] = ghost.buffer.solid[::SAMPLES_PER_PX, ::SAMPLES_PER_PX] != EMPTY_CODE
        fallen = behind.astype(float).sum(axis=-1) - picture.sum(axis=-1)
        clear = dark > 0.05
        assert (fallen[clear & ~haunted] > 10.0).all()
        assert (fallen[clear & haunted] == 0.0).all()


def test_a_mirrored_motion_has_a_mirrored_picture() -> None:
    motion = along(movement(frames=4), 1.0, 0.0, -0.5)
    stages = [Stage(one, view="front", size=SMALL) for one in (motion, mirrored(motion))]
    assert stages[0].camera.to_pixels(np.zeros(3))[1] == pytest.approx(stages[1].camera.to_pixels(np.zeros(3))[1])
    flat = [stage.backdrop(0)[: -stage.strip] for stage in stages]
    assert np.abs(flat[0].astype(int) - flat[1][:, ::-1]).max() <= 1
    for number in range(4):
        bodies = []
        for stage in stages:
            picture = np.zeros((SAMPLES_PER_PX * stage.camera.height, SAMPLES_PER_PX * stage.camera.width), dtype=bool)
            rows, columns = (
                slice(SAMPLES_PER_PX * box.start, SAMPLES_PER_PX * box.stop) for box in stage.drawing(number).box
            )
            picture[rows, columns] = stage.drawing(number).buffer.solid != EMPTY_CODE
            bodies.append(picture)
        assert (bodies[0] != bodies[1][:, ::-1]).sum() < 0.01 * bodies[0].sum()
        pictures = [stage.picture(number)[: -stage.strip].astype(int).sum(axis=-1) for stage in stages]
        outside = ~(bodies[0] | bodies[1][:, ::-1]).reshape(len(pictures[0]) + stages[0].strip, 2, -1, 2).any((1, 3))
        different = np.abs(pictures[0] - pictures[1][:, ::-1]) * outside[: -stages[0].strip]
        assert (different > 12).mean() < 0.01  # shadows too, but for the lines round the body


def test_ghosts_are_the_ends_of_the_insertion_that_goes_on() -> None:
    given_movement = movement(frames=9)
    motion = replace(given_movement, insertions=(Insertion(given_movement.times[[2, 4, 6]]),))
    stage = Stage(motion, size=SMALL)
    alone = stage.backdrop(0).astype(int)
    for number in range(9):
        ghosts = stage.ghosts(number)
        assert len(ghosts) == (2 if 2 <= number <= 6 else 0)
        changed = (stage.backdrop(number) != alone).any(axis=-1)
        assert changed.any() == bool(ghosts)
        covered = np.zeros_like(changed)
        for ghost, end in zip(ghosts, (2, 6), strict=False):
            own = stage.drawing(end)
            assert ghost.corner == own.corner
            assert (ghost.buffer.solid == own.buffer.solid).all()
            filled = own.buffer.solid.reshape(own.buffer.solid.shape[0] // 2, 2, -1, 2) != EMPTY_CODE
            covered[own.box] |= filled.any(axis=(1, 3))
            assert changed[own.box][filled.all(axis=(1, 3))].mean() > 0.95
            assert np.abs(stage.backdrop(number) - alone)[own.box].max() < 100  # pale
        grown = covered.copy()
        for shift in (-1, 1):
            grown |= np.roll(covered, shift, 0) | np.roll(covered, shift, 1)
        assert not (changed & ~grown).any()


def test_what_the_engine_inserted_has_other_colours_than_what_was_given() -> None:
    stage = Stage(bridged(movement(frames=7)), size=SMALL)
    for number in range(7):
        picture = stage.picture(number)
        violet, red = near(picture, INSERTED["middle"]), near(picture, COLOURS["left"])
        violet[-stage.strip :] = False  # words and the line of time
        assert (violet.sum() > 100) == (0 < number < 6)
        assert (red.sum() > 100) == (number in {0, 6})
        assert ("inserted" in dict(stage.words(number))) == (0 < number < 6)


def test_bridged_joints_are_marked_and_named() -> None:
    stage = Stage(bridged(movement(frames=8), "left_knee", "right_elbow"), size=SMALL)
    expected = stage.motion.bridged().any(axis=1)
    assert 0 < expected.sum() < 8
    for number in range(8):
        picture = stage.picture(number)
        assert (near(picture[: -stage.strip], BRIDGED).sum() > 10) == expected[number]
        assert ("bridged: left_knee, right_elbow" in dict(stage.words(number))) == expected[number]


def test_a_slice_without_its_insertions_ends_has_no_ghosts() -> None:
    motion = bridged(movement(frames=8), "left_knee")
    for part, ghosts in ((motion.slice(3, 4), 0), (motion.slice(2, 6), 0), (motion.slice(0, 4), 1)):
        stage = Stage(part, size=SMALL)
        assert len(stage.ghosts(len(stage) - 1)) == ghosts
        assert stage.drawing(len(stage) - 1).paints.tolist() == stage._paints[1].tolist()


@given(st.integers(2, 30), st.floats(0.3, 200.0), st.floats(0.5, 60.0))
def test_moments_begin_and_end_with_the_motion_and_are_even(frames: int, fps: float, rate: float) -> None:
    motion = movement(frames=frames, fps=fps)
    times = frame_times(motion, rate)
    steps = np.diff(times)
    assert times[[0, -1]].tolist() == motion.times[[0, -1]].tolist()
    assert np.allclose(steps, steps[0])
    assert len(steps) == 1 or 0.999 / rate < steps[0] < 2.0 / rate


def test_a_stage_shows_the_motion_at_its_moments() -> None:
    motion = movement(frames=6)
    stage = Stage(motion, np.array([0.1, 0.25, 0.5]), size=SMALL)
    assert np.allclose(stage.motion.rotations[0], motion.rotations[1])
    half = rot.slerp(motion.rotations[2], motion.rotations[3], 0.5)
    assert np.allclose(np.abs((stage.motion.rotations[1] * half).sum(axis=-1)), 1.0)
    assert np.allclose(stage.motion.root[1], 0.5 * (motion.root[2] + motion.root[3]))
    assert [dict(stage.words(number)).keys() for number in (0, 2)] == [{"0.10 s", "frame 1"}, {"0.50 s", "frame 5"}]


def test_words_that_do_not_fit_are_cut_short() -> None:
    stage = Stage(bridged(movement(), *human23().names), size=MIN_HEIGHT_PX)
    picture, margin = stage.picture(3), stage.camera.margin
    strip = np.abs(picture.astype(int) - stage.backdrop(3))[-stage.strip :].sum(axis=-1)
    assert strip[:, margin:-margin].any()
    assert not strip[: round(0.6 * stage.strip), -margin:].any()


@pytest.mark.parametrize(
    ("view", "size", "words"),
    [("behind", 480, "quarter"), ("front", MIN_HEIGHT_PX - 1, "120"), ("front", MAX_HEIGHT_PX + 1, "2160")],
)
def test_what_cannot_be_staged_is_refused(view: str, size: int, words: str) -> None:
    with pytest.raises(MotionMindError, match=words):
        Stage(still(), view=view, size=size)


# --- GIF and PNG ----------------------------------------------------------------------------------------------------


def opened(path: Path) -> Iterator[tuple[Ints, int]]:
    """The pictures of a GIF, with their times in milliseconds."""
    with Image.open(path) as image:
        assert image.info["loop"] == 0  # for ever
        for number in range(image.n_frames):
            image.seek(number)
            yield np.asarray(image.convert("RGB")).astype(int), image.info["duration"]


@pytest.mark.parametrize(("fps", "frames", "rate"), [(10.0, 12, None), (30.0, 20, None), (7.3, 9, 50.0), (60, 9, 7.0)])
def test_a_gif_lasts_as_long_as_the_motion(tmp_path: Path, fps: float, frames: int, rate: float | None) -> None:
    motion = movement(frames=frames, fps=fps)
    write_film(tmp_path / "a.gif", motion, fps=rate, size=MIN_HEIGHT_PX)
    times = [time for _, time in opened(tmp_path / "a.gif")]
    length = 1000.0 * motion.times[-1]
    assert abs(sum(times) - length - 1000 * HOLD_S) <= 10.0
    assert max(times[:-1]) - min(times[:-1]) <= 10
    begins = np.cumsum([0, *times[:-1]])
    assert np.abs(begins - np.linspace(0.0, length, len(times))).max() <= 5.0 + 1e-6
    assert min(times) >= 20  # browsers slow down what is shorter


def test_a_gif_shows_what_is_on_the_stage(tmp_path: Path) -> None:
    motion = bridged(along(movement(frames=12), 1.0, 0.2, 0.0), "left_knee")
    write_film(tmp_path / "a.gif", motion, size=SMALL)
    stage = Stage(motion, frame_times(motion, 25.0), size=SMALL)
    shown = list(opened(tmp_path / "a.gif"))
    assert len(shown) == len(stage) > 12  # motion written at 10 frames a second is drawn at 25
    for (picture, _), meant in zip(shown, stage.frames(), strict=True):
        apart = np.abs(picture - meant)
        assert apart.mean() < 1.5
        assert np.quantile(apart, 0.999) < 32


def test_a_body_that_stays_does_not_flicker(tmp_path: Path) -> None:
    write_film(tmp_path / "a.gif", still(frames=10), size=SMALL)
    pictures = [picture for picture, _ in opened(tmp_path / "a.gif")]
    strip = Stage(still(frames=10), size=SMALL).strip
    assert all((picture == pictures[0])[:-strip].all() for picture in pictures)


def test_a_gif_of_one_posture_is_a_still(tmp_path: Path) -> None:
    write_film(tmp_path / "a.gif", movement(frames=1), size=SMALL)
    write_still(tmp_path / "a.png", movement(frames=1), size=SMALL)
    meant = Stage(movement(frames=1), size=SMALL).picture(0)
    with Image.open(tmp_path / "a.png") as picture:
        assert (np.asarray(picture) == meant).all()
    with Image.open(tmp_path / "a.gif") as picture:
        assert np.abs(np.asarray(picture.convert("RGB")).astype(int) - meant).mean() < 1.5


def test_frames_are_not_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    alive: list[weakref.ref[Pixels]] = []
    most, draw = 0, Stage.picture

    def counted(stage: Stage, number: int) -> Pixels:
        nonlocal most
        picture = draw(stage, number)
        alive.append(weakref.ref(picture))
        most = max(most, sum(one() is not None for one in alive))
        return picture

    monkeypatch.setattr(Stage, "picture", counted)
    film.gif(Stage(movement(frames=30), size=MIN_HEIGHT_PX))
    assert len(alive) > 30
    assert most <= 2


@pytest.mark.parametrize("suffix", [".gif", ".mp4"])
def test_the_same_film_has_the_same_bytes(tmp_path: Path, suffix: str) -> None:
    if suffix == ".mp4":
        pytest.importorskip("imageio_ffmpeg")
    motion = ballet_clip("jump")
    for name in ("a", "b"):
        write_film(tmp_path / f"{name}{suffix}", motion, size=SMALL)
    assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()


def test_a_film_that_fails_leaves_the_old_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.gif"
    path.write_bytes(b"old")

    def fail(stage: Stage, number: int) -> None:
        raise MotionMindError("no light")

    monkeypatch.setattr(Stage, "picture", fail)
    with pytest.raises(MotionMindError, match="no light"):
        write_film(path, movement(), size=SMALL)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_what_cannot_be_written_is_told_in_a_line(tmp_path: Path) -> None:
    for write, name in ((write_film, "a.gif"), (write_still, "a.png")):
        with pytest.raises(MotionMindError, match="cannot be written") as error:
            write(tmp_path / "nowhere" / name, movement(frames=1), size=SMALL)
        assert "\n" not in str(error.value)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("name", "fps", "words"),
    [("a.gif", 51.0, "to 50 frames a second"), ("a.gif", 0.0, "from 0.01 to 50"), ("a.mp4", 121.0, "to 120 frames"),
     ("a.gif", float("nan"), "nan"), ("a.avi", None, r"\.avi"), ("a", None, "without suffix")],
)  # fmt: skip
def test_what_cannot_be_filmed_is_refused(tmp_path: Path, name: str, fps: float | None, words: str) -> None:
    with pytest.raises(MotionMindError, match=words):
        write_film(tmp_path / name, movement(), fps=fps)


def test_a_still_is_of_one_posture(tmp_path: Path) -> None:
    with pytest.raises(MotionMindError, match="one posture, not of 5"):
        write_still(tmp_path / "a.png", movement())


# --- MP4 ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("rate", [None, 24.0, 29.97])
def test_an_mp4_shows_what_is_on_the_stage(tmp_path: Path, rate: float | None) -> None:
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    motion = bridged(movement(frames=20, fps=30.0), "left_knee")
    write_film(tmp_path / "a.mp4", motion, fps=rate, size=SMALL)
    stage = Stage(motion, frame_times(motion, rate or 30.0), size=SMALL)
    to_raw = [ffmpeg.get_ffmpeg_exe(), "-i", tmp_path / "a.mp4", "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    run = subprocess.run(to_raw, check=True, capture_output=True)
    video = next(line for line in run.stderr.decode().splitlines() if "Video:" in line)
    height, width = stage.camera.height, stage.camera.width
    for what in ("h264", "yuv420p", "bt709", f"{width}x{height}", f"{rate or 30:g} fps"):
        assert what in video
    assert b"Audio:" not in run.stderr
    shown = np.frombuffer(run.stdout, dtype=np.uint8).reshape(-1, height, width, 3).astype(int)
    assert len(shown) == len(stage)
    for picture, meant in zip(shown, stage.frames(), strict=True):
        assert np.abs(picture - meant).mean() < 2.5
        violet = near(meant, INSERTED["middle"])
        violet[-stage.strip :] = False  # lines are too thin for the colours of H.264
        cast = np.median((picture - meant)[violet], axis=0) if violet.any() else np.zeros(3)
        assert np.abs(cast).max() <= 6.0


def test_without_its_extra_an_mp4_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(MotionMindError, match=r'pip install "motionmind\[film\]"'):
        write_film(tmp_path / "a.mp4", movement(), size=SMALL)
    assert not list(tmp_path.iterdir())


def test_an_encoder_that_fails_is_quoted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("imageio_ffmpeg")
    monkeypatch.setattr(film, "_arguments", lambda stage, rate, track: ["-loglevel", "error", "-i", "nothing.avi"])
    with pytest.raises(MotionMindError, match="No such file") as error:
        write_film(tmp_path / "a.mp4", movement(), size=SMALL)
    assert "\n" not in str(error.value)
