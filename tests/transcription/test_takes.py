"""Takes of a phrase: written alike within the tolerance, without overlaps, and called from the score."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from bundled_clips import ballet_clip
from command_line import Run
from hypothesis import given, settings
from hypothesis import strategies as st

from motionmind._typing import Ints
from motionmind.body.anatomy_file import anatomy_named
from motionmind.body.mirror import mirrored
from motionmind.body.motion import Motion
from motionmind.geometry import rotations as rot
from motionmind.notation.compose import motions, played
from motionmind.notation.read import read_score
from motionmind.transcription import Transcription, transcribe
from motionmind.transcription.bones import Bones, deviations
from motionmind.transcription.following import Following
from motionmind.transcription.recorded import prepare
from motionmind.transcription.repeats import find_repeats
from motionmind.transcription.takes import Take, choose_phrases, find_takes, match_takes
from motionmind.transcription.text import ScoreWriter
from motionmind.transcription.transcribe import _moves

MACARENA = Path(__file__).parents[2] / "corpora" / "macarena" / "macarena.score"
BONES = Bones.of(anatomy_named("human23"))
TOLERANCE_DEG = 10.0


@cache
def macarena() -> Motion:
    (motion,) = motions(read_score(MACARENA))
    return motion.resample(30.0).slice(0, 660)  # two walls and a half


@cache
def transcribed() -> Transcription:
    return transcribe(macarena(), TOLERANCE_DEG)


def test_a_dance_to_two_walls_is_one_phrase() -> None:
    found = transcribed()
    longest = max(found.repeats, key=lambda repeat: repeat.saved)
    assert longest.length >= 24
    assert [call.times for call in longest.calls] == [1, 1]
    assert found.text.count("phrase-1") >= 3
    lines = found.text.partition("\nclip ")[2].splitlines()
    assert len(lines) < 0.5 * len(found.keys)


def test_takes_that_are_written_alike_stay_within_the_tolerance() -> None:
    found, prepared = transcribed(), prepare(macarena(), TOLERANCE_DEG)
    moved = found.motion.at(prepared.motion.times - prepared.motion.times[0])
    off = deviations(BONES.directions(moved.rotations), BONES.directions(prepared.writable))
    own = np.setdiff1d(np.arange(len(off)), found.keys)
    assert np.all(off[own] <= BONES.allowed(TOLERANCE_DEG) + 0.05)  # times are rounded to 0.1 ms
    apart = (prepared.motion.root[0] - moved.root[0]) * [1.0, 0.0, 1.0]
    assert np.abs(moved.root + apart - prepared.root).max() <= 0.005 * TOLERANCE_DEG + 0.01


@pytest.mark.parametrize("sides", [1, 2])
def test_phrases_play_the_same_postures_and_moves(tmp_path: Path, sides: int) -> None:
    wall = macarena().slice(0, 300)
    motion = macarena() if sides == 1 else then(wall, 30.0, mirrored(wall))
    following = Following(prepare(motion, TOLERANCE_DEG), TOLERANCE_DEG)
    keys = following.fewest_keys(0, len(following.directions))
    phrases = choose_phrases(find_takes(following, keys), keys, len(following.directions))
    recorded, keys = match_takes(following, keys, phrases, TOLERANCE_DEG)
    writer, moves = ScoreWriter(recorded, keys), _moves(recorded, keys, 103.0)
    moves = [move._replace(left=row % 3, ahead=-(row % 2)) if row else move for row, move in enumerate(moves)]
    repeats = find_repeats(writer.rows(moves))
    assert {call.mirrored for repeat in repeats for call in repeat.calls} == {False, sides == 2}
    out = []
    for given_repeats in ([], repeats):
        path = tmp_path / "found.score"
        path.write_text(writer.text(moves, 103.0, "clip-1", "A dance", given_repeats), encoding="utf-8")
        out.append(played(read_score(path))[0])
    plain, called = out
    assert [row._replace(where=None, words=(), faced=False, line=0) for row in plain[0]] == [  # type: ignore[arg-type]
        row._replace(where=None, words=(), faced=False, line=0)  # type: ignore[arg-type]
        for row in called[0]
    ]
    for name in ("rotations", "root", "times"):
        np.testing.assert_array_equal(getattr(plain[1], name), getattr(called[1], name))


def then(motion: Motion, turn: float, other: Motion) -> Motion:
    """A movement, and another a second later, turned about the vertical by degrees."""
    about = rot.about_vertical(np.radians(turn))
    rotations = other.rotations.copy()
    rotations[:, 0] = rot.mul(about, rotations[:, 0])
    times = np.concatenate([motion.times, motion.times[-1] + 1.0 + other.times - other.times[0]])
    root = np.concatenate([motion.root, rot.mul_vec(about, other.root)])
    return replace(
        motion, rotations=np.concatenate([motion.rotations, rotations]), root=root, times=times, keyframed=False
    ).resample(30.0)


@pytest.mark.parametrize(("turn", "pace"), [(0.0, 1.0), (90.0, 1.25)])
def test_the_mirror_image_is_called_on_the_other_side(turn: float, pace: float) -> None:
    once = ballet_clip("adagio").resample(30.0).slice(0, 240)
    image = mirrored(once)
    found = transcribe(then(once, turn, replace(image, times=image.times * pace)), 8.0)
    assert any(call.mirrored for repeat in found.repeats for call in repeat.calls)
    assert ", other side" in found.text
    one = transcribe(once, 8.0)
    assert len(found.keys) - sum(repeat.saved for repeat in found.repeats) <= 1.5 * len(one.keys) + 6


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 10**6))
def test_phrases_and_takes_do_not_overlap(seed: int) -> None:
    rng = np.random.default_rng(seed)
    count = 80
    keys = np.sort(rng.choice(count, 16, replace=False))

    def frames(longest: int) -> Ints:
        start = int(rng.integers(0, count - 2))
        return start + np.concatenate([[0], np.cumsum(rng.integers(1, 6, longest))])

    takes: list[list[Take]] = []
    for k in range(len(keys)):
        paths = [frames(int(rng.integers(1, len(keys) - k))) for _ in range(4)] if k < len(keys) - 1 else []
        takes.append([Take(bool(rng.integers(2)), path[path < count]) for path in paths])
    phrases = choose_phrases([[take for take in own if len(take.frames) > 1] for own in takes], keys, count)
    taken = np.zeros(count, dtype=np.int64)
    for phrase in phrases:
        rows = 0
        for path in (keys[phrase.key : phrase.key + phrase.length], *(take.frames for take in phrase.takes)):
            assert len(path) == phrase.length
            taken[path[0] : path[-1] + 1] += 1
            rows += np.count_nonzero((keys >= path[0]) & (keys <= path[-1]))
        assert rows - (1 + len(phrase.takes)) - (phrase.length + 1) > 0
    assert taken.max(initial=0) <= 1


def test_the_command_says_what_recurs(run: Run) -> None:
    done = run("transcribe", "macarena/macarena", "--to", "70", "-o", "t.score", "--tolerance", "12")
    assert "danced" in done.out
    assert "\nphrase phrase-1" in Path("t.score").read_text(encoding="utf-8")
    plain = run("transcribe", "macarena/macarena", "--to", "70", "-o", "t.score", "--tolerance", "12", "--no-repeats")
    assert "danced" not in plain.out
    assert "\nphrase" not in Path("t.score").read_text(encoding="utf-8")
