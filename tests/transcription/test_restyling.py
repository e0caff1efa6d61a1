"""Restyling: postures are kept where and when they were, and what is between them is the engine's own."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import msgspec
import numpy as np
import pytest
from bundled_clips import ballet_clip
from command_line import Run

from motionmind import Engine, Motion, MotionMindError, NoPathError, SkeletonError, compose, read_motion, write_motion
from motionmind.credits import Credit
from motionmind.geometry import rotations as rot
from motionmind.transcription import Restyled, pass_through, restyle, transcribe


@cache
def engine(name: str = "ballet") -> Engine:
    return Engine.load(name)


@cache
def recorded(seconds: float = 4.0, fps: float = 30.0) -> Motion:
    return ballet_clip("plies").resample(fps).slice(0, round(fps * seconds) + 1)


@cache
def restyled(fps: float = 30.0) -> Restyled:
    return restyle(recorded(fps=fps), engine("karate"))


@pytest.mark.parametrize("fps", [30.0, 25.0])
def test_postures_are_kept_where_and_when_they_were(fps: float) -> None:
    found, clip = restyled(fps), recorded(fps=fps)
    assert len(found.keys) > 4
    np.testing.assert_allclose(found.motion.times, clip.times - clip.times[0], atol=1e-9)
    np.testing.assert_allclose(found.motion.root[found.keys], clip.root[found.keys], atol=1e-9)
    off = rot.angle(found.motion.rotations[found.keys], clip.rotations[found.keys])
    assert np.degrees(off).max() < 1e-4
    assert found.keys.tolist() == transcribe(clip, 12.0, shortest=0.5).keys.tolist()
    assert np.diff(found.keys).min() >= round(0.5 * fps)


def test_movement_between_postures_is_not_the_recordings() -> None:
    found = restyled()
    assert np.median(found.degrees) > 1.0
    assert found.degrees[found.keys].max() < 1e-4
    assert found.centimetres[found.keys].max() < 1e-4


def test_kept_postures_are_credited_to_their_recording_a_frame_each() -> None:
    found, clip = restyled(), replace(recorded(), recorded=(Credit(1.0, "plies", "Ada", "own", licence="CC-BY-4.0"),))
    credited = restyle(clip, engine("karate")).motion.credits
    (own,) = (credit for credit in credited if credit.corpus == "own")
    assert own.performer == "Ada"
    assert own.share == pytest.approx((len(found.keys) - 1) / (len(found.motion) - 1))
    assert {credit.corpus for credit in credited} >= {"own", "karate"}
    assert sum(credit.share for credit in credited) == pytest.approx(1.0)


def test_the_first_movement_is_the_tween_of_the_first_two_postures() -> None:
    found, clip = restyled(), recorded()
    last = int(found.keys[1])
    tween = engine("karate").tween(clip.posture(0), clip.posture(last), duration=last / 30.0)
    np.testing.assert_allclose(found.motion.rotations[: last + 1], tween.motion.rotations, atol=1e-9)
    assert found.links[0].cost == pytest.approx(tween.cost)
    assert found.cost == pytest.approx(sum(link.cost for link in found.links))


def test_each_movement_begins_at_the_velocity_of_the_one_before() -> None:
    """No jolt at a kept posture: the greatest change of velocity there is one of the frames around it, too."""
    found = restyled()
    velocity = 30.0 * rot.log(rot.inv_mul(found.motion.rotations[:-1], found.motion.rotations[1:]))
    change = rot.norm(np.diff(velocity, axis=0)).max(axis=1)  # of frame t + 1
    assert change[found.keys[1:-1] - 1].max() <= 1.5 * np.percentile(change, 95.0)


def test_marks_and_credits_cover_the_whole_dance() -> None:
    found = restyled()
    assert len(found.motion.insertions) == len(found.links) == len(found.keys) - 1
    begins = [one.times[0] for one in found.motion.insertions]
    np.testing.assert_allclose(begins, found.keys[:-1] / 30.0, atol=1e-6)
    assert sum(credit.share for credit in found.motion.credits) == pytest.approx(1.0)


def test_the_report_says_what_was_kept_and_what_it_cost() -> None:
    found = restyled()
    report = msgspec.json.decode(found.report())
    assert report["keys"] == found.keys.tolist()
    assert report["frames_per_second"] == 30.0
    assert [link["end"] for link in report["links"]] == pytest.approx((found.keys[1:] / 30.0).tolist(), abs=1e-6)
    assert len(report["degrees"]) == len(report["centimetres"]) == len(found.motion)
    assert set(report["figures"]) == {"attested", "slide", "skating"}


def test_an_ended_search_keeps_all_postures() -> None:
    asked: list[tuple[int, int]] = []

    def on_progress(done: int, of: int) -> None:
        asked.append((done, of))

    found = restyle(recorded(2.0), engine("karate"), watch=lambda _: True, on_progress=on_progress)
    assert found.degrees[found.keys].max() < 1e-4
    assert asked == [(number, len(found.links)) for number in range(len(found.links))]


def test_a_score_is_danced_at_its_times() -> None:
    score = ballet_clip("plies").slice(0, 8)
    found = pass_through(score, engine("karate"))
    at = np.round(30.0 * (score.times - score.times[0])).astype(int)
    assert found.keys.tolist() == at.tolist()
    assert np.degrees(rot.angle(found.motion.rotations[at], score.rotations)).max() < 1e-4
    np.testing.assert_allclose(found.motion.root[at], score.root, atol=1e-9)


def test_keyframes_become_frames() -> None:
    clip = ballet_clip("plies").slice(0, 4)
    found = restyle(clip, engine("karate"))
    assert found.motion.fps == pytest.approx(30.0)
    assert found.motion.times[-1] == pytest.approx(clip.times[-1] - clip.times[0], abs=1.0 / 30.0)


def test_what_cannot_be_restyled_is_refused_in_words() -> None:
    ballet, clip = engine(), recorded(1.0)
    with pytest.raises(MotionMindError, match=r"a tolerance must be from 1 to 90 degrees, not 0\.5"):
        restyle(clip, ballet, 0.5)
    with pytest.raises(MotionMindError, match="the shortest move must take from 0 to 3 s, not 4"):
        restyle(clip, ballet, shortest=4.0)
    with pytest.raises(MotionMindError, match="is a single posture; to move there must be two"):
        restyle(clip.slice(0, 1), ballet)
    fast = replace(clip, times=clip.times / 10.0)
    with pytest.raises(MotionMindError, match=r"postures at 0\.000 s and 0\.003 s are less than a frame apart"):
        pass_through(fast, ballet)
    with pytest.raises(SkeletonError):
        restyle(clip, engine("walk-hexapod"))


def test_an_error_between_two_postures_says_when() -> None:
    with pytest.raises(NoPathError, match=r"^from 0\.00 to 0\.50 s: no path"):
        restyle(recorded(1.0), engine("karate"), strict=True, moves=1)


def test_the_command_keeps_the_rig_of_the_recording(run: Run) -> None:
    write_motion("clip.bvh", recorded(1.5))
    done = run("restyle", "clip.bvh", "--corpus", "karate", "-o", "out.bvh", "--report", "out.json")
    assert done.code == 0, done.err
    assert "at their times" in done.out
    found = read_motion("out.bvh")
    clip = read_motion("clip.bvh")
    assert found.skeleton.names == clip.skeleton.names
    keys = msgspec.json.decode(Path("out.json").read_bytes())["keys"]
    assert np.degrees(rot.angle(found.rotations[keys], clip.rotations[keys])).max() < 0.01
    np.testing.assert_allclose(found.root[keys], clip.root[keys], atol=1e-4)


def test_compose_dances_a_score_in_the_style_of_a_corpus(run: Run) -> None:
    assert run("transcribe", "ballet/plies", "--to", "4", "-o", "p.score", "--shortest", "0.5").code == 0
    done = run("compose", "p.score", "--corpus", "karate", "-o", "p.json")
    assert done.code == 0, done.err
    found, score = read_motion("p.json"), compose("p.score")
    assert found.fps == pytest.approx(30.0)
    at = np.round(30.0 * score.times).astype(int)
    assert np.degrees(rot.angle(found.rotations[at], score.rotations)).max() < 1e-3


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("restyle", "ballet/plies", "-o", "t.json"), "--corpus"),
        (("restyle", "ballet/plies", "--corpus", "nothing", "-o", "t.json"), "nothing"),
        (("restyle", "ballet/plies", "--corpus", "ballet", "-o", "t.json", "--shortest", "9"), "--shortest"),
        (("restyle", "ballet/plies@3", "--corpus", "ballet", "-o", "t.json"), "a single posture"),
        (
            ("compose", "ballet/vocabulary.score", "--posture", "fifth", "--corpus", "ballet", "-o", "t.json"),
            "--corpus is for clips",
        ),
    ],
)
def test_the_commands_refuse_bad_input_in_one_line(run: Run, arguments: tuple[str, ...], message: str) -> None:
    done = run(*arguments)
    assert done.code == 2
    assert message in done.err
    assert not Path("t.json").exists()
