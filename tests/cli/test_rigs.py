"""Tweens and conversions on the rig of a file, and for programs: what comes where, and what is refused."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bundled_clips import ballet_clip
from command_line import Run
from plain_bvh import PlainBvh, degrees_between, write_plain
from plain_gltf import PlainGltf, furthest
from program_rigs import disguise, rig_names, spread

from motionmind.body.motion import Motion
from motionmind.body.skeleton import Skeleton
from motionmind.formats import read_motion, write_motion
from motionmind.geometry import rotations as rot
from motionmind.tween.engine import Engine

FPS = 30.0
SLOW = disguise(ballet_clip("adagio").resample(FPS).slice(0, 120), rig_names("Mixamo"), spread())
TWEEN = ("tween", "--corpus", "ballet", "--moves", "2..6")
WITH_CHANNELS = {"order": lambda joint: ("ZYX", "XYZ")[joint % 2], "newline": "\r\n", "indent": "  "}


def clip(name: str = "clip.bvh", motion: Motion = SLOW, **how: Any) -> PlainBvh:
    return PlainBvh(write_plain(Path(name), motion, **(WITH_CHANNELS | how)))


def same_ends(found: PlainBvh, a: tuple[PlainBvh, int], b: tuple[PlainBvh, int]) -> None:
    """Check that the first and the last frame are those of files, in all joints."""
    for at, (file, frame) in ((0, a), (-1, b)):
        (turns, places), (wanted_turns, wanted) = found.world([at]), file.world([frame])
        assert degrees_between(turns, wanted_turns) < 1e-5
        np.testing.assert_allclose(places, wanted, atol=1e-5)


# --- the rig of both ends -------------------------------------------------------------------------------------------


def test_a_tween_between_frames_of_a_file_is_on_its_skeleton(run: Run) -> None:
    source = clip()
    ran = run(*TWEEN, "clip.bvh@0.5s", "clip.bvh@40~", "-o", "out.bvh", "-o", "out.json")
    assert ran.code == 0, ran.err
    found = PlainBvh("out.bvh")
    assert found.hierarchy == source.hierarchy
    np.testing.assert_allclose(found.values[0], source.values[15], atol=1e-5)
    same_ends(found, (source, 15), (source, 40))
    assert found.jumps() < 180.0
    assert read_motion("out.json").skeleton.name == "human23"
    assert len(found.values) == len(read_motion("out.json"))


def test_a_tween_between_files_of_one_person_is_on_the_skeleton_of_the_first(run: Run) -> None:
    one, other = clip("one.bvh"), clip("other.bvh", order=lambda _: "XZY", newline="\n")
    assert run(*TWEEN, "one.bvh@15", "other.bvh@40", "-o", "out.bvh").code == 0
    found = PlainBvh("out.bvh")
    assert found.hierarchy == one.hierarchy
    same_ends(found, (one, 15), (one, 40))
    assert run(*TWEEN, "other.bvh@15", "one.bvh@40", "-o", "out.bvh").code == 0
    assert PlainBvh("out.bvh").hierarchy == other.hierarchy


def test_every_alternative_is_on_the_rig_and_ends_there(run: Run) -> None:
    source = clip()
    ran = run(*TWEEN, "clip.bvh@15", "clip.bvh@40", "--via", "clip.bvh@30@", "--alternatives", 2, "-o", "out.bvh")
    assert ran.code == 0, ran.err
    files = [PlainBvh(f"out-{number}.bvh") for number in (1, 2)]
    for found in files:
        assert found.hierarchy == source.hierarchy
        same_ends(found, (source, 15), (source, 40))
    assert files[0].values.shape != files[1].values.shape or np.abs(files[0].values - files[1].values).max() > 1.0


def test_ends_on_two_rigs_are_on_neither(run: Run) -> None:
    clip()
    write_motion("own.bvh", ballet_clip("adagio").resample(FPS).slice(0, 60))
    assert run(*TWEEN, "clip.bvh@15", "own.bvh@40", "-o", "out.bvh").code == 0
    assert PlainBvh("out.bvh").names[0] == "pelvis"


# --- another rig ----------------------------------------------------------------------------------------------------


def test_the_rig_may_be_that_of_another_file(run: Run) -> None:
    rig = clip("rig.bvh", per_metre=1.0)
    ran = run(*TWEEN, "ballet/fifth", "ballet/arabesque", "-o", "out.bvh", "-o", "out.json", "--rig", "rig.bvh")
    assert ran.code == 0, ran.err
    assert PlainBvh("out.bvh").hierarchy == rig.hierarchy
    assert run("convert", "out.bvh", "back.json", "--skeleton", "human23", "--unit", "m").code == 0
    wanted, back = read_motion("out.json"), read_motion("back.json")
    assert np.degrees(rot.angle(back.rotations, wanted.rotations)).max() < 1e-3
    np.testing.assert_allclose(back.root, wanted.root, atol=1e-3)


def test_one_end_may_be_on_the_rig(run: Run) -> None:
    rig = clip("rig.bvh")
    assert run(*TWEEN, "ballet/fifth", "rig.bvh@40", "-o", "out.bvh", "--rig", "rig.bvh").code == 0
    turns, places = PlainBvh("out.bvh").world([-1])
    wanted_turns, wanted = rig.world([40])
    assert degrees_between(turns, wanted_turns) < 1e-5
    np.testing.assert_allclose(places, wanted, atol=1e-5)


def test_into_a_character(run: Run) -> None:
    write_motion("character.glb", SLOW)
    ran = run(*TWEEN, "character.glb@15", "character.glb@40", "-o", "out.glb")
    assert ran.code == 0, ran.err
    character, found = PlainGltf("character.glb"), PlainGltf("out.glb")
    ends = [float(times[-1]) for times, _ in found.tracks().values()]
    assert furthest(found.world(0.0), character.world(15 / FPS)) < 1e-5
    assert furthest(found.world(max(ends)), character.world(40 / FPS)) < 1e-5
    assert len(found.json["animations"]) == 2
    ran = run(*TWEEN, "ballet/fifth", "ballet/arabesque", "-o", "into.glb", "--into", "character.glb")
    assert ran.code == 0, ran.err
    into = PlainGltf("into.glb")
    assert [node["name"] for node in into.nodes] == [node["name"] for node in character.nodes]
    assert into.json["skins"] == character.json["skins"]


def test_files_of_another_kind_have_the_rig_s_joints(run: Run) -> None:
    clip("rig.bvh")
    write_motion("character.glb", SLOW)
    ends = (*TWEEN, "ballet/fifth", "ballet/arabesque")
    assert run(*ends, "-o", "out.glb", "--rig", "rig.bvh").code == 0
    assert read_motion("out.glb").skeleton.names == SLOW.skeleton.names
    ran = run(*ends, "-o", "out.bvh", "--rig", "character.glb", "--for", "blender")
    assert ran.code == 0, ran.err
    assert "--for" not in ran.err
    assert read_motion("out.bvh", unit="m").skeleton.names == SLOW.skeleton.names


def test_conversions_onto_a_rig(run: Run) -> None:
    rig = clip("rig.bvh")
    write_motion("in.json", ballet_clip("adagio").resample(FPS).slice(20, 50))
    ran = run("convert", "in.json", "out.bvh", "--rig", "rig.bvh")
    assert ran.code == 0, ran.err
    assert PlainBvh("out.bvh").hierarchy == rig.hierarchy
    same_ends(PlainBvh("out.bvh"), (rig, 20), (rig, 49))
    assert run("convert", "rig.bvh", "same.bvh", "--rig", "rig.bvh").code == 0
    turns, wanted = (PlainBvh(name).world(range(0, 120, 9))[0] for name in ("same.bvh", "rig.bvh"))
    assert degrees_between(turns, wanted) < 1e-5


# --- programs -------------------------------------------------------------------------------------------------------


ODD = ("tween", "--corpus", "ballet", "--moves", "3", "--pace", "1.07")  # lasts no whole number of frames


@pytest.mark.parametrize(("program", "fps"), [("blender", 24.0), ("maya", 24.0)])
def test_b_is_the_last_frame_for_a_program(program: str, fps: float, run: Run) -> None:
    source = clip(motion=replace(SLOW, times=SLOW.times * FPS / 29.3))
    assert run(*ODD, "clip.bvh@15", "clip.bvh@40", "-o", "out.bvh", "-o", "out.json", "--for", program).code == 0
    found, lasts = PlainBvh("out.bvh"), np.ptp(read_motion("out.json").times)
    assert found.step == pytest.approx(1.0 / fps, rel=1e-6)
    same_ends(found, (source, 15), (source, 40))
    assert abs((len(found.values) - 1) / fps - lasts) <= 0.5 / fps


def test_b_is_the_last_key_for_unreal(run: Run) -> None:
    write_motion("character.glb", SLOW)
    assert run(*ODD, "character.glb@15", "character.glb@40", "-o", "out.glb", "--for", "unreal").code == 0
    found = PlainGltf("out.glb")
    (times,) = {tuple(times) for (times, _) in ((one.ravel(), values) for one, values in found.tracks().values())}
    np.testing.assert_allclose(np.diff(times), 1.0 / 30.0, atol=1e-6)
    assert furthest(found.world(times[-1]), PlainGltf("character.glb").world(40 / FPS)) < 1e-5


# --- what is refused, before any search -----------------------------------------------------------------------------

WORM = Motion(
    Skeleton("worm", ("head", "tail"), (-1, 0), np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -0.1]])),
    np.tile(rot.IDENTITY, (3, 2, 1)),
    np.zeros((3, 3)),
    np.arange(3) / 30.0,
)


def twice_about_one_axis() -> None:
    clip("rig.bvh")
    text = Path("rig.bvh").read_text("utf-8")
    Path("rig.bvh").write_text(text.replace("Xrotation Yrotation Zrotation", "Xrotation Yrotation Xrotation"), "utf-8")


@pytest.mark.parametrize(
    ("make", "options", "said"),
    [
        (lambda: clip("rig.bvh", WORM), ["-o", "out.bvh"], "the joints of rig do not map to human23"),
        (
            lambda: Path("rig.bvh").write_text("HIERARCHY\n"),
            ["-o", "out.bvh"],
            "rig.bvh:2: the hierarchy is incomplete",
        ),
        (lambda: Path("rig.bvh").mkdir(), ["-o", "out.bvh"], "'rig.bvh' is a directory"),
        (lambda: None, ["-o", "out.bvh"], "'rig.bvh' does not exist"),
        (lambda: clip("rig.bvh"), ["-o", "rig.bvh"], "rig.bvh: cannot be written: it is read from"),
        (lambda: clip("rig.bvh"), ["-o", "./rig.bvh"], "rig.bvh: cannot be written: it is read from"),
        (lambda: clip("rig.bvh"), ["-o", "out.json"], "--rig applies to .bvh and .glb files: name one with -o"),
        (lambda: clip("rig.bvh"), ["-o", "out.gif"], "--rig applies to .bvh and .glb files: name one with -o"),
        (twice_about_one_axis, ["-o", "out.bvh"], "turns about one axis twice (XYX), which cannot be written"),
        (lambda: clip("rig.bvh"), ["-o", "out.glb", "--for", "maya"], "out.glb: not for Maya: it reads no glTF"),
    ],
)
def test_rigs_that_cannot_be_are_refused_in_one_line(
    make: Callable[[], object], options: list[str], said: str, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    make()
    before = {path: path.read_bytes() for path in Path().glob("*.*") if path.is_file()}

    def search(*_: Any, **__: Any) -> None:
        raise AssertionError("the search began")

    monkeypatch.setattr(Engine, "alternatives", search)
    ran = run(*TWEEN, "ballet/fifth", "ballet/arabesque", "--rig", "rig.bvh", *options)
    assert ran.code == 2
    *_, fault = ran.err.splitlines()
    assert ran.err.count("error: ") == 1
    assert said in fault
    assert {path: path.read_bytes() for path in Path().glob("*.*") if path.is_file()} == before


def test_an_animal_is_not_brought_onto_a_person(run: Run) -> None:
    clip("rig.bvh")
    ran = run("tween", "walk-hexapod/stand", "walk-hexapod/stride", "--rig", "rig.bvh", "-o", "out.bvh")
    assert (ran.code, "the joints of hexapod do not map to human23" in ran.err) == (2, True)
    ran = run("convert", "walk-hexapod/tripod", "out.bvh", "--rig", "rig.bvh")
    assert (ran.code, "the joints of hexapod do not map to human23" in ran.err) == (2, True)
    assert not Path("out.bvh").exists()


def test_an_animal_stays_on_the_rig_of_its_file(run: Run) -> None:
    assert run("convert", "walk-hexapod/tripod", "in.bvh").code == 0
    source = PlainBvh("in.bvh")
    ran = run("tween", "in.bvh@3", "in.bvh@9", "--corpus", "walk-hexapod", "-o", "out.bvh")
    assert ran.code == 0, ran.err
    assert PlainBvh("out.bvh").hierarchy == source.hierarchy
    same_ends(PlainBvh("out.bvh"), (source, 3), (source, 9))


def test_a_rig_gives_the_unit(run: Run) -> None:
    clip("rig.bvh")
    ran = run("convert", "ballet/fifth", "out.bvh", "--rig", "rig.bvh", "--out-unit", "m")
    assert (ran.code, ran.err) == (2, "error: --out-unit m: out.bvh gets the unit of rig.bvh\n")


def test_the_rig_is_said_nothing_of_twice(run: Run) -> None:
    clip("rig.bvh", per_metre=1.0 / 0.3)
    ran = run(*TWEEN, "rig.bvh@15", "rig.bvh@40", "-o", "out.bvh")
    assert ran.code == 0, ran.err
    assert len(ran.err.splitlines()) == len({*ran.err.splitlines()})
