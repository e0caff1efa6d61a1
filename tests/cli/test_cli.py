"""The command line as a user meets it: output, files and exit codes."""

from __future__ import annotations

import json
import logging
import os
import re
import signal
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cli_files import ARABESQUE, BALLET, FIFTH, PLIE, clip, start
from command_line import Run

from motionmind.cli.printing import print_tween
from motionmind.formats import read_motion, read_posture, write_motion
from motionmind.geometry import rotations as rot
from motionmind.tween.engine import Engine
from motionmind.variation.variation_json import read_variation

REPORT = {
    *("asked", "status", "cost", "lower_bound", "gap", "moves", "length", "tempo"),
    *("expansions", "peak_nodes", "node_budget", "seconds", "joints", "path"),
    *("attested", "bridges", "waits", "differs", "what_if", "vias", "snap_degrees", "path_degrees", "followed"),
    *("sources", "detail", "left_out", "shown", "times", "names", "degrees", "likelihood", "costs", "credits"),
    *("motion_sha256", "gave", "reached", "stayed", "travelled", "accented", "motion_attested", "parts", "changes"),
}


# --- tween ------------------------------------------------------------------------------------------------------------


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
    table.pop("warning", None)  # where it goes beyond the corpus
    assert list(table) == [
        "7",
        "feet",
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
        "passages",
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


def test_a_tween_is_summarised_in_a_line_and_a_missing_output_reported(run: Run) -> None:
    ran = run("tween", ARABESQUE, FIFTH, "--corpus", "ballet")
    summary, *rest = ran.out.splitlines()
    proof = r"Path proven optimal, all from ballet"
    motion = r"Motion reaches \d+% of the path's joint states; \d+% of the motion's transitions occur in ballet"
    assert re.fullmatch(rf"7 moves, \d\.\d s\. {proof}\. {motion}", summary)
    assert rest == ["feet      the left foot stays in place", "written   nothing (-o FILE writes the result)"]


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
    assert "-o is given 2 times; this command writes one file" in ran.err
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
                rf"note: {file}: this format needs evenly spaced frames: resampled \d+ frames to {frames}, 30 per",
                ran.err,
            )
            again = run(*(word.format(file) for word in words), "--fps", 10)
            assert "needs evenly spaced" not in again.err
    ran = run("convert", "uneven.json", "kept.json")
    assert "even" not in ran.err
    assert len(read_motion("kept.json")) == len(uneven)


def test_a_posture_among_the_clips_is_noticed(run: Run) -> None:
    write_motion("walk.json", clip(fps=30.0))
    Path("A.json").write_bytes(ARABESQUE.read_bytes())
    for skip in (0, 1):
        ran = run("corpus", "build", "mine", "A.json", "walk.json", "--skip", skip, "--replace")
        assert ran.code == 0
        end = "; left out" if skip else ""
        assert f"note: A.json: holds one posture, and no move to learn from{end}\n" in ran.err


def test_a_recording_is_varied_as_the_corpus_learned_it(run: Run) -> None:
    """At the corpus's rate, and without the T-pose that was dropped when it was built."""
    write_motion("clip.bvh", clip(fps=30.0))
    assert run("corpus", "build", "mine", "clip.bvh", "--rate", 6, "--skip", 1).code == 0
    vary = ("vary", "clip.bvh", "--corpus", "mine", "--nudge", 0, "-o", "v.json")
    ran = run(*vary)
    assert "note: clip.bvh: begins at frame 1, like the recordings of mine (--from 0 keeps all frames)\n" in ran.err
    learned, piece = Engine.load("mine").corpus, read_variation("v.json").piece
    assert len(learned.rotations) == len(piece)
    assert rot.angle(piece.motion.rotations[piece.frames], learned.rotations).max() < 1e-6
    for words in (("--from", 0), ("--from", 1)):
        assert "begins at frame" not in run(*vary, *words).err
    assert run("corpus", "build", "mine", "clip.bvh", "--rate", 6, "--replace").code == 0
    assert "begins at frame" not in run(*vary).err


def test_a_recording_that_is_varied_frame_by_frame_is_noticed(run: Run) -> None:
    write_motion("clip.bvh", clip(fps=30.0))
    said = "note: clip.bvh: every frame is a posture, 30 per second; --rate 5 is the rate of corpus build\n"
    for words, is_said in (((), True), (("--rate", 5), False)):
        ran = run("vary", "clip.bvh", *words, "-o", "v.json")
        assert (said in ran.err) is is_said
    assert "is a posture, " not in run("vary", "ballet/jump", "-o", "v.json").err


def test_review_says_which_file_it_wants(run: Run) -> None:
    write_motion("clip.json", clip(fps=10.0))
    assert run("vary", "clip.json", "-o", "v.bvh", "-o", "w.bvh", "-o", "w.json").code == 0
    for file, hint in (("v.bvh", ""), ("w.bvh", "; did you mean w.json?")):
        ran = run("review", file)
        assert (ran.code, ran.out) == (2, "")
        assert ran.err == f"error: {file}: holds movement alone; a variation is the .json that vary wrote{hint}\n"


def test_the_unit_of_a_file_is_noted_once(run: Run, empty_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    files = [f"{name}.bvh" for name in "abc"]
    for name in files:
        write_motion(name, clip())

    def noted(*names: str) -> list[str]:
        return re.findall(
            r"note: (\S+): one unit taken", "".join(run("convert", name, "out.json").err for name in names)
        )

    assert noted(*files) == files
    assert noted(*files) == []
    write_motion("b.bvh", clip().slice(0, 5))
    assert noted(*files) == ["b.bvh"]
    assert run("corpus", "build", "mine", *files).err.count("one unit taken") == 0
    monkeypatch.setattr("motionmind.cli.noted._N_REMEMBERED", 1)
    write_motion("d.bvh", clip())
    assert noted("d.bvh") == ["d.bvh"]
    assert noted("d.bvh", "a.bvh") == ["a.bvh"]
    (empty_cache / "notes" / "printed").write_bytes(b"\xff")
    assert noted("d.bvh") == ["d.bvh"]


def test_of_many_warnings_a_few_are_printed(run: Run) -> None:
    posture = json.loads(ARABESQUE.read_text("utf-8"))
    posture["rotations"]["left_hip"] = [2.0 * number for number in posture["rotations"]["left_hip"]]
    frame = [posture["rotations"][joint] for joint in clip().skeleton.names]
    motion = {"format": "motionmind-motion", "version": 1, "skeleton": "human23", "times": [0.0, 0.2]}
    motion |= {"root": [posture["root"]] * 2, "rotations": [frame] * 2}
    for number in range(9):
        Path(f"take{number}.json").write_text(json.dumps(motion), "utf-8")
    takes = [f"take{number}.json" for number in range(9)]
    build = ("corpus", "build", "mine", *takes)
    few, all_of_them = (run(*build, *more).err.splitlines() for more in ((), ["--details", "--replace"]))
    assert few == [*all_of_them[:3], "note: 6 more warnings like these (--details prints them)"]
    assert len(all_of_them) == 9


def test_a_tween_says_what_a_viewer_sees_beyond_the_corpus(capsys: pytest.CaptureFixture[str]) -> None:
    engine = Engine.load("ballet")
    motion = engine.corpus.motion(engine.corpus.clips[0])
    tween = engine.tween(motion.posture(0), motion.posture(1))
    print_tween(tween, [])
    assert not [line for line in capsys.readouterr().out.splitlines() if line.startswith("warning")]
    away = np.linspace(0.0, 9.0, len(tween.motion))[:, None] * [1.0, 0.0, 0.0]
    carried = replace(tween, motion=replace(tween.motion, root=tween.motion.root + away))
    print_tween(carried, [])
    (line,) = (line for line in capsys.readouterr().out.splitlines() if line.startswith("warning"))
    pace = carried.report()["shown"]["pace"]
    assert line.startswith(f"warning   travel is {pace['value']:.2f}x as fast as fast movement of the corpus, ")
    assert line.endswith(f"at most {pace['most']:.2f}x in the corpus")


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


# --- the shell's side -------------------------------------------------------------------------------------------------


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
