"""Shells complete commands, corpora, postures, joints and flows, and wait for nothing heavy."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from bundled_clips import ballet_clip
from command_line import Run
from gltf_files import with_clips

import motionmind
from motionmind.chaos.flows import FLOWS
from motionmind.cli import completion
from motionmind.discretize.codebook import Codebook
from motionmind.names.finding import find_motion, open_collection
from motionmind.names.postures import find_posture
from motionmind.names.spelling import parse_source
from motionmind.tween.engine import Engine

Complete = Callable[..., list[str]]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A corpus on a body of its own."""
    folder = tmp_path_factory.mktemp("built") / "mine"
    Engine.fit([ballet_clip("jump")], name="mine", discretization=Codebook(15.0)).save(folder)
    return folder


@pytest.fixture
def home(tmp_path: Path, built: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A user's folder with one corpus, and a cache in which the ballet was learned."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MOTIONMIND_HOME", str(tmp_path / "home"))
    Engine.load("ballet")
    shutil.copytree(built, tmp_path / "home/corpora/mine")
    return tmp_path


@pytest.fixture
def complete(home: Path, monkeypatch: pytest.MonkeyPatch, run: Run) -> Complete:
    """What bash is told to complete the last of some words to."""

    def call(*words: str) -> list[str]:
        monkeypatch.setenv("_MOTIONMIND_COMPLETE", "bash_complete")
        monkeypatch.setenv("COMP_WORDS", " ".join(("motionmind", *words)))
        monkeypatch.setenv("COMP_CWORD", str(len(words)))
        ran = run()
        assert (ran.code, ran.err) == (0, "")
        return [line.removeprefix("plain,") for line in ran.out.splitlines() if line]

    monkeypatch.chdir(home)
    return call


def test_corpora_postures_clips_joints_and_flows_are_completed(complete: Complete) -> None:
    assert complete("tw") == ["tween"]
    assert complete("corpus", "de") == ["delete"]
    assert {"ballet/", "karate/", "mine/"} <= set(complete("tween", ""))
    assert complete("tween", "ballet/ara") == ["ballet/arabesque", "ballet/arabesques@0"]
    assert complete("tween", "ballet/fifth", "mi") == ["mine/jump@0"]
    assert complete("sheet", "mine/") == ["mine/jump"]
    assert complete("corpus", "info", "k") == ["karate"]
    assert {"ballet", "mine"} <= set(complete("corpus", "check", ""))
    for change in ("add", "remove", "rename", "delete"):
        assert complete("corpus", change, "") == ["mine"]
    assert complete("corpus", "fetch", "la") == ["lafan1"]
    assert complete("measure", "x.bvh", "--corpus", "mi") == ["mine"]
    assert complete("vary", "ballet/jump", "--attractor", "l") == ["lorenz"]
    for words in (
        ("tween", "A.json", "B.json", "--corpus", "ballet", "--pin"),
        ("tween", "ballet/fifth", "B.json", "--hold"),
        ("graph", "--corpus", "mine", "--joint"),
    ):
        assert complete(*words, "left_h") == ["left_hip"]
    assert complete("tween", "ballet/fifth", "B.json", "--hold", "left_hip,right_h") == ["left_hip,right_hip"]


def test_files_are_completed_by_the_shell_or_beside_corpora(complete: Complete) -> None:
    Path("ballerina.bvh").touch()
    Path("A.json").touch()
    assert complete("tween", "A") == ["file,A"]
    found = complete("tween", "ball")
    assert "ballerina.bvh" in found
    assert "ballet/arabesque" in found
    assert complete("tween", "nowhere/A") == ["file,nowhere/A"]


def test_clips_of_gltf_files_are_completed(complete: Complete) -> None:
    jump = ballet_clip("jump")
    with_clips(Path("hero.glb"), [("Walk", jump), ("Wave@2", jump), ("Dance", jump), ("", jump)]).write()
    assert complete("sheet", "hero.glb#") == [f"hero.glb#{name}" for name in ("Walk", "Wave@2", "Dance", "4")]
    assert complete("tween", "hero.glb#Wa") == ["hero.glb#Walk@0", "hero.glb#Wave@2@0"]
    assert complete("sheet", "hero.glb#x") == complete("sheet", "none.glb#") == []
    assert complete("sheet", "her") == ["file,her"]


@pytest.mark.parametrize("corpus", ["ballet", "karate", "medley", "walk-hexapod", "mine"])
def test_what_is_completed_is_what_there_is(complete: Complete, corpus: str) -> None:
    Engine.load(corpus)
    found = open_collection(parse_source(corpus))
    postures = [f"{corpus}/{name}" for name in found.postures]
    assert complete("tween", f"{corpus}/") == [
        *sorted(postures, key=postures.index),
        *(f"{corpus}/{c}@0" for c in found.clips),
    ]
    for name in complete("tween", f"{corpus}/"):
        find_posture(name)
    for name in complete("sheet", f"{corpus}/")[::7]:
        find_motion(parse_source(name))
    joints = Engine.load(corpus).corpus.skeleton.names
    assert tuple(complete("graph", "--corpus", corpus, "--joint", "")) == joints


def test_the_flows_are_those_there_are() -> None:
    assert sorted(FLOWS) == list(completion.FLOWS)


@pytest.mark.parametrize("manifest", ["", "[]", "{", '{"clips": 3}', '{"scores": 3}', '{"clips": [{}], "skeleton": 1}'])
def test_what_cannot_be_read_completes_to_nothing(complete: Complete, home: Path, manifest: str) -> None:
    folder = home / "home/corpora/damaged"
    folder.mkdir()
    (folder / "manifest.json").write_text(manifest, "utf-8")
    assert complete("tween", "damaged/") == ["file,damaged/"]
    assert complete("graph", "--corpus", "damaged", "--joint", "") == []


def test_a_tab_imports_no_numerics(home: Path) -> None:
    code = (
        "import sys; from motionmind.cli import main\n"
        "try: main()\n"
        "finally: print([m for m in ('numpy', 'numba', 'scipy') if m in sys.modules], file=sys.stderr)"
    )
    with_clips(Path("hero.glb"), [("Walk", ballet_clip("jump"))]).write()
    for words in (
        "motionmind tween ballet/",
        "motionmind tween a b --corpus ballet --pin ",
        "motionmind vary x --attractor ",
        "motionmind sheet hero.glb#",
    ):
        environment = {
            **os.environ,
            "_MOTIONMIND_COMPLETE": "bash_complete",
            "COMP_WORDS": words,
            "COMP_CWORD": str(words.count(" ")),
            "PYTHONPATH": str(Path(motionmind.__file__).parents[1]),
        }
        done = subprocess.run(
            [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False
        )
        assert done.stderr == "[]\n"
        assert done.stdout


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_of_each_shell_is_printed(run: Run, shell: str) -> None:
    ran = run("completion", shell)
    assert ran.code == 0
    assert f"_MOTIONMIND_COMPLETE={shell}_complete" in ran.out


@pytest.mark.skipif(not shutil.which("bash"), reason="there is no bash")
def test_bash_takes_a_frame_of_a_clip_for_one_word(home: Path, run: Run) -> None:
    Path("script").write_text(run("completion", "bash").out, "utf-8")
    program = Path("bin/motionmind")
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m motionmind "$@"\n', "utf-8")
    program.chmod(0o755)
    test = (
        "source ./script; [[ $COMP_WORDBREAKS == *@* ]] && exit 1; COMP_WORDS=(motionmind tween ballet/adagio@23 "
        'ballet/ara); COMP_CWORD=3; _motionmind_completion motionmind; echo "${COMPREPLY[*]}"'
    )
    environment = {
        **os.environ,
        "PATH": f"{program.parent.resolve()}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": str(Path(motionmind.__file__).parents[1]),
    }
    done = subprocess.run(["bash", "-c", test], env=environment, capture_output=True, text=True, check=False)
    assert done.stdout.split() == ["ballet/arabesque", "ballet/arabesques@0"], done.stderr
