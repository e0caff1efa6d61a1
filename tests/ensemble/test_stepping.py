"""Ways that the engine dances: on the counts of the change, from place to place, on feet that stand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from command_line import Run

from motionmind import read_motion
from motionmind.ensemble.reading import read_ensemble

DUO = """piece = "ballet/jump"
tempo = 120
spacing = 1.5
[[dancer]]
name = "Anna"
[[dancer]]
name = "Ben"
mirrored = true
"""
CHANGE = """[[change]]
at = 3
counts = 8
places = [[-1.2, 1.0], [1.2, 1.0]]
"""


@pytest.mark.long
def test_the_engine_dances_the_ways(run: Run) -> None:
    Path("duo.toml").write_text(DUO + CHANGE, "utf-8")
    assert run("convert", "ballet/jump", "jump.json").code == 0
    ran = run("convert", "duo.toml", "danced.toml", "--steps", "ballet")
    assert ran.code == 0, ran.err
    plain = read_ensemble(Path("duo.toml"), lambda _: read_motion("jump.json"))
    danced = read_ensemble(Path("danced.toml"), read_motion)
    assert danced.seconds == pytest.approx(plain.seconds, abs=0.04)
    times = np.linspace(0.0, plain.seconds, 200)
    away = (times < 0.99) | (times > 5.01)
    for one, other in zip(plain.motions(times), danced.motions(times), strict=True):
        np.testing.assert_allclose(other.root[away], one.root[away], atol=0.02)
        assert other.inserted()[(times > 1.1) & (times < 4.9)].all()
        assert not other.inserted()[away].any()
    for number, dancer in enumerate(danced.dancers):
        clock = np.arange(1.0, 5.0, 1.0 / 60.0)
        motion = dancer.at(clock)
        joints = motion.positions()
        toes = [motion.skeleton.index(name) for name in ("left_toes", "right_toes")]
        low = joints[:, toes, 1] < joints[:, toes, 1].min(axis=0) + 0.015
        speed = np.linalg.norm(np.gradient(joints[:, toes], clock, axis=0)[..., [0, 2]], axis=-1)
        glided = plain.dancers[number].at(clock).root
        carried = np.linalg.norm(np.gradient(glided, clock, axis=0)[:, [0, 2]], axis=-1)
        assert np.median(speed[low]) < 0.5 * np.median(carried), "feet stand, where they would slide"
    assert run("render", "danced.toml", "-o", "danced.html").code == 0


@pytest.mark.long
def test_changes_may_follow_each_other_at_once(run: Run) -> None:
    Path("duo.toml").write_text(DUO + CHANGE + CHANGE.replace("at = 3", "at = 11").replace("1.0]", "-0.5]"), "utf-8")
    ran = run("convert", "duo.toml", "danced.toml", "--steps", "ballet")
    assert ran.code == 0, ran.err
    for dancer in read_ensemble(Path("danced.toml"), read_motion).dancers:
        piece = dancer.piece
        np.testing.assert_allclose([one.times[[0, -1]] for one in piece.insertions], [[1.0, 5.0], [5.0, 9.0]])
        assert np.diff(piece.times).max() < 2.0 * np.median(np.diff(piece.times))
        strides = np.linalg.norm(np.diff(piece.root, axis=0), axis=-1)
        assert strides.max() < 0.1, "nobody jumps from one way to the next"


@pytest.mark.parametrize(
    ("text", "arguments", "words"),
    [
        (DUO, ("duo.toml", "out.toml", "--steps", "ballet"), "changes no formation"),
        (DUO + CHANGE, ("duo.toml", "out.toml", "--steps", "balet"), "balet"),
        (DUO + CHANGE, ("duo.toml", "out.glb", "--steps", "ballet"), ".toml"),
        (DUO, ("ballet/jump", "out.json", "--steps", "ballet"), "--steps is for an ensemble"),
    ],
)
def test_what_cannot_be_danced_is_refused(run: Run, text: str, arguments: tuple[str, ...], words: str) -> None:
    Path("duo.toml").write_text(text, "utf-8")
    ran = run("convert", *arguments)
    assert (ran.code, ran.out) == (2, "")
    assert words in ran.err
    assert not list(Path().glob("out*"))
