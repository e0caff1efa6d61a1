"""The command line as a user meets it: output, files, exit codes, and answers to bad input."""

from __future__ import annotations

import json
import logging
import os
import re
import signal
import subprocess
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bundled_clips import ballet_clip
from command_line import Run

from motionmind.body.motion import Motion
from motionmind.bundled import bundled
from motionmind.cli.printing import print_tween
from motionmind.formats import read_motion, read_posture, write_motion
from motionmind.geometry import rotations as rot
from motionmind.tween.engine import Engine
from motionmind.variation.variation_json import read_variation

BALLET = Path(__file__).parents[2] / "corpora" / "ballet"
ARABESQUE, FIFTH, PLIE = (BALLET / "postures" / f"{name}.json" for name in ("arabesque", "fifth", "plie"))
REPORT = {
    *("asked", "status", "cost", "lower_bound", "gap", "moves", "length", "tempo"),
    *("expansions", "peak_nodes", "node_budget", "seconds", "joints", "path"),
    *("attested", "bridges", "waits", "differs", "what_if", "vias", "snap_degrees", "path_degrees", "followed"),
    *("sources", "detail", "left_out", "shown", "times", "names", "degrees", "likelihood", "costs", "credits"),
    "motion_sha256",
}
INFO = {"clips", "postures", "joints", "states", "edges", "facing", "rate", "source", "licence"}


def start(*arguments: object, cwd: Path, stdout: int = subprocess.PIPE) -> subprocess.Popen[str]:
    """The command line in a process of its own, which heeds interrupts even if the tests run in the background."""
    program = (
        "import runpy, signal\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "runpy.run_module('motionmind', run_name='__main__')\n"
    )
    return subprocess.Popen(
        [sys.executable, "-c", program, *map(str, arguments)],
        cwd=cwd,
        env={**os.environ, "MOTIONMIND_HOME": str(cwd / "home")},
        stdout=stdout,
        stderr=subprocess.PIPE,
        text=True,
    )


def clip(name: str = "jump", fps: float = 30.0) -> Motion:
    """A clip of the bundled corpus, with even frames."""
    return ballet_clip(name).resample(fps)


def flipped(frame: int) -> Motion:
    """A clip in which the left hip is half a turn off for one frame."""
    motion = clip(fps=120.0)
    rotations = motion.rotations.copy()
    hip = motion.skeleton.names.index("left_hip")
    rotations[frame, hip] = rot.mul(rotations[frame, hip], np.array([0.0, 1.0, 0.0, 0.0]))
    return replace(motion, rotations=rotations)


def files_under(folder: Path) -> dict[str, bytes]:
    return {str(path): path.read_bytes() if path.is_file() else b"" for path in sorted(folder.rglob("*"))}


# --- tween ----------------------------------------------------------------------------------------------------------


def test_tween_prints_a_table_and_writes_what_was_asked_for(run: Run) -> None:
    ran = run(
        *("tween", ARABESQUE, FIFTH, "--corpus", "ballet", "-o", "tween.bvh", "-o", "again.json", "--details"),
        *("--report", "report.json", "--problem", "problem.cfn", "--fps", "50"),
    )
    assert ran.code == 0
    assert "note: tween.bvh: no place for the marks of frames that the engine made (" in ran.err
    assert "note: tween.bvh: in Blender's import, set Scale to 0.01" in ran.err
    assert ran.err.count("\n") == 2
    report = json.loads(Path("report.json").read_text("utf-8"))
    table = {line.split()[0]: line for line in ran.out.splitlines()}
    table.pop("beware", None)  # where it goes beyond the corpus
    assert list(table) == [
        "7",
        "moves",
        "pace",
        "cost",
        "proven",
        "attested",
        "bridged",
        "waited",
        "A",
        "B",
        "motion",
        "written",
    ]
    assert f" {report['moves']}, in " in table["moves"]
    assert f"{report['cost']:.3f}" in table["cost"]
    assert f"{report['lower_bound']:.3f}, gap {report['gap']:.2%}" in table["proven"]
    assert table["written"].endswith("tween.bvh, again.json, report.json, problem.cfn")
    assert len(read_motion("again.json")) == len(read_motion("tween.bvh"))
    motion = read_motion("tween.bvh")
    assert motion.fps == pytest.approx(50.0)
    assert np.allclose(rot.angle(motion.rotations[-1], read_posture(FIFTH).rotations), 0.0, atol=1e-6)
    problem = json.loads(Path("problem.cfn").read_text("utf-8"))
    assert {"problem", "variables", "functions"} <= set(problem)


def test_a_tween_is_told_in_plain_words_and_that_nothing_is_written(run: Run) -> None:
    ran = run("tween", ARABESQUE, FIFTH, "--corpus", "ballet")
    assert ran.out.splitlines() == [
        "7 moves in 2.7 s, every one seen in ballet; proven the best of its kind; the left foot stays in place",
        "written   nothing: name a file by -o",
    ]


@pytest.mark.parametrize(
    "line",
    [
        "sheet ballet/fifth -o a.png -o b.png",
        "graph --corpus ballet --joint left_hip -o a.svg -o b.svg",
        "postures ballet -o a.png -o b.png",
    ],
)
def test_a_second_file_is_not_ignored(line: str, run: Run, tmp_path: Path) -> None:
    ran = run(*line.split())
    assert ran.code == 2
    assert "-o is given 2 times, and one file is written; give it once" in ran.err
    assert not list(tmp_path.iterdir())


def test_several_files_are_written_or_none(run: Run, tmp_path: Path) -> None:
    write_motion("clip.json", clip())
    score = BALLET / "allegro.score"
    for words in (
        ("posture", "clip.json@3", "-o", "a.json", "-o", "a.png"),
        ("render", "clip.json@3", "-o", "r.svg", "-o", "r.png"),
        ("compose", score, "--clip", "jump", "-o", "c.json", "-o", "c.npz", "--fps", 30),
        ("vary", "clip.json", "-o", "v.json", "-o", "v.bvh", "--length", 9),
    ):
        ran = run(*words)
        assert ran.code == 0, ran.err
        assert all(Path(word).stat().st_size for before, word in pairwise(map(str, words)) if before == "-o")
    assert run("posture", "clip.json@3", "-o", "x.json", "-o", "nowhere/x.png").code == 2
    assert not (tmp_path / "x.json").exists()


def test_what_must_be_even_in_time_is_made_so_and_said(run: Run) -> None:
    uneven = replace(clip("jump"), times=clip("jump").times ** 1.1)
    write_motion("uneven.json", uneven)
    Path("halt.score").write_text(
        f"title Halt\ninclude {BALLET / 'vocabulary.score'}\nclip halt: Unevenly\n"
        "  start | first | bas | upright | front\n  1 | second | second\n  3 | first | bas\n",
        "utf-8",
    )
    for words in (("convert", "uneven.json", "{}"), ("compose", "halt.score", "-o", "{}")):
        for suffix in ("bvh", "npz"):
            file = f"out.{suffix}"
            ran = run(*(word.format(file) for word in words))
            assert ran.code == 0, ran.err
            frames = len(read_motion(file))
            assert re.search(
                rf"note: {file}: its frames must be even in time, so \d+ are made {frames}, 30 a second", ran.err
            )
            again = run(*(word.format(file) for word in words), "--fps", 10)
            assert "must be even" not in again.err
    ran = run("convert", "uneven.json", "kept.json")
    assert "even" not in ran.err
    assert len(read_motion("kept.json")) == len(uneven)


def test_a_posture_among_the_clips_is_noticed(run: Run) -> None:
    write_motion("walk.json", clip(fps=30.0))
    Path("A.json").write_bytes(ARABESQUE.read_bytes())
    for skip in (0, 1):
        ran = run("corpus", "build", "mine", "A.json", "walk.json", "--skip", skip)
        assert ran.code == 0
        end = "; left out" if skip else ""
        assert f"note: A.json: holds one posture, and no move to learn from{end}\n" in ran.err


def test_a_recording_is_varied_as_the_corpus_learned_it(run: Run) -> None:
    """At the corpus's rate, and without the T-pose that was dropped when it was built."""
    write_motion("clip.bvh", clip(fps=30.0))
    assert run("corpus", "build", "mine", "clip.bvh", "--rate", 6, "--skip", 1).code == 0
    vary = ("vary", "clip.bvh", "--corpus", "mine", "--nudge", 0, "-o", "v.json")
    ran = run(*vary)
    assert "note: clip.bvh: begins at frame 1, as the recordings of mine do (--from 0 for all of it)\n" in ran.err
    learned, piece = Engine.load("mine").corpus, read_variation("v.json").piece
    assert len(learned.rotations) == len(piece)
    assert rot.angle(piece.motion.rotations[piece.frames], learned.rotations).max() < 1e-6
    for words in (("--from", 0), ("--from", 1)):
        assert "begins at frame" not in run(*vary, *words).err
    assert run("corpus", "build", "mine", "clip.bvh", "--rate", 6).code == 0
    assert "begins at frame" not in run(*vary).err


def test_review_says_which_file_it_wants(run: Run) -> None:
    write_motion("clip.json", clip(fps=10.0))
    assert run("vary", "clip.json", "-o", "v.bvh", "-o", "w.bvh", "-o", "w.json").code == 0
    for file, hint in (("v.bvh", ""), ("w.bvh", "; did you mean w.json?")):
        ran = run("review", file)
        assert (ran.code, ran.out) == (2, "")
        assert ran.err == f"error: {file}: holds movement alone; a variation is the .json that vary wrote{hint}\n"


def test_of_many_warnings_a_few_are_printed(run: Run) -> None:
    posture = json.loads(ARABESQUE.read_text("utf-8"))
    posture["rotations"]["left_hip"] = [2.0 * number for number in posture["rotations"]["left_hip"]]
    frame = [posture["rotations"][joint] for joint in clip().skeleton.names]
    motion = {"format": "motionmind-motion", "version": 1, "skeleton": "human23", "times": [0.0, 0.2]}
    motion |= {"root": [posture["root"]] * 2, "rotations": [frame] * 2}
    for number in range(9):
        Path(f"take{number}.json").write_text(json.dumps(motion), "utf-8")
    takes = [f"take{number}.json" for number in range(9)]
    few, all_of_them = (run("corpus", "build", "mine", *takes, *more).err.splitlines() for more in ((), ["--details"]))
    assert few == [*all_of_them[:3], "note: 6 more warnings like these (--details prints them)"]
    assert len(all_of_them) == 9


def test_a_tween_says_what_a_viewer_sees_beyond_the_corpus(capsys: pytest.CaptureFixture[str]) -> None:
    engine = Engine.load("ballet")
    motion = engine.corpus.motion(engine.corpus.clips[0])
    tween = engine.tween(motion.posture(0), motion.posture(1))
    print_tween(tween, [])
    assert not [line for line in capsys.readouterr().out.splitlines() if line.startswith("beware")]
    away = np.linspace(0.0, 9.0, len(tween.motion))[:, None] * [1.0, 0.0, 0.0]
    carried = replace(tween, motion=replace(tween.motion, root=tween.motion.root + away))
    print_tween(carried, [])
    (line,) = (line for line in capsys.readouterr().out.splitlines() if line.startswith("beware"))
    pace = carried.report()["shown"]["pace"]
    assert line.startswith(f"beware    travel is {pace['value']:.1f} times as fast as")
    assert line.endswith(f"more than {pace['most']:.1f} times")


def test_the_report_has_the_keys_that_are_promised(run: Run) -> None:
    report = run("tween", ARABESQUE, FIFTH, "--corpus", "ballet", "--report", "-").json
    assert set(report) == REPORT
    assert report["status"] == "optimal"
    assert report["lower_bound"] <= report["cost"] + 1e-6
    assert set(report["seconds"]) == {"load", "problem", "bound", "search", "realise"}
    moves, joints = report["moves"], len(report["joints"])
    assert np.shape(report["path"]) == (moves + 1, joints)
    assert [len(row) for row in report["sources"]] == [joints] * moves
    assert {end: list(row) for end, row in report["snap_degrees"].items()} == dict.fromkeys("AB", report["joints"])


def test_the_printed_report_is_alone_on_standard_output(run: Run, tmp_path: Path) -> None:
    posture = json.loads(ARABESQUE.read_text("utf-8"))
    posture["rotations"]["left_hip"] = [2.0 * number for number in posture["rotations"]["left_hip"]]
    Path("A.json").write_text(json.dumps(posture), "utf-8")
    process = start("tween", "A.json", FIFTH, "--corpus", "ballet", "--report", "-", "-o", "tween.json", cwd=tmp_path)
    out, err = process.communicate()
    assert process.returncode == 0
    assert set(json.loads(out)) == REPORT
    assert out.count("\n") == 1
    assert re.fullmatch(r"note: A\.json: the rotation of left_hip has length 2, not 1; made 1\n", err)
    assert len(read_motion("tween.json").insertions[0].times) > 2


def test_options_reach_the_search(run: Run) -> None:
    def report(*options: object) -> Any:
        return run("tween", PLIE, ARABESQUE, "--corpus", "ballet", "--report", "-", *options).json

    usual = report()
    assert report("--moves", usual["moves"] + 2)["moves"] == usual["moves"] + 2
    assert report("--max-moves", usual["moves"])["moves"] == usual["moves"]
    assert report("--node-budget", 7)["node_budget"] == 7
    assert report("--tau", 0)["cost"] == pytest.approx(usual["cost"] - usual["moves"], abs=1e-6)
    for option in (("--weights", "printed"), ("--lambda", 0.5), ("--beta", 0)):
        assert report(*option)["cost"] != pytest.approx(usual["cost"], abs=1e-6), option


def test_strict_without_a_path_answers_3_with_the_diagnosis(run: Run, tmp_path: Path) -> None:
    ran = run("tween", ARABESQUE, FIFTH, "--corpus", "ballet", "--strict", "--max-moves", 1, "-o", "tween.bvh")
    assert ran.code == 3
    assert ran.out == ""
    assert ran.err.startswith("error: no path from A to B in at most 1 move")
    assert re.search(r"^  left_shoulder needs \d+ moves", ran.err, re.MULTILINE)
    assert not list(tmp_path.iterdir())


def test_from_a_posture_to_itself_there_is_nothing_to_do(run: Run) -> None:
    ran = run("tween", FIFTH, FIFTH, "--corpus", "ballet", "-o", "tween.bvh", "--report", "-")
    assert ran.code == 0
    assert (ran.json["moves"], ran.json["cost"], ran.json["status"]) == (0, 0.0, "optimal")
    assert len(read_motion("tween.bvh")) == 1


# --- corpora --------------------------------------------------------------------------------------------------------


def built(run: Run, *arguments: object, name: str = "mine") -> Any:
    """What there is to know of a corpus that is built with these arguments."""
    ran = run("corpus", "build", name, *arguments)
    assert ran.code == 0, ran.err
    return run("corpus", "check", name, "--json", "--pairs", 50).json


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
    ran = run("corpus", "build", "mine", f"score{suffix}", "film.bvh", "--unit", "cm")
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


def test_a_corpus_of_the_same_name_is_replaced(run: Run) -> None:
    write_motion("walk.bvh", clip())
    write_motion("step.bvh", clip("plies"))
    assert [entry["name"] for entry in built(run, "walk.bvh")["clips"]] == ["walk"]
    assert [entry["name"] for entry in built(run, "step.bvh", "--rate", 5)["clips"]] == ["step"]


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


# --- postures and formats -------------------------------------------------------------------------------------------


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
        assert ran.err == ""
        assert read_motion("out.json").root[0, 1] == pytest.approx(clip().root[0, 1] * factor, abs=1e-5)


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
    ran = run("corpus", "build", "mine", recordings[2], truncated, "--strict-files")
    assert ran.code == 2
    assert re.search(r"error: \S+cmu_kick_truncated\.bvh:\d+: ", ran.err)
    assert files_under(tmp_path) == before


# --- bad input ------------------------------------------------------------------------------------------------------

TWEEN = "tween A.json B.json --corpus ballet -o tween.bvh"
BUILD = "corpus build mine clip.bvh"
BAD = [
    # what is there to read
    ("tween nan.json B.json --corpus ballet -o t.bvh", r"nan\.json:\d+: NaN is not a number"),
    ("tween zero.json B.json --corpus ballet -o t.bvh", r"zero\.json: the rotation of left_hip is zero"),
    ("tween missing.json B.json --corpus ballet", r"missing\.json: rotations: no left_hip"),
    ("tween A.json binary.json --corpus ballet", r"binary\.json:1: not valid JSON"),
    ("tween A.json empty.bvh --corpus ballet", r"empty\.bvh:1: not a BVH file"),
    ("tween A.json folder --corpus ballet", r"folder: is a folder, and no corpus"),
    ("tween A.json nowhere.json --corpus ballet", r"nowhere\.json: cannot be read: there is no such file"),
    ("tween A.json clip.bvh --corpus ballet", r"clip\.bvh: \d+ frames, where one posture was expected"),
    ("tween stranger.bvh B.json --corpus ballet", r"posture A is on another skeleton than corpus 'ballet': "),
    ("posture clip.bvh --frame 9999 -o t.json", r"clip\.bvh: frames are 0 to \d+, there is no frame 9999"),
    ("posture empty.bvh --frame 0 -o t.json", r"empty\.bvh:1: not a BVH file"),
    ("convert cut.bvh t.json", r"cut\.bvh:\d+: "),
    ("convert binary.bvh t.json", r"binary\.bvh:1: not a BVH file"),
    ("convert stranger.bvh t.json --skeleton human23", r"stranger"),
    ("convert clip.xyz t.json", r"suffix '\.xyz' is unknown; files that can be read end in \.json, \.bvh"),
    # corpora
    ("tween A.json B.json --corpus nobody", r"no corpus 'nobody'; there are ballet"),
    ("corpus info balet", r"no corpus 'balet'; did you mean ballet\?"),
    (f"{TWEEN} --pin left_hop", r"no joint 'left_hop' among the states; did you mean left_hip\?"),
    (f"{TWEEN} --avoid lft_hip=3", r"no joint 'lft_hip' among the states; did you mean left_hip\?"),
    ("vary ballet/jump --attractor rosler -o t.json", r"no flow 'rosler'; did you mean rossler\?"),
    ("vary ballet/jump --parameter roh=3 -o t.json", r"lorenz has no parameter 'roh'; did you mean rho\?"),
    (f"{BUILD} --discretize balet", r"no library 'balet'; did you mean ballet\?"),
    ("corpus info nobody", r"no corpus 'nobody'; there are ballet"),
    ("corpus list --home A.json", r"'A\.json' is a file"),
    ("corpus build mine", r"Missing argument 'FILES\.\.\.'"),
    ("corpus build mine one.json", r"no recording holds two postures"),
    ("corpus build mine clip.bvh cut.bvh --strict-files", r"cut\.bvh:\d+: "),
    ("corpus build mine clip.bvh stranger.bvh", r"stranger is on another skeleton than clip: "),
    ("corpus build mine clip.bvh folder", r"'folder' is a directory"),
    ("corpus build mine clip.bvh ./clip.bvh", r"clip\.bvh: given twice"),
    ("corpus build ballet clip.bvh", r"'ballet' is the name of a bundled corpus"),
    ("corpus build a/b clip.bvh", r"'a/b' cannot be a corpus's name"),
    (f"{BUILD} --rate -5", r"'--rate': -5\.0 is not in the range"),
    (f"{BUILD} --rate 0.01", r"no recording holds two postures at 0\.01 postures a second"),
    (f"{BUILD} --skip 9999", r"skipping 9999 leaves none"),
    (f"{BUILD} --skip -1", r"'--skip': -1 is not in the range"),
    (f"{BUILD} --tolerance some", r"--tolerance some: give degrees, or JOINT=DEGREES"),
    (f"{BUILD} --tolerance left_hip=", r"--tolerance left_hip=: give degrees, or JOINT=DEGREES"),
    (f"{BUILD} --tolerance =5", r"--tolerance =5: give degrees, or JOINT=DEGREES"),
    (f"{BUILD} --tolerance -3", r"tolerance in degrees must be a number from"),
    (f"{BUILD} --tolerance nan", r"tolerance in degrees must be a number from"),
    (f"{BUILD} --tolerance left_hop=5", r"no joint 'left_hop'.*; did you mean left_hip\?"),
    (f"{BUILD} --discretize nobody", r"no library 'nobody'; .*bundled are ballet, human23"),
    (f"{BUILD} --discretize broken.toml", r"broken\.toml: not TOML"),
    (f"{BUILD} --joints broken.toml", r"broken\.toml: not a joint mapping"),
    (f"{BUILD} --unit parsec", r"unit 'parsec' is unknown; give one of cm, m"),
    (f"{BUILD} --flip-angle nan", r"'--flip-angle': nan is not a finite number"),
    (f"{BUILD} --home A.json/home", r"cannot be written"),
    ("corpus check ballet --pairs 0", r"'--pairs': 0 is not in the range"),
    # what is there to write
    ("tween A.json B.json --corpus ballet -o nowhere/t.bvh", r"nowhere/t\.bvh: cannot be written: there is no folder"),
    ("tween A.json B.json --corpus ballet -o folder", r"'folder' is a directory"),
    ("tween A.json B.json --corpus ballet -o t.xyz", r"t\.xyz: cannot be written: the name must end in one of \.json,"),
    ("tween A.json B.json --corpus ballet --report nowhere/r", r"nowhere/r: cannot be written: there is no folder"),
    ("tween A.json B.json --corpus ballet --problem t.txt", r"t\.txt: cannot be written: the name must end in .*cfn"),
    ("tween A.json B.json --corpus ballet -o t.json --report t.json", r"t\.json: .*: it would be written twice"),
    ("posture clip.bvh --frame 0 -o t.xyz", r"t\.xyz: cannot be written"),
    ("convert clip.bvh t.amc", r"t\.amc: cannot be written: the name must end in one of \.bvh, \.json, \.txt"),
    ("convert clip.bvh nowhere/t.json", r"nowhere/t\.json: cannot be written: there is no folder"),
    # options
    (f"{TWEEN} --moves 0", r"'--moves': '0' is neither a number of moves such as 8"),
    (f"{TWEEN} --max-moves 0", r"'--max-moves': 0 is not in the range x>=1"),
    (f"{TWEEN} --node-budget 0", r"'--node-budget': 0 is not in the range x>=1"),
    (f"{TWEEN} --lambda nan", r"'--lambda': nan is not a finite number"),
    (f"{TWEEN} --beta -1", r"'--beta': -1\.0 is not in the range 0<=x<=1000000\.0"),
    (f"{TWEEN} --tau inf", r"'--tau': inf is not in the range"),
    (f"{TWEEN} --fps 0", r"'--fps': 0\.0 is not in the range"),
    (f"{TWEEN} --fps 1e12", r"'--fps': 1000000000000\.0 is not in the range"),
    (f"{TWEEN} --weights heavy", r"'--weights': 'heavy' is not one of 'conditional', 'printed'"),
    (f"{TWEEN} --foo", r"No such option"),
    ("tween A.json", r"Missing argument 'B'\. \(motionmind tween --help shows how\)"),
    ("tween A.json B.json", r"Missing option '--corpus': no corpus names A or B"),
    ("dance", r"No such command 'dance'"),
]


@pytest.fixture(scope="module")
def bad_files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of files, good ones and bad ones."""
    folder = tmp_path_factory.mktemp("bad")
    (folder / "folder").mkdir()
    posture = json.loads(ARABESQUE.read_text("utf-8"))
    turns = posture["rotations"]
    others = {name: turn for name, turn in turns.items() if name != "left_hip"}
    for name, rotations in {
        "A": turns,
        "nan": {**turns, "left_hip": [float("nan"), 0.0, 0.0, 1.0]},
        "zero": {**turns, "left_hip": [0.0, 0.0, 0.0, 0.0]},
        "missing": others,
    }.items():
        (folder / f"{name}.json").write_text(json.dumps({**posture, "rotations": rotations}), "utf-8")
    (folder / "B.json").write_bytes(FIFTH.read_bytes())
    (folder / "one.json").write_bytes(FIFTH.read_bytes())
    for name in ("binary.json", "binary.bvh"):
        (folder / name).write_bytes(bytes(range(256)) * 9)
    (folder / "empty.bvh").touch()
    (folder / "broken.toml").write_text("hip = [", "utf-8")
    motion = clip()
    write_motion(folder / "clip.bvh", motion)
    text = (folder / "clip.bvh").read_text("utf-8")
    (folder / "cut.bvh").write_text(text[: len(text) - 40], "utf-8")
    names = tuple(f"J{i}" for i in range(len(motion.skeleton)))
    stranger = replace(motion.slice(0, 1), skeleton=replace(motion.skeleton, name="stranger", names=names))
    write_motion(folder / "stranger.bvh", stranger)
    return folder


@pytest.mark.parametrize(("line", "message"), BAD, ids=[line for line, _ in BAD])
def test_bad_input_is_one_line_and_leaves_nothing(
    line: str, message: str, run: Run, bad_files: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(bad_files)
    monkeypatch.setenv("MOTIONMIND_HOME", str(bad_files / "home"))
    before = files_under(bad_files)
    ran = run(*line.split())
    assert ran.code == 2
    assert ran.out == ""
    errors = [text for text in ran.err.splitlines() if not text.startswith("note: ")]
    assert len(errors) == 1
    assert errors[0].startswith("error: ")
    assert re.search(message, errors[0])
    assert files_under(bad_files) == before


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="the administrator may write everywhere")
def test_a_folder_without_permission(run: Run, tmp_path: Path) -> None:
    locked = tmp_path / "locked"
    locked.mkdir(mode=0o500)
    ran = run("tween", ARABESQUE, FIFTH, "--corpus", "ballet", "-o", "locked/tween.bvh")
    assert (ran.code, ran.err) == (2, "error: locked/tween.bvh: cannot be written: not permitted\n")


# --- the shell's side -----------------------------------------------------------------------------------------------


def test_the_exit_code_and_the_error_reach_the_shell(tmp_path: Path) -> None:
    process = start("tween", "A.json", "B.json", "--corpus", "nobody", cwd=tmp_path)
    out, err = process.communicate()
    assert process.returncode == 2
    assert out == ""
    assert re.fullmatch(r"error: no corpus 'nobody'; there are ballet(, [\w-]+)*\n", err)


@pytest.mark.skipif(os.name != "posix", reason="signals and pipes as POSIX has them")
def test_an_interrupt_is_quiet(tmp_path: Path) -> None:
    write_motion(tmp_path / "long.bvh", clip("glissades", fps=240.0))
    process = start("corpus", "build", "mine", "long.bvh", "--tolerance", "1", cwd=tmp_path)
    assert process.stderr is not None
    assert process.stderr.readline().startswith("note: long.bvh")  # it is at work now
    process.send_signal(signal.SIGINT)
    out, err = process.communicate()
    assert process.returncode == 130
    assert out == ""
    assert "Traceback" not in err
    # No corpus, and of what was read only whole files, with which the same command goes on.
    assert not (tmp_path / "home" / "corpora").exists()
    left = [path for path in (tmp_path / "home").rglob("*") if path.is_file()]
    assert {path.suffix for path in left} <= {".npz", ".lock"}, left


@pytest.mark.skipif(os.name != "posix", reason="signals and pipes as POSIX has them")
@pytest.mark.parametrize("output", [[], ["-o", "tween.json"]])
def test_a_reader_that_goes_away_is_no_error(output: list[str], tmp_path: Path) -> None:
    postures = [BALLET / "postures" / f"{name}.json" for name in ("arabesque", "fifth")]
    words = ["tween", *postures, "--corpus", "ballet", *output] if output else ["corpus", "info", "ballet"]
    end, begin = os.pipe()
    os.close(end)
    process = start(*words, cwd=tmp_path, stdout=begin)
    os.close(begin)
    assert process.communicate()[1] == ""
    assert process.returncode == 0
    for name in output[1:]:
        assert len(read_motion(tmp_path / name)) > 1


def test_running_leaves_the_log_as_it_was(run: Run) -> None:
    """Whoever calls the command line from Python gets no notes from then on that were not asked for."""
    log = logging.getLogger("motionmind")
    before = log.level, list(log.handlers)
    for words in (["corpus", "list"], ["corpus", "info", "nowhere"]):
        run(*words)
        assert (log.level, log.handlers) == before


# --- files are safe -------------------------------------------------------------------------------------------------


def test_what_is_read_is_not_written_over(run: Run, tmp_path: Path) -> None:
    write_motion(tmp_path / "clip.bvh", clip())
    before = files_under(tmp_path)
    (tmp_path / "down").mkdir()
    done = run("convert", "clip.bvh", "down/../clip.bvh")
    assert (done.code, done.err.count("\n")) == (2, 1)
    assert "it is read from" in done.err
    (tmp_path / "down").rmdir()
    assert files_under(tmp_path) == before


def test_one_file_under_two_names_is_not_written_twice(run: Run, tmp_path: Path) -> None:
    posture = BALLET / "postures" / "fifth.json"
    done = run("tween", posture, posture, "--corpus", "ballet", "-o", "a.json", "--report", tmp_path / "a.json")
    assert done.code == 2
    assert "written twice" in done.err
    assert not (tmp_path / "a.json").exists()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full to write to in vain")
def test_outputs_are_written_all_or_none(run: Run, tmp_path: Path) -> None:
    posture = BALLET / "postures" / "fifth.json"
    done = run("tween", posture, posture, "--corpus", "ballet", "-o", "a.bvh", "--report", "/dev/full")
    assert done.code == 2
    assert not (tmp_path / "a.bvh").exists()
    assert Path("/dev/full").exists()


def test_the_papers_two_forms_and_their_rate(run: Run) -> None:
    write_motion("clip.bvh", clip())
    assert run("convert", "clip.bvh", "braces.txt").code == 0
    done = run("convert", "clip.bvh", "lines.txt", "--form", "lines")
    assert done.code == 0
    assert "no place for times" in done.err
    assert "{" in Path("braces.txt").read_text()
    assert "{" not in Path("lines.txt").read_text()
    for name in ("braces", "lines"):
        assert run("convert", f"{name}.txt", f"{name}.json", "--source-fps", 30).code == 0
        again = read_motion(f"{name}.json")
        assert len(again) == len(clip())
        assert again.fps == pytest.approx(30.0)
        assert float(rot.angle(again.rotations, clip().rotations).max()) < 1e-6
