"""The command line works whatever standard error is, whatever files are called, and whatever numbers it is given."""

from __future__ import annotations

import contextlib
import io
import json
import os
import pickle
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import click
import numpy as np
import pytest
from command_line import Run
from hypothesis import given
from hypothesis import strategies as st

import motionmind
from motionmind.body.human import human23
from motionmind.body.motion import Motion
from motionmind.body.skeleton import Skeleton
from motionmind.cli import main
from motionmind.cli.application import app
from motionmind.cli.types import Moves, Number, Numbers, Point, Size, Span, Whole
from motionmind.display import displayed
from motionmind.errors import (
    CorpusError,
    FormatError,
    InfeasibleError,
    MotionMindError,
    MotionMindWarning,
    NoPathError,
    SkeletonError,
    WrongTypeError,
)
from motionmind.formats import read_motion, write_motion
from motionmind.geometry import rotations as rot

ROOT = Path(motionmind.__file__).parents[1]
BODY = human23()
POSTURES = ROOT / "corpora" / "ballet" / "postures"
A, B = POSTURES / "arabesque.json", POSTURES / "fifth.json"
DIGITS = "9" * 5000


def motion(name: str = "clip", frames: int = 12) -> Motion:
    angles = np.linspace(0.0, 1.0, frames)
    rotations = np.tile(rot.IDENTITY, (frames, len(BODY), 1))
    rotations[:, 5] = rot.about_vertical(angles)
    return Motion(BODY, rotations, np.zeros((frames, 3)), np.arange(frames) / 30.0, name)


# --- standard error ---------------------------------------------------------------------------------------------------

# Runs command lines, with the words that the system gave and the streams that Python opened, each in a process of its
# own that begins with what this one has imported and ends without a search for garbage among it: most of what it takes.
_CALLER = """
import atexit, gc, os, sys
import motionmind.corpus.shards, motionmind.formats.bvh, motionmind.formats.papers, motionmind.names.finding
import motionmind.notation.compose, motionmind.render.svg, motionmind.tween.engine
from motionmind.cli import main
atexit.register(gc.freeze)
lines = sys.argv[1:]
while lines:
    end = lines.index("--then")
    words, lines = lines[:end], lines[end + 1 :]
    child = os.fork()
    if child == 0:
        main(words)
    print(f"--ended {os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])}", flush=True)
"""
Words = list[str | bytes]


def call(folder: Path, *lines: Words, errors: str = "2>&1") -> list[tuple[int, bytes]]:
    """Run command lines in other processes, for no test's report may hold such names; return codes and what they print.

    Args:
        folder: where they run.
        lines: words of each.
        errors: where a shell is to send standard error.
    """
    environment = os.environ | {"PYTHONPATH": str(ROOT), "MOTIONMIND_HOME": str(folder / "home")}
    words = [word for line in lines for word in (*line, "--then")]
    command = ["sh", "-c", f'exec "$@" {errors}', "sh", sys.executable, "-c", _CALLER, *words]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, check=False)
    assert b"Traceback" not in done.stdout, ascii(done.stdout)
    assert done.returncode == 0
    told = re.findall(rb"(.*?)--ended (-?\d+)\n", done.stdout, re.S)
    assert len(told) == len(lines)
    return [(int(code), printed) for printed, code in told]


WORK: list[tuple[Words, list[str]]] = [
    (["convert", "clip.json", "clip.bvh"], ["clip.bvh"]),
    (["corpus", "build", "mine", "clip.json"], ["home/corpora/mine/manifest.json"]),
    (
        ["tween", str(A), str(B), "--corpus", "ballet", "--moves", "4", "-o", "out.json", "--report", "report.json"],
        ["out.json", "report.json"],
    ),
    (["convert", "clip.json", "nothing.xyz"], []),
    (["convert", "nowhere.json", "other.bvh"], []),
    (["nothing"], []),
]


@pytest.mark.long
@pytest.mark.parametrize("errors", ["2>&-", "2>/dev/full"])
def test_standard_error_that_is_closed_or_full_changes_nothing(tmp_path: Path, usual: Path, errors: str) -> None:
    if "full" in errors and not Path("/dev/full").exists():
        pytest.skip("there is no /dev/full")
    assert [code for code, _ in work(tmp_path, errors)] == [0 if written else 2 for _, written in WORK]
    for name in (name for _, written in WORK for name in written):
        assert (tmp_path / name).read_bytes() == (usual / name).read_bytes() or name == "report.json"
    assert not (tmp_path / "other.bvh").exists()


@pytest.mark.parametrize(
    ("words", "written"),
    [(["corpus", "list"], []), (["completion", "bash"], []), (["convert", "clip.json", "clip.bvh"], ["clip.bvh"])],
)
def test_standard_output_that_is_closed_is_an_error_in_a_line(tmp_path: Path, words: Words, written: list[str]) -> None:
    write_motion(tmp_path / "clip.json", motion())
    ran = [sys.executable, "-m", "motionmind", *words]
    command = ["sh", "-c", 'exec "$@" >&-', "sh", *ran]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert [line for line in done.stderr.splitlines() if "error" in line] == [
        "error: cannot write: standard output is closed"
    ]
    for name in written:  # what was asked for is complete, and holds nothing that was printed
        assert len(read_motion(tmp_path / name)) == 12


@pytest.fixture(scope="module")
def usual(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which the work was done in this process, with standard error in a text."""
    folder, errors = tmp_path_factory.mktemp("usual"), io.StringIO()
    write_motion(folder / "clip.json", motion())
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stderr(errors):
        patch.chdir(folder)
        patch.setenv("MOTIONMIND_HOME", str(folder / "home"))
        for words, written in WORK:
            with pytest.raises(SystemExit) as end:
                main([*map(os.fsdecode, words)])
            assert end.value.code == (0 if written else 2)
    assert errors.getvalue().count("error: ") == 3
    return folder


def work(folder: Path, errors: str) -> list[tuple[int, bytes]]:
    write_motion(folder / "clip.json", motion())
    return call(folder, *(words for words, _ in WORK), errors=errors)


# --- names ------------------------------------------------------------------------------------------------------------

STRANGE: list[tuple[bytes, bytes, list[bytes]]] = [
    (b"caf\xe9", b".json", [b".bvh", b".svg", b".glb"]),
    (b"\xff\xfe", b".bvh", [b".npz", b".html"]),
    (b"\xc3\x28\x80", b".npz", [b".json", b".png"]),
]


@pytest.mark.long
def test_files_whose_names_are_no_utf_8_are_read_and_written(tmp_path: Path) -> None:
    lines: list[Words] = []
    missing: list[Words] = []
    sources = [name + suffix for name, suffix, _ in STRANGE]
    for source, (name, suffix, targets) in zip(sources, STRANGE, strict=True):
        write_motion(tmp_path / f"clip{suffix.decode()}", motion())
        (tmp_path / f"clip{suffix.decode()}").rename(tmp_path / os.fsdecode(source))
        for target in targets:
            command = ["render", source, "-o"] if target in (b".html", b".svg", b".png") else ["convert", source]
            lines.append([*command, b"to-" + name + target])
        missing += [["convert", b"no-" + what, "out.json"] for what in (source, name)]
    first, second, third = (name for name, _, _ in STRANGE)
    lines += [["corpus", "build", "mine", *sources], ["corpus", "info", "mine"]]
    files = ["--report", b"report-" + second, "-o", third + b"-out.bvh"]
    lines.append(["tween", sources[0] + b"@0", sources[1] + b"@9", "--corpus", "mine", "--moves", "1", *files])
    told = call(tmp_path, *lines, *missing)
    assert [code for code, _ in told] == [0] * len(lines) + [2] * len(missing)
    assert [errors.count(b"\n") for _, errors in told[len(lines) :]] == [1] * len(missing)
    for stem in (b"to-" + first, third + b"-out"):  # a clip in BVH is called after its file
        shown = os.fsdecode(stem).encode("utf-8", "backslashreplace").decode()
        assert ascii(read_motion(tmp_path / os.fsdecode(stem + b".bvh")).name) == ascii(shown)


@pytest.mark.long
def test_words_that_are_no_utf_8_are_an_error_in_a_line(tmp_path: Path) -> None:
    write_motion(tmp_path / "clip.json", motion())
    strange = b"caf\xe9"
    about = [["corpus", "build", "mine", "clip.json", option, strange] for option in ("--title", "--author", "--mix")]
    named = [["corpus", "info", strange], ["corpus", "build", strange, "clip.json"], [strange]]
    told = call(tmp_path, *about, *named)
    assert {code for code, _ in told} == {2}
    assert [errors.count(b"error: ") for _, errors in told[: len(about)]] == [1] * 3
    assert [errors.count(b"\n") for _, errors in told[len(about) :]] == [1] * 3
    assert not list(tmp_path.glob("home/corpora/*/manifest.json"))


# --- foreign text -----------------------------------------------------------------------------------------------------

FOREIGN = "\x1b]0;owned\x07 \u202egnp.\x9b31m \x08\x7f"
UNSAFE = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")


@pytest.mark.long
def test_nothing_that_a_terminal_acts_on_is_printed(tmp_path: Path, run: Run) -> None:
    write_motion(tmp_path / "clip.json", replace(motion(), name=FOREIGN))
    joints = tuple(f"{FOREIGN}{number}" for number in range(len(BODY)))
    body = Skeleton("strange", joints, BODY.parents, BODY.offsets, BODY.tips)
    write_motion(tmp_path / "strange.json", replace(motion(), skeleton=body))
    about = ["--title", FOREIGN, "--author", FOREIGN, "--source", FOREIGN, "--licence", FOREIGN]
    calls: list[tuple[int, tuple[object, ...]]] = [
        (0, ("corpus", "build", "mine", "clip.json", *about)),
        (0, ("corpus", "list")),
        (0, ("corpus", "info", "mine")),
        (0, ("corpus", "check", "mine")),
        (0, ("corpus", "build", "strange", "strange.json")),
        (0, ("corpus", "check", "strange")),
        (0, ("corpus", "build", "both", "strange.json", "clip.json")),
        (2, ("corpus", "build", "both", "strange.json", "clip.json", "--strict-files", "--replace")),
        (2, ("tween", f"{FOREIGN}.json", "clip.json", "--corpus", "mine")),
        (2, ("tween", "clip.json@0", "clip.json@9", "--corpus", FOREIGN)),
        (2, ("tween", "strange.json@0", "strange.json@9", "--corpus", "mine")),
        (2, (FOREIGN,)),
        (0, ("explain", "none.json")),
    ]
    (tmp_path / "none.json").write_text(
        json.dumps({"status": "no path", "message": FOREIGN, "diagnosis": None}), "utf-8"
    )
    for code, words in calls:
        ran = run(*words)
        assert ran.code == code, ran.err
        assert UNSAFE.findall(ran.out + ran.err) == []
    info = run("corpus", "info", "mine", "--json")
    assert (info.json["title"], UNSAFE.findall(info.out)) == (FOREIGN, [])  # whole, escaped as JSON does
    assert json.loads((tmp_path / "home/corpora/mine/manifest.json").read_bytes())["title"] == FOREIGN


BROKEN = "a\nbroken\ttorn\x85split\u2028name"


@pytest.mark.long
def test_no_name_breaks_a_line(tmp_path: Path, run: Run, caplog: pytest.LogCaptureFixture) -> None:
    joints = tuple(f"{BROKEN}{number}" for number in range(len(BODY)))
    named = replace(motion(name=BROKEN), skeleton=Skeleton(BROKEN, joints, BODY.parents, BODY.offsets, BODY.tips))
    for file in ("clip.json", f"{BROKEN}.json", f"{BROKEN}.bvh"):
        write_motion(tmp_path / file, motion(name=BROKEN))
    write_motion(tmp_path / "joints.json", named)
    (tmp_path / f"{BROKEN} bad.bvh").write_text("HIERARCHY\n")
    a, b = f"mine/{BROKEN}@0", f"mine/{BROKEN}@1"
    calls: list[tuple[int, tuple[object, ...]]] = [
        (0, ("corpus", "build", "mine", f"{BROKEN}.bvh", f"{BROKEN} bad.bvh", "--title", BROKEN, "--author", BROKEN)),
        (0, ("corpus", "build", "joints", "joints.json", "--performer", BROKEN)),
        (2, ("corpus", "add", "mine", "clip.json", f"{BROKEN}.json")),
        (0, ("corpus", "add", "mine", "clip.json")),
        (0, ("corpus", "list")),
        (0, ("corpus", "info", "mine")),
        (0, ("corpus", "check", "joints")),
        (0, ("postures", "mine")),
        (0, ("credits", "clip.json")),
        (0, ("convert", "joints.json", f"{BROKEN}.glb")),
        (0, ("tween", a, b, "--corpus", "mine", "--report", "report.json", "-o", f"{BROKEN} out.bvh", "--details")),
        (0, ("explain", "report.json", "--all")),
        (0, ("credits", "report.json")),
        (0, ("vary", f"{BROKEN}.json", "--corpus", "mine", "-o", f"{BROKEN} varied.json")),
        (2, ("convert", f"{BROKEN} none.bvh", "out.json")),
        (2, ("convert", f"{BROKEN} bad.bvh", "out.json")),
        (2, ("tween", a, f"mine/{BROKEN}@99", "--corpus", "mine")),
        (2, ("tween", a, b, "--corpus", BROKEN)),
        (2, ("tween", "joints.json@0", "joints.json@9", "--corpus", "mine")),
        (2, ("corpus", "remove", "mine", f"{BROKEN} none")),
        (2, ("corpus", "build", BROKEN, "clip.json")),
        (2, ("graph", "--corpus", "mine", "--joint", BROKEN, "-o", "graph.svg")),
        (2, (BROKEN,)),
    ]
    for code, words in calls:
        ran = run(*words)
        assert ran.code == code, (words, ran.err)
        for line in (ran.out + ran.err).splitlines():
            assert not re.match(r"broken|split|name\S", line), (words, line)
    assert caplog.messages
    assert [message for message in caplog.messages if len(message.splitlines()) > 1] == []


ERRORS = [MotionMindError, WrongTypeError, SkeletonError, CorpusError, FormatError, InfeasibleError, MotionMindWarning]


@given(st.text(max_size=400), st.sampled_from(ERRORS))
def test_an_error_is_one_line_that_is_safe_to_log(text: str, kind: type[Exception]) -> None:
    error = kind(f"{text}: has no joints")
    assert len(str(error).splitlines()) == 1
    assert UNSAFE.findall(str(error)) == []
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), str(again)) == (kind, str(error))


def test_a_diagnosis_keeps_its_lines_and_its_values() -> None:
    error = NoPathError("no path\n  left_knee\x1b[2J: no move", {"joints": ["left_knee"]})
    assert str(error) == "no path\n  left_knee\\u001b[2J: no move"
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.diagnosis) == (str(error), {"joints": ["left_knee"]})


LONG = "a name that never ends " * 200


@pytest.mark.long
def test_long_names_are_shortened_wherever_they_are_displayed(tmp_path: Path, run: Run) -> None:
    joints = tuple(f"{number} {LONG}" for number in range(len(BODY)))
    body = Skeleton(LONG, joints, BODY.parents, BODY.offsets, BODY.tips)
    write_motion(tmp_path / "clip.json", replace(motion(name=LONG), skeleton=body))
    calls: list[tuple[int, tuple[object, ...]]] = [
        (0, ("corpus", "build", "mine", "clip.json", "--title", LONG, "--author", f"{LONG}\n{LONG}")),
        (0, ("corpus", "list")),
        (0, ("corpus", "info", "mine")),
        (0, ("corpus", "check", "mine")),
        (0, ("tween", "clip.json@0", "clip.json@9", "--corpus", "mine", "--moves", "1", "--report", "report.json")),
        (0, ("explain", "report.json")),
        (0, ("render", "clip.json", "-o", "clip.html")),
        (0, ("render", "clip.json", "-o", "clip.svg")),
        (0, ("graph", "--corpus", "mine", "--joint", joints[5], "-o", "graph.svg")),
        (2, ("graph", "--corpus", "mine", "--joint", LONG, "-o", "graph.svg")),
        (2, ("tween", A, B, "--corpus", "mine")),
        (2, ("convert", "clip.json", f"{LONG}.bvh")),
        (2, (LONG,)),
    ]
    for code, words in calls:
        ran = run(*words)
        assert ran.code == code, ran.err[:1000]
        assert max(map(len, (ran.out + ran.err).splitlines()), default=0) < 2500, words[:2]
        assert LONG[:1600] not in ran.out + ran.err
    for name in ("clip.svg", "graph.svg"):
        assert LONG[:400] not in (tmp_path / name).read_text("utf-8")
    page = (tmp_path / "clip.html").read_text("utf-8")
    shown = re.findall(r"<title>.*</title>|<h1 .*</h1>|\"names\":\[.*?\]", page)
    assert [LONG[:100] in words for words in shown] == [False] * 3
    assert run("corpus", "info", "mine", "--json").json["title"] == LONG
    assert json.loads((tmp_path / "report.json").read_bytes())["joints"] == [*joints, "facing"]


@pytest.mark.long
@given(st.text(max_size=400), st.integers(20, 300))
def test_a_displayed_name_is_one_short_line_and_short_plain_names_stay(name: str, most: int) -> None:
    shown = displayed(name, most)
    assert len(shown) <= most
    assert len(shown.splitlines()) <= 1
    assert UNSAFE.findall(shown) == []
    assert displayed(shown, most) == shown
    assert shown == name or len(name) > most or re.search(r"[\W\s]", name)


@pytest.mark.parametrize("name", ["secret", "secret.txt", "secret.score.txt", ".netrc"])
def test_an_include_of_what_is_no_score_shows_nothing_of_it(tmp_path: Path, run: Run, name: str) -> None:
    (tmp_path / name).write_text("password hunter2\n")
    for file in (name, tmp_path / name):
        (tmp_path / "a.score").write_text(f"title A\nbody human23\ninclude {file}\n")
        ran = run("compose", "a.score", "-o", "out.json")
        assert (ran.code, "hunter2" in ran.err) == (2, False)
        assert ran.err.startswith("error: a.score:3: ")


def test_an_include_of_a_link_to_what_is_no_score_shows_nothing_of_it(tmp_path: Path, run: Run) -> None:
    (tmp_path / "secret").write_text("password hunter2\n")
    (tmp_path / "link.score").symlink_to("secret")
    (tmp_path / "a.score").write_text("title A\nbody human23\ninclude link.score\n")
    ran = run("compose", "a.score", "-o", "out.json")
    assert ran.code == 2
    assert ran.err == "error: a.score:3: link.score is not a score, whose name ends in .score\n"


# --- numbers ----------------------------------------------------------------------------------------------------------

NUMBERS = (Moves, Number, Numbers, Point, Size, Span, Whole, click.types.IntParamType, click.types.FloatParamType)


def commands(group: click.Group, path: tuple[str, ...] = ()) -> list[tuple[tuple[str, ...], click.Command]]:
    found: list[tuple[tuple[str, ...], click.Command]] = []
    for name, command in group.commands.items():
        found += commands(command, (*path, name)) if isinstance(command, click.Group) else [((*path, name), command)]
    return found


OPTIONS = [
    pytest.param(path, command, parameter, id=f"{' '.join(path)} {parameter.opts[-1]}")
    for path, command in commands(app)
    for parameter in command.params
    if isinstance(parameter, click.Option) and isinstance(parameter.type, NUMBERS)
]


@pytest.mark.parametrize(("path", "command", "parameter"), OPTIONS)
@pytest.mark.parametrize("value", [DIGITS, f"-{DIGITS}", f"{DIGITS}.5", f"{DIGITS}..{DIGITS}", f"{DIGITS}MB", "1e999"])
def test_a_number_that_nothing_can_hold_is_an_error_in_a_short_line(
    run: Run, path: tuple[str, ...], command: click.Command, parameter: click.Option, value: str
) -> None:
    arguments = ["x.json" for one in command.params if isinstance(one, click.Argument)]
    ran = run(*path, *arguments, f"{parameter.opts[-1]}={value}")
    assert ran.code == 2
    assert ran.err.startswith("error: ")
    assert ran.err.count("\n") == 1
    assert len(ran.err) < 600


def test_options_of_numbers_are_of_types_that_know_their_bounds() -> None:
    assert len(OPTIONS) > 40
    for parameter in (values for _, _, values in (option.values for option in OPTIONS)):
        assert type(parameter.type) not in (click.types.IntParamType, click.types.FloatParamType), parameter.opts


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--memory", "9" * 400], "is too large"),
        (["--memory", "9" * 400 + "GB"], "is too large"),
        (["--memory", "9" * 40], "memory must be a whole number from 1 to 1125899906842624"),
        (["--alternatives", "1001"], "1001 is not in the range 1<=x<=1000"),
        (["--alternatives", "9" * 15], "is not in the range 1<=x<=1000"),
        (["--lambda", "1e308"], "is not in the range 0<=x<=1000000.0"),
        (["--tau", "1e300"], "is not in the range"),
        (["--avoid", f"left_hip={DIGITS}"], "avoid left_hip=9999"),
        (["--seed", DIGITS], "is too large"),
        (["--duration", DIGITS], "is too large"),
        (["--duration", "nan"], "nan is not a finite number"),
        (["--duration", "inf"], "inf is not a finite number"),
    ],
)
def test_the_line_says_what_is_wrong(run: Run, words: list[str], message: str) -> None:
    ran = run("tween", A, B, "--corpus", "ballet", *words)
    assert ran.code == 2
    assert message in ran.err
    assert ran.err.count("\n") == 1
    assert DIGITS[:300] not in ran.err


@pytest.mark.long
def test_the_greatest_price_is_no_reason_for_no_path(run: Run) -> None:
    for option in ("--lambda", "--beta", "--tau", "--bridge-price", "--guide"):
        assert run("tween", A, B, "--corpus", "ballet", "--moves", 4, option, 1e6).code == 0


def test_a_score_may_not_repeat_so_often_that_nobody_can_count_it(tmp_path: Path, run: Run) -> None:
    shutil.copytree(ROOT / "corpora" / "walk-hexapod", tmp_path, dirs_exist_ok=True)
    text = (tmp_path / "insect.score").read_text("utf-8")
    for times in (DIGITS, "1001", "0"):
        assert "cycle, 4 times" in text
        (tmp_path / "insect.score").write_text(text.replace("cycle, 4 times", f"cycle, {times} times"), "utf-8")
        ran = run("compose", "insect.score", "-o", "out.json")
        assert ran.code == 2
        assert "insect.score:" in ran.err
        assert ran.err.count("\n") == 1
        assert DIGITS[:300] not in ran.err
