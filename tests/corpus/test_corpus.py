"""From recordings to a corpus."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from bundled_clips import ballet_clip

from motionmind.body.motion import Insertion, Motion
from motionmind.body.skeleton import Skeleton
from motionmind.corpus.clip import Clip
from motionmind.corpus.corpus import Corpus
from motionmind.corpus.flips import find_flips
from motionmind.corpus.gather import gather
from motionmind.corpus.recordings import floor_of
from motionmind.errors import CorpusError, MotionMindError
from motionmind.geometry import rotations as rot

ARM = Skeleton("arm", ("shoulder", "elbow", "wrist"), (-1, 0, 1), np.array([[0.0, 0, 0], [0.3, 0, 0], [0.2, 0, 0]]))
ELBOW = 1


def swing(name: str, frames: int = 30, fps: float = 120.0, jumps: dict[int, float] | None = None) -> Motion:
    """An arm that swings slowly; from each frame in `jumps` on, the elbow is turned by so many degrees more."""
    t = np.arange(frames) / fps
    angles = np.stack([0.3 * np.sin(t), np.cos(t), 0.1 * t], axis=1)
    for frame, degrees in (jumps or {}).items():
        angles[frame:, ELBOW] += np.radians(degrees)
    q = rot.from_axis_angle([0.0, 0.0, 1.0], angles)
    return Motion(ARM, q, np.stack([t, 1.0 + 0.0 * t, 0.0 * t], axis=1), t, name)


def bounds(corpus: Corpus) -> list[tuple[str, int]]:
    return [(clip.name, clip.stop - clip.start) for clip in corpus.clips]


# --- flips ------------------------------------------------------------------------------------------------------------


def test_a_flip_is_found_with_its_joint_frame_and_angle() -> None:
    (fault,) = find_flips(swing("wave", jumps={17: 90.0}))
    assert (fault.clip, fault.joint, fault.frame) == ("wave", "elbow", 17)
    assert fault.degrees == pytest.approx(90.0, abs=1.0)


def test_a_flip_by_half_a_turn_either_way_is_one_flip() -> None:
    assert [fault.frame for fault in find_flips(swing("wave", jumps={5: 180.0, 20: -180.0}))] == [5, 20]


def test_both_signs_of_a_quaternion_are_no_flip() -> None:
    motion = swing("wave")
    signs = np.where(np.arange(30) % 2 == 0, 1.0, -1.0)[:, None, None]
    assert find_flips(replace(motion, rotations=motion.rotations * signs)) == ()


def test_keyframes_that_lie_far_apart_are_spared() -> None:
    assert len(find_flips(swing("recorded", fps=120.0, jumps={9: 90.0}))) == 1
    assert find_flips(swing("keyframed", fps=2.0, jumps={9: 90.0})) == ()
    assert find_flips(swing("one frame", frames=1)) == ()


def test_the_angle_of_a_flip_is_a_choice() -> None:
    motion = swing("wave", jumps={10: 40.0})
    assert find_flips(motion) == ()
    assert len(find_flips(motion, degrees=35.0)) == 1


# --- the rate of postures ---------------------------------------------------------------------------------------------


def test_recordings_give_5_postures_a_second_and_keyframes_all_of_theirs(caplog: pytest.LogCaptureFixture) -> None:
    """Whatever says that they are keyframes: the motion itself, or that there are fewer than 15 a second."""
    film, score = swing("film", 121), replace(swing("score", 31, fps=30.0), keyframed=True)
    slow, drawn = swing("slow", 26, fps=12.5), swing("drawn", 16, fps=15.0)
    with caplog.at_level("INFO", "motionmind"):
        corpus = gather("arms", [film, score, slow, drawn])
    assert bounds(corpus) == [("film", 6), ("score", 31), ("slow", 26), ("drawn", 6)]
    np.testing.assert_allclose(corpus.seconds[:5], 0.2)
    np.testing.assert_array_equal(corpus.times[6:37], score.times)
    assert corpus.rate == 5.0
    assert [record.getMessage() for record in caplog.records] == [
        "corpus arms: 5 postures a second of each recording (--rate, or rate=, for more or fewer)",
        "corpus arms: stays on the recordings' own 3 joints: the joints of arm do not map to human23: they have the "
        "names of no known rig (--joints maps them)",
    ]


@pytest.mark.parametrize(("frames", "words"), [(1, "a frame"), (30, "30 frames")])
def test_a_posture_that_was_added_before_the_movement_is_noticed(
    frames: int, words: str, caplog: pytest.LogCaptureFixture
) -> None:
    plain = swing("plain", 121, fps=60.0)
    posed = np.concatenate([np.tile(rot.from_axis_angle([1.0, 0.0, 0.0], [1.5] * 3), (frames, 1, 1)), plain.rotations])
    times = np.arange(len(posed)) / 60.0
    added = replace(plain, rotations=posed, root=np.tile(plain.root[0], (len(posed), 1)), times=times)
    said = f"most recordings begin with {words} of another posture (a T-pose?): built with --skip {frames} "
    for motions, skip, is_said in (
        ([added, added, plain], 0, True),
        ([added, plain], 0, False),
        ([added, added, plain], frames, False),
        ([swing("jump", 121, jumps={1: 90.0})], 0, False),
    ):
        caplog.clear()
        with caplog.at_level("INFO", "motionmind"):
            gather("arms", motions, skip=skip)
        assert (said in caplog.text) is is_said


def test_a_posture_that_skipping_leaves_is_noticed(caplog: pytest.LogCaptureFixture) -> None:
    plain = swing("plain", 121, fps=60.0)
    posed = np.concatenate([np.tile(rot.from_axis_angle([1.0, 0.0, 0.0], [1.5] * 3), (30, 1, 1)), plain.rotations])
    added = replace(plain, rotations=posed, root=np.tile(plain.root[0], (151, 1)), times=np.arange(151) / 60.0)
    with caplog.at_level("INFO", "motionmind"):
        gather("arms", [added], skip=1)
    assert "begin with 29 frames of another posture (a T-pose?): built with --skip 30" in caplog.text


def test_what_the_engine_made_is_told(caplog: pytest.LogCaptureFixture) -> None:
    plain = swing("plain", 121, fps=60.0)
    made = replace(plain, name="made", insertions=(Insertion(plain.times[[20, 100]]),))
    for clips, said in (([plain], False), ([plain, made], True)):
        caplog.clear()
        with caplog.at_level("INFO", "motionmind"):
            gather("arms", clips)
        told = "1 of 2 recordings hold movement that the engine made, learned as if it were recorded: made"
        assert (told in caplog.text) is said


def test_a_floor_that_is_off_is_told(caplog: pytest.LogCaptureFixture) -> None:
    film = ballet_clip("adagio").resample(30.0)
    own = floor_of(film)
    for height, said in ((0.0, ""), (0.02, ""), (0.044, "film by 4 cm over"), (-0.11, "film by 11 cm under")):
        caplog.clear()
        with caplog.at_level("INFO", "motionmind"):
            gather("mine", [replace(film, name="film", root=film.root + np.array([0.0, height - own, 0.0]))])
        assert ("feet stand off 0 in 1 of 1 recordings" in caplog.text) is bool(said)
        assert said in caplog.text


def test_keyframes_alone_have_no_rate_and_nothing_is_said(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level("INFO", "motionmind"):
        corpus = gather("arms", [swing("slow", 26, fps=12.5)])
    assert (corpus.rate, len(corpus), caplog.records) == (None, 26, [])
    again = gather("arms", [corpus.motion(corpus.clips[0])])
    np.testing.assert_array_equal(again.rotations, corpus.rotations)


@pytest.mark.parametrize("rate", [10.0, None])
def test_a_rate_that_is_given_is_for_all(rate: float | None, caplog: pytest.LogCaptureFixture) -> None:
    motions = [swing("film", 121), replace(swing("score", 31, fps=30.0), keyframed=True)]
    with caplog.at_level("INFO", "motionmind"):
        corpus = gather("arms", motions, rate=rate)
    assert [len(clip) for clip in corpus.clips] == ([11, 11] if rate else [121, 31])
    assert (corpus.rate, "postures a second" in caplog.text) == (rate, False)


def test_a_score_among_recordings_has_no_detail() -> None:
    quick = replace(shaking(61, 30.0), keyframed=True)
    corpus = gather("arms", [shaking(241, 120.0), quick])
    assert np.abs(corpus.detail[:10]).max() > 0.0
    assert np.abs(corpus.detail[11:]).max() == 0.0


def test_frames_between_keyframes_are_no_keyframes() -> None:
    score = replace(swing("score", 31, fps=30.0), keyframed=True)
    assert score.slice(3, 9).keyframed
    assert not score.resample(10.0).keyframed


def test_recordings_join_a_corpus_of_their_rate_and_no_other() -> None:
    theirs = [gather("theirs", [swing("film", 121)], rate=rate) for rate in (5.0, 4.0)]
    assert gather("arms", [swing("film", 121)], mix=[(theirs[0], 1.0)]).rate == 5.0
    with pytest.raises(CorpusError, match=r"different rates \(5 postures a second, 4 postures a second\)"):
        gather("arms", [swing("film", 121)], mix=[(theirs[1], 1.0)])


# --- gather -----------------------------------------------------------------------------------------------------------


def test_a_flip_is_repaired_and_no_jump_is_learned() -> None:
    corpus = gather("arms", [swing("a", jumps={10: 90.0, 11: -90.0, 20: 90.0}), swing("b")], rate=None)
    assert bounds(corpus) == [("a", 30), ("b", 30)]
    turned = rot.angle(corpus.rotations[corpus.begins], corpus.rotations[corpus.begins + 1])
    assert np.degrees(turned).max() < 10.0
    assert [(fault.clip, fault.frame) for fault in corpus.faults] == [("a", 10), ("a", 11), ("a", 20)]


def restless(name: str) -> Motion:
    """An arm whose elbow jumps to and fro from frame 50 to 210, for more than a second."""
    return swing(name, 261, jumps={50 + 20 * number: 90.0 * (-1) ** number for number in range(9)})


def test_a_recording_is_cut_where_a_joint_jumps_for_too_long_to_be_repaired() -> None:
    corpus = gather("arms", [restless("a"), swing("b")], rate=None)
    parts = [(f"a.{number}", 20) for number in range(2, 10)]
    assert bounds(corpus) == [("a.1", 50), *parts, ("a.10", 51), ("b", 30)]
    assert {fault.repair for fault in corpus.faults} == {"none"}
    assert all(clip.repairs == () for clip in corpus.clips)


def test_keep_takes_a_flip_as_it_is_and_drop_leaves_its_recording_out() -> None:
    motions = [swing("a", jumps={10: 90.0}), swing("b")]
    kept, dropped = (gather("arms", motions, flips=flips, rate=None) for flips in ("keep", "drop"))
    assert bounds(kept) == [("a", 30), ("b", 30)]
    assert bounds(dropped) == [("b", 30)]
    assert kept.faults == dropped.faults
    assert len(kept.faults) == 1


def test_frames_after_skipped_ones_keep_the_recordings_numbers() -> None:
    corpus = gather("arms", [swing("a", jumps={1: 90.0, 12: 90.0})], skip=2, rate=None)
    assert [fault.frame for fault in corpus.faults] == [12]  # the jump among what is skipped is none
    assert bounds(corpus) == [("a", 28)]
    assert corpus.clips[0].repairs[0].start < 12 < corpus.clips[0].repairs[0].stop
    np.testing.assert_array_equal(corpus.times[0], 2 / 120.0)


def test_no_move_leads_from_one_clip_to_the_next() -> None:
    corpus = gather("arms", [swing("a", 4), swing("one", 1), swing("b", 3)], rate=None)
    assert bounds(corpus) == [("a", 4), ("one", 1), ("b", 3)]
    np.testing.assert_array_equal(corpus.begins, [0, 1, 2, 5, 6])
    np.testing.assert_allclose(corpus.seconds, 1 / 120.0)
    assert [corpus.where(posture) for posture in (0, 3, 4, 5, 7)] == [
        ("a", 0),
        ("a", 3),
        ("one", 0),
        ("b", 0),
        ("b", 2),
    ]


def test_postures_are_made_even_in_time_after_the_cut() -> None:
    corpus = gather("arms", [restless("a")], rate=20.0)
    # Parts of 20 frames have 4 postures, 6 frames apart.
    assert bounds(corpus) == [("a.1", 9), *((f"a.{number}", 4) for number in range(2, 10)), ("a.10", 9)]
    np.testing.assert_allclose(corpus.seconds, 0.05)
    assert corpus.rate == 20.0


def shaking(frames: int, fps: float, seed: int = 0) -> Motion:
    """An arm that swings and shakes, faster than 5 postures a second tell."""
    slow, t = swing("a", frames, fps), np.arange(frames) / fps
    shake = 0.03 * np.sin(40.0 * t[:, None, None] + np.random.default_rng(seed).uniform(0.0, 6.0, (3, 3)))
    return replace(slow, rotations=rot.mul(slow.rotations, rot.exp(shake)))


@pytest.mark.parametrize(("fps", "rate"), [(120.0, 5.0), (60.0, 10.0), (30.0, 6.0)])
def test_a_corpus_keeps_what_its_postures_leave_out(fps: float, rate: float) -> None:
    clip = shaking(int(8.0 * fps), fps)
    corpus = gather("arms", [clip], rate=rate)
    again = corpus.recording(corpus.clips[0])
    assert again.fps == pytest.approx(30.0)
    off = rot.angle(again.rotations, clip.at(again.times).rotations)
    assert off.max() < 1e-4  # half floats: four digits of some hundredths
    assert np.abs(corpus.detail[-1]).max() == 0.0
    assert np.abs(again.root - clip.at(again.times).root).max() < 1e-6  # it goes evenly


@pytest.mark.parametrize("rate", [None, 5.0])
@pytest.mark.parametrize(("start", "stop"), [(0, 7), (3, 20), (11, None), (0, 10_000)])
def test_part_of_a_recording_is_that_of_the_whole(rate: float | None, start: int, stop: int | None) -> None:
    corpus = gather("arms", [shaking(300, 60.0), shaking(400, 60.0, 1)], rate=rate)
    for clip in corpus.clips:
        whole = corpus.recording(clip)
        part, wanted = corpus.recording(clip, start, stop), whole.slice(start, len(whole) if stop is None else stop)
        for name in ("rotations", "root", "times", "name", "keyframed", "recorded"):
            np.testing.assert_array_equal(getattr(part, name), getattr(wanted, name))


def test_a_joint_that_jumps_between_two_postures_has_no_detail_there() -> None:
    clip = shaking(361, 60.0)
    rotations = clip.rotations.copy()
    rotations[100:104, ELBOW] = rot.mul(rotations[100:104, ELBOW], rot.from_axis_angle([0.0, 1.0, 0.0], 1.0))
    corpus, clean = (
        gather("arms", [one], rate=5.0, flips="keep") for one in (replace(clip, rotations=rotations), clip)
    )
    assert not np.any(corpus.detail[8, :, ELBOW])  # from 96 to 108, of 12 frames a posture
    for changed in (corpus, clean):
        changed.detail.setflags(write=True)
        changed.detail[8, :, ELBOW] = 0.0
    np.testing.assert_array_equal(corpus.detail, clean.detail)


def test_nothing_is_kept_of_coarse_recordings_nor_where_every_frame_is_a_posture() -> None:
    for clip, rate in ((shaking(60, 10.0), 5.0), (shaking(300, 50.0), None), (shaking(300, 50.0), 30.0)):
        corpus = gather("arms", [clip], rate=rate)
        assert not np.any(corpus.detail)
        again = corpus.recording(corpus.clips[0]).at(corpus.times)
        assert rot.angle(again.rotations, corpus.rotations).max() < 1e-7


def test_a_cut_leaves_no_detail_of_the_jumps() -> None:
    corpus = gather("arms", [restless("jump")], rate=5.0)
    assert len(corpus.clips) == 2
    assert np.abs(corpus.detail).max() < np.radians(1.0)


def test_recordings_of_one_name_are_told_apart() -> None:
    corpus = gather("arms", [swing("a", 3), swing("a", 4), swing("", 3), swing("a", 5), swing("", 3)], rate=None)
    assert [clip.name for clip in corpus.clips] == ["a", "a (2)", "clip", "a (3)", "clip (2)"]


def test_chains_come_back_as_the_rotations_that_they_were_made_of() -> None:
    rng = np.random.default_rng(0)
    q = rot.normalise(rng.normal(size=(50, 3, 4)))
    for facing, chains in (("free", ("shoulder", "elbow", "wrist", "facing")), ("stage", ARM.names)):
        corpus = gather("arms", [swing("a")], facing=facing)  # type: ignore[arg-type]
        assert corpus.chains == chains
        assert corpus.to_chains(q).shape == (50, len(chains), 4)
        assert rot.angle(corpus.from_chains(corpus.to_chains(q)), q).max() < 1e-14
    turned = q.copy()
    turned[:, 0] = rot.mul(rot.about_vertical(1.0), q[:, 0])
    free = gather("arms", [swing("a")], facing="free", rate=None)
    assert rot.angle(free.to_chains(turned)[:, :3], free.to_chains(q)[:, :3]).max() < 1e-7


@pytest.mark.parametrize(
    ("motions", "options", "words"),
    [
        ([], {}, "no recordings given"),
        ([swing("one", 1)], {}, "no recording holds two postures, so there is no move to learn"),
        ([swing("a", 4)], {"rate": 5.0}, "no recording holds two postures at 5 postures a second"),
        ([swing("a", 5)], {"skip": 5}, "a has 5 frames; skipping 5 leaves none"),
        ([swing("a")], {"skip": -1}, "frames to skip must be at least 0, not -1"),
        ([swing("a", jumps={3: 90.0})], {"flips": "drop"}, "every recording has faults"),
        ([swing("a")], {"flips": "mend"}, "flips must be one of drop, keep, repair, not 'mend'"),
        ([swing("a")], {"flip_degrees": np.nan}, "the angle of a flip"),
        ([swing("a")], {"flip_degrees": 0.0}, "the angle of a flip"),
        ([swing("a")], {"facing": "north"}, "facing must be 'free' or 'stage', not 'north'"),
        ([swing("a")], {"rate": 0.0}, "a rate must be a positive number"),
        ([swing("a")], {"rate": np.nan}, "a rate must be a positive number"),
    ],
)
def test_what_leaves_nothing_to_learn_is_refused(motions: list[Motion], options: dict[str, Any], words: str) -> None:
    with pytest.raises(MotionMindError, match=words):
        gather("arms", motions, **{"rate": None, **options})


def test_a_recording_on_another_skeleton_is_refused_and_the_difference_named() -> None:
    other = Skeleton("hook", ("shoulder", "elbow", "hook"), (-1, 0, 1), ARM.offsets)
    with pytest.raises(CorpusError, match="b is on another skeleton than a: hook lacks wrist and adds hook"):
        gather("arms", [swing("a"), replace(swing("b"), skeleton=other)], rate=None)


def test_a_joint_cannot_have_the_name_of_the_bodys_turn() -> None:
    odd = Skeleton("odd", ("shoulder", "elbow", "facing"), (-1, 0, 1), ARM.offsets)
    with pytest.raises(CorpusError, match="a joint cannot be called 'facing'"):
        gather("arms", [replace(swing("a"), skeleton=odd)], rate=None)


def test_clips_and_arrays_that_do_not_fit_are_refused() -> None:
    corpus = gather("arms", [swing("a", 4)], rate=None)
    for clips in ((), (Clip("a", 0, 3),), (Clip("a", 1, 4),), (Clip("a", 0, 2), Clip("b", 3, 4))):
        with pytest.raises(CorpusError, match="the clips do not follow one another"):
            replace(corpus, clips=clips)
    with pytest.raises(CorpusError, match="rotations, root and times"):
        replace(corpus, root=corpus.root[:3])
    with pytest.raises(CorpusError, match="its detail is not that of 4 postures"):
        replace(corpus, detail=corpus.detail[:3])
    with pytest.raises(CorpusError, match="no postures"):
        replace(corpus, clips=(), rotations=corpus.rotations[:0], root=corpus.root[:0], times=corpus.times[:0])
