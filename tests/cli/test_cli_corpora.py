"""Corpora, postures and formats by commands."""

from __future__ import annotations

import re
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bundled_clips import ballet_clip
from cli_files import FIFTH, PLIE, built, clip, files_under
from command_line import Run

from motionmind.body.motion import Motion
from motionmind.bundled import bundled
from motionmind.errors import MotionMindWarning
from motionmind.formats import read_motion, read_posture, write_motion
from motionmind.geometry import rotations as rot

INFO = {"clips", "postures", "joints", "states", "edges", "facing", "rate", "source", "licence"}


def flipped(frame: int) -> Motion:
    """A clip in which the left hip is half a turn off for one frame."""
    motion = clip(fps=120.0)
    rotations = motion.rotations.copy()
    hip = motion.skeleton.names.index("left_hip")
    rotations[frame, hip] = rot.mul(rotations[frame, hip], np.array([0.0, 1.0, 0.0, 0.0]))
    return replace(motion, rotations=rotations)


# --- corpora ----------------------------------------------------------------------------------------------------------


def test_build_takes_a_mix_and_says_what_it_learned(run: Run, tmp_path: Path) -> None:
    write_motion("walk.bvh", clip("tendus"))
    write_motion("step.json", clip("plies"))
    write_motion("leap.txt", clip("jump"))
    ran = run("corpus", "build", "mine", "walk.bvh", "step.json", "leap.txt", "--rate", 5, "--licence", "CC0")
    assert ran.code == 0
    assert ran.err == "note: walk.bvh: one unit taken as 0.01 m (cm), by the height of the body\n"
    assert re.match(r"mine: 3 clips, \d+ postures \(5 a second\), walk\n\d", ran.out)
    assert re.search(r"\d+\.\d% of 2000 random pairs of postures can be joined without a bridge\n", ran.out)
    assert ran.out.endswith(f"built {tmp_path / 'home' / 'corpora' / 'mine'}\n")
    info = run("corpus", "info", "mine", "--json").json
    assert set(info) >= INFO
    assert [entry["name"] for entry in info["clips"]] == ["walk", "step", "leap"]
    assert info["postures"] == sum(entry["postures"] for entry in info["clips"])
    assert (info["rate"], info["facing"], info["licence"]) == (5.0, "free", "CC0")
    assert list(info["states"]) == list(info["edges"]) == [*info["joints"], "facing"]
    check = run("corpus", "check", "mine", "--json", "--pairs", 50, "--seed", 3).json
    assert set(check) >= INFO | {"joinable", "out_degree", "faults"}
    assert (check["pairs"], check["seed"]) == (50, 3)
    assert 0.0 <= check["joinable"] <= 1.0
    assert list(check["out_degree"]) == list(info["states"])
    assert run("tween", FIFTH, PLIE, "--corpus", "mine").code == 0
    assert "licence    CC0\n" in run("corpus", "info", "mine").out


def test_the_home_is_an_option_too(run: Run, tmp_path: Path) -> None:
    write_motion("walk.bvh", clip())
    assert run("corpus", "build", "mine", "walk.bvh", "--home", "other").code == 0
    assert (tmp_path / "other" / "corpora" / "mine").is_dir()
    assert not (tmp_path / "home").exists()
    assert {"ballet", "mine"} <= {entry["name"] for entry in run("corpus", "list", "--home", "other", "--json").json}
    assert "mine" not in run("corpus", "list").out


@pytest.mark.parametrize("kind", ["codebook", "quaternion", "euler", "human23"])
def test_every_kind_of_discretization(kind: str, run: Run) -> None:
    write_motion("walk.bvh", clip())
    states = built(run, "walk.bvh", "--rate", 10, "--discretize", kind)["states"]
    assert sum(states.values()) > len(states)


def test_tolerances_for_all_joints_and_for_single_ones(run: Run) -> None:
    write_motion("walk.bvh", clip())
    coarse = built(run, "walk.bvh", "--tolerance", 40)["states"]
    mixed = built(run, "walk.bvh", "--tolerance", "left_hip=5", "--tolerance", 40, "--tolerance", "knee=10")["states"]
    finer = {joint for joint in coarse if mixed[joint] > coarse[joint]}
    assert finer == {"left_hip", "left_knee", "right_knee"}


def test_skip_facing_and_keyframes(run: Run) -> None:
    write_motion("walk.bvh", clip())
    frames = len(clip())
    found = built(run, "walk.bvh", "--skip", 4, "--facing", "stage", "--rate", 30)
    assert found["postures"] == frames - 4
    assert found["rate"] == 30.0
    assert "facing" not in found["states"]


@pytest.mark.parametrize("suffix", [".bvh", ".json", ".npz"])
def test_what_compose_writes_is_left_as_it_is_and_a_recording_is_not(run: Run, suffix: str) -> None:
    score = bundled("corpora") / "ballet" / "allegro.score"
    assert run("compose", score, "--clip", "sissonnes", "-o", f"score{suffix}").code == 0
    keyframes = read_motion(f"score{suffix}")
    assert built(run, f"score{suffix}")["postures"] == len(keyframes)
    write_motion("film.bvh", clip(fps=120.0))
    ran = run("corpus", "build", "mine", f"score{suffix}", "film.bvh", "--unit", "cm", "--replace")
    assert ran.err.count("note: corpus mine: 5 postures a second of each recording") == 1
    found = run("corpus", "info", "mine", "--json").json
    assert [one["postures"] for one in found["clips"]] == [len(keyframes), len(clip(fps=5.0))]
    assert found["rate"] == 5.0


@pytest.mark.parametrize("suffix", [".bvh", ".npz"])
def test_the_clock_of_a_file_can_be_set_right(run: Run, suffix: str) -> None:
    write_motion(f"late{suffix}", clip(fps=30.0))
    assert run("convert", f"late{suffix}", "right.json", "--source-fps", 60).code == 0
    late, right = read_motion(f"late{suffix}"), read_motion("right.json")
    np.testing.assert_allclose(right.times, late.times / 2.0, atol=1e-9)
    assert len(right) == len(late)


@pytest.mark.parametrize("suffix", [".bvh", ".npz"])
def test_which_axis_is_up_can_be_said(run: Run, suffix: str) -> None:
    write_motion(f"a{suffix}", clip(fps=30.0))
    up = read_motion(f"a{suffix}").root
    said, other = ("z", "y") if suffix == ".bvh" else ("y", "z")
    assert run("convert", f"a{suffix}", "said.json", "--up", said, "--skeleton", "human23").code == 0
    turned = up[:, [0, 2, 1]] * ([1.0, 1.0, -1.0] if said == "z" else [1.0, -1.0, 1.0])
    np.testing.assert_allclose(read_motion("said.json").root, turned, atol=1e-6)
    assert run("corpus", "build", "mine", f"a{suffix}", "--up", other).code == 0
    ran = run("convert", f"a{suffix}", "x.json", "--up", "x")
    assert ran.code == 2
    assert "'x' is not one of 'y', 'z'" in ran.err


def test_what_is_wrong_with_a_recording_is_said_as_it_is_read(run: Run) -> None:
    film = ballet_clip("adagio").resample(30.0)
    root = film.root + np.array([0.0, -0.1, 0.0])
    root[50:53] += [0.0, 0.0, 7.0]
    write_motion("film.bvh", replace(film, root=root))
    said = run("convert", "film.bvh", "film.json", "--unit", "cm").err
    assert "note: film.bvh: 3 frames have the whole body elsewhere, or zeros (frames 50-52)\n" in said
    assert re.search(r"note: film.bvh: the floor under its feet is 1\d cm below 0\n", said)
    assert "seems to play" not in said


def test_flips_are_repaired_kept_or_dropped(run: Run) -> None:
    write_motion("jump.bvh", flipped(60))
    write_motion("plain.bvh", clip(fps=120.0))
    names = {
        flips: [entry["name"] for entry in built(run, "jump.bvh", "plain.bvh", "--flips", flips)["clips"]]
        for flips in ("repair", "keep", "drop")
    }
    assert names == {"repair": ["jump", "plain"], "keep": ["jump", "plain"], "drop": ["plain"]}
    found = built(run, "jump.bvh", "plain.bvh")
    assert {tuple(fault[key] for key in ("clip", "joint", "frame", "repair")) for fault in found["faults"]} == {
        ("jump", "left_hip", 60, "reconstructed"),
        ("jump", "left_hip", 61, "reconstructed"),
    }
    assert found["repairs"] == [{"clip": "jump", "joint": "left_hip", "start": 60, "stop": 61, "exact": False}]
    said = run("corpus", "check", "mine").out
    flips = "1 recording with joints that turn too far in one frame, 2 flips, 1 frame reconstructed"
    assert said.endswith(f"\n{flips} (--details lists them)\n")
    said = run("corpus", "check", "mine", "--details").out
    assert said.endswith(f"\n{flips}:\n  jump: 2 flips, 1 frame reconstructed (left_hip)\n")
    assert "repaired   1 clip, 0 stretches put back exactly, 1 reconstructed\n" in run("corpus", "info", "mine").out
    mixed = run("corpus", "build", "mixed", "--mix", "mine", "jump.bvh").out
    assert f"{flips} (--details lists them)" in mixed  # of its own recordings, and none of those that are mixed
    assert built(run, "jump.bvh", "plain.bvh", "--flip-angle", 180)["faults"] == []


def test_clips_are_named_so_that_they_can_be_told_apart(run: Run) -> None:
    for name in ("one/walk.bvh", "two/walk.bvh", "two/run.bvh", "two/run.json"):
        Path(name).parent.mkdir(exist_ok=True)
        write_motion(name, clip())
    found = built(run, "one/walk.bvh", "two/walk.bvh", "two/run.bvh", "two/run.json")
    assert [entry["name"] for entry in found["clips"]] == ["one/walk", "two/walk", "run.bvh", "run.json"]


def test_a_mapping_of_joints_brings_a_stranger_to_human23(run: Run) -> None:
    body = clip().skeleton
    stranger = replace(body, name="stranger", names=tuple(f"J{i}" for i in range(len(body))))
    write_motion("walk.bvh", replace(clip(), skeleton=stranger))
    assert built(run, "walk.bvh")["joints"][0] == "J0"
    Path("map.toml").write_text("".join(f'J{i} = "{name}"\n' for i, name in enumerate(body.names)), "utf-8")
    assert built(run, "walk.bvh", "--joints", "map.toml")["joints"] == list(body.names)
    assert "human23 (23 joints)" in run("posture", "walk.bvh", "--frame", 3, "-o", "A.json", "--joints", "map.toml").out
    assert read_posture("A.json").skeleton.name == "human23"


@pytest.mark.parametrize("suffix", [".json", ".bvh", ".glb"])
def test_a_tween_among_recordings_is_told(run: Run, suffix: str) -> None:
    write_motion("walk.bvh", clip())
    assert run("tween", "ballet/arabesque", "ballet/fifth", "-o", f"tween{suffix}").code == 0
    told = "hold movement that the engine made"
    ran = run("corpus", "build", "mine", "walk.bvh", f"tween{suffix}")
    assert f"1 of 2 recordings {told}, learned as if it were recorded: tween" in ran.err
    assert told not in run("corpus", "build", "mine", "walk.bvh", "--replace").err


def test_a_corpus_of_the_same_name_is_replaced_only_on_demand_and_comes_back(run: Run, tmp_path: Path) -> None:
    write_motion("walk.bvh", clip())
    write_motion("step.bvh", clip("plies"))
    build = ("corpus", "build", "mine")

    def clips() -> list[str]:
        assert [entry["name"] for entry in run("corpus", "list", "--json").json].count("mine") == 1
        return [entry["name"] for entry in run("corpus", "info", "mine", "--json").json["clips"]]

    assert run(*build, "walk.bvh", "step.bvh").code == 0
    before = files_under(tmp_path)
    ran = run(*build, "step.bvh")
    refusal = r"error: you have a corpus 'mine' already \(2 clips, [-0-9]{10} [:0-9]{5}\); --replace replaces it\n"
    assert (ran.code, ran.out) == (2, "")
    assert re.fullmatch(refusal, ran.err), ran.err
    assert run(*build, "nothing.bvh", "--replace").code == 2
    assert files_under(tmp_path) == before
    kept = "note: corpus restore mine brings back the replaced corpus (2 clips), until the next change\n"
    assert kept in run(*build, "step.bvh", "--rate", 5, "--replace").err
    assert clips() == ["step"]
    assert run("corpus", "restore", "mine").out == f"restored {tmp_path / 'home' / 'corpora' / 'mine'} (2 clips)\n"
    assert clips() == ["walk", "step"]
    assert "note: corpus restore mine brings back" in run("corpus", "remove", "mine", "walk").err
    assert clips() == ["step"]
    assert run("corpus", "restore", "mine").code == 0
    assert clips() == ["walk", "step"]


def test_a_corpus_is_renamed_and_deleted(run: Run, tmp_path: Path) -> None:
    write_motion("walk.bvh", clip())
    built(run, "walk.bvh")
    place = tmp_path / "home" / "corpora"
    assert run("corpus", "rename", "mine", "walks").out == f"renamed mine to {place / 'walks'}\n"
    assert run("corpus", "info", "walks").out.startswith("name       walks\n")
    ran = run("corpus", "delete", "walks")
    assert (ran.code, ran.err) == (2, f"error: {place / 'walks'}: would be deleted for good; say --yes\n")
    assert run("corpus", "delete", "walks", "--yes").out == f"deleted {place / 'walks'}\n"
    assert list(place.iterdir()) == []
    (left := tmp_path / "home" / "shards" / "broken-off" / "3f").mkdir(parents=True)
    assert run("corpus", "delete", "broken-off", "--yes").out == f"deleted {left.parent}\n"
    assert not left.parents[1].exists()
    for words in (("delete", "ballet", "--yes"), ("rename", "ballet", "mine"), ("delete", "walks", "--yes")):
        assert run("corpus", *words).code == 2


def test_what_cannot_be_read_is_listed_as_such(run: Run, tmp_path: Path) -> None:
    folder = tmp_path / "home" / "corpora" / "torn"
    folder.mkdir(parents=True)
    (folder / "manifest.json").write_text("{", "utf-8")
    ran = run("corpus", "list")
    assert ran.code == 0
    assert re.search(r"^torn +cannot be read", ran.out, re.MULTILINE)
    assert ran.err.startswith("note: ")


# --- postures and formats ---------------------------------------------------------------------------------------------


def test_posture_takes_one_frame(run: Run) -> None:
    write_motion("walk.bvh", clip())
    ran = run("posture", "walk.bvh", "--frame", -2, "-o", "A.json")
    assert ran.out == f"A.json: frame {len(clip()) - 2} of {len(clip())}, on walk (23 joints)\n"
    assert np.allclose(rot.angle(read_posture("A.json").rotations, clip().rotations[-2]), 0.0, atol=1e-6)


@pytest.mark.parametrize("suffix", ["bvh", "json", "txt"])
def test_convert_between_all_formats(suffix: str, run: Run) -> None:
    write_motion(f"in.{suffix}", clip())
    for out in ("bvh", "json", "txt"):
        ran = run("convert", f"in.{suffix}", f"out.{out}")
        assert ran.code == 0
        assert ran.out.startswith(f"out.{out}: {len(clip())} frames, 23 joints")
        assert np.allclose(rot.angle(read_motion(f"out.{out}").rotations, clip().rotations), 0.0, atol=1e-4)


def test_convert_resamples_and_takes_units(run: Run) -> None:
    write_motion("in.bvh", clip())
    assert run("convert", "in.bvh", "out.json", "--fps", 10).code == 0
    assert read_motion("out.json").fps == pytest.approx(10.0)
    for unit, factor in (("mm", 0.1), ("cm", 1.0), ("0.02", 2.0)):
        ran = run("convert", "in.bvh", "out.json", "--unit", unit)
        said = r"note: in.bvh: a person (0\.17|3\.4) m tall; the unit seems wrong \(--unit gives another\)\n"
        assert re.fullmatch("" if unit == "cm" else said, ran.err)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MotionMindWarning)  # of that height, again
            read = read_motion("out.json")
        assert read.root[0, 1] == pytest.approx(clip().root[0, 1] * factor, abs=1e-5)


def test_recordings(run: Run, shared_data: Path, tmp_path: Path) -> None:
    amc = shared_data / "cmu-135" / "135_04.amc"
    assert run("convert", amc, "out.bvh", "--skeleton", "human23", "--fps", 30).code == 0
    assert len(read_motion("out.bvh").skeleton) == 23
    (tmp_path / "lone.amc").write_bytes(amc.read_bytes())
    assert "its skeleton, an .asf file, was not found" in run("convert", "lone.amc", "out.json").err
    asf = shared_data / "cmu-135" / "135.asf"
    assert run("convert", "lone.amc", "out.json", "--asf", asf).code == 0
    recordings = [amc, shared_data / "bandai" / "kick_normal_001.bvh", shared_data / "cmu-05" / "05_01.bvh"]
    found = built(run, *recordings, "--rate", 5, "--skip", 1)
    assert found["joints"] == list(clip().skeleton.names)
    for end, source, frame in (("A", recordings[2], 100), ("B", recordings[1], 30)):
        assert run("posture", source, "--frame", frame, "-o", f"{end}.json").code == 0
    assert run("tween", "A.json", "B.json", "--corpus", "mine", "-o", "tween.bvh").code == 0
    truncated = shared_data / "importer" / "cmu_kick_truncated.bvh"
    before = files_under(tmp_path)
    ran = run("corpus", "build", "mine", recordings[2], truncated, "--strict-files", "--replace")
    assert ran.code == 2
    assert re.search(r"error: \S+cmu_kick_truncated\.bvh:\d+: ", ran.err)
    assert files_under(tmp_path) == before
