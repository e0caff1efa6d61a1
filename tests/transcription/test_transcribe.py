"""Transcription: the score says the movement, composes back to it, and is honest about what it leaves out."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import msgspec
import numpy as np
import pytest
from bundled_clips import ballet_clip
from command_line import Run

from motionmind import MotionMindError, compose, read_motion, read_score
from motionmind.body.anatomy_file import anatomy_named
from motionmind.body.mirror import mirrored
from motionmind.body.motion import Motion
from motionmind.body.support import find_support
from motionmind.clean.stances import find_foot_stances
from motionmind.geometry import rotations as rot
from motionmind.notation.compose import played
from motionmind.transcription import Transcription, transcribe
from motionmind.transcription.angles import leads_left, mirror_trunk, write_angles
from motionmind.transcription.bones import Bones, deviations
from motionmind.transcription.recorded import prepare
from motionmind.transcription.words import limb_word, trunk_word

HUMAN = anatomy_named("human23")
BONES = Bones.of(HUMAN)


@cache
def recorded(clip: str = "adagio", seconds: float = 12.0) -> Motion:
    """A bundled clip as a camera would record it: 30 frames a second."""
    motion = ballet_clip(clip).resample(30.0)
    return motion.slice(0, round(30.0 * seconds))


@cache
def transcribed(tolerance: float = 8.0) -> Transcription:
    return transcribe(recorded(), tolerance)


def composed(folder: Path, found: Transcription) -> Motion:
    path = folder / "found.score"
    path.write_text(found.text, encoding="utf-8")
    return compose(path)


def test_the_score_composes_to_the_movement_that_was_compared(tmp_path: Path) -> None:
    found = transcribed()
    motion = composed(tmp_path, found)
    np.testing.assert_array_equal(motion.rotations, found.motion.rotations)
    np.testing.assert_array_equal(motion.root, found.motion.root)
    np.testing.assert_allclose(motion.times, (found.keys - found.keys[0]) / 30.0, atol=2e-4)


@pytest.mark.parametrize("tolerance", [4.0, 8.0, 20.0])
def test_between_postures_every_bone_stays_within_the_tolerance(tolerance: float) -> None:
    found = transcribe(recorded(), tolerance)
    prepared = prepare(recorded(), tolerance)
    played = found.motion.at(prepared.motion.times - prepared.motion.times[0])
    off = deviations(BONES.directions(played.rotations), BONES.directions(prepared.writable))
    inside = np.setdiff1d(np.arange(len(off)), found.keys)
    assert np.all(off[inside] <= BONES.allowed(tolerance) + 0.05)  # times are rounded to 0.1 ms
    apart = (prepared.motion.root[0] - played.root[0]) * [1.0, 0.0, 1.0]
    # Heights are those of the written posture; so is the place, to a centimetre.
    assert np.abs(played.root + apart - prepared.root).max() <= 0.005 * tolerance + 0.01


@pytest.mark.parametrize("name", ["sound", "start", "tempo", "left", "neutral", "3rd", "###"])
def test_any_name_gives_a_score_that_is_read(name: str) -> None:
    found = transcribe(recorded().slice(0, 5), 12.0, name=name)
    assert len(found.motion) > 1


def test_a_wider_tolerance_needs_fewer_postures() -> None:
    counts = [len(transcribe(recorded(), tolerance).keys) for tolerance in (3.0, 8.0, 20.0)]
    assert counts == sorted(counts, reverse=True)
    assert counts[0] > 1.5 * counts[-1]


def test_the_adagio_comes_back_in_about_as_many_postures_as_it_was_written_in() -> None:
    whole = ballet_clip("adagio")
    found = transcribe(whole.resample(30.0), 12.0)
    assert 0.7 * len(whole) <= len(found.keys) <= 1.0 * len(whole)


def test_movement_between_keyframes_is_transcribed_to_its_end() -> None:
    whole = ballet_clip("temps-lie")
    found = transcribe(whole, 12.0)
    assert found.motion.times[-1] == pytest.approx(whole.times[-1] - whole.times[0], abs=0.04)
    assert len(found.recording) > 10 * len(whole)


def test_deviations_are_those_of_the_composed_movement() -> None:
    found = transcribed()
    played = found.motion.at(found.recording.times)
    off = deviations(BONES.directions(played.rotations), BONES.directions(found.recording.rotations))
    for layer, bones in BONES.layers.items():
        np.testing.assert_allclose(found.deviation.degrees[layer], off[:, bones].max(axis=1), atol=0.006)
    report = msgspec.json.decode(found.report())
    assert report["keys"] == found.keys.tolist()
    assert report["frames_per_second"] == pytest.approx(30.0)
    assert report["deviation"]["centimetres"] == found.deviation.centimetres


def test_what_a_joint_cannot_do_is_reported_as_unwritten() -> None:
    """A knee has no twist: a foot that turns in it cannot be written, and nothing else suffers."""
    motion = recorded(seconds=2.0)
    knee = HUMAN.named("knee", "left")
    rotations = motion.rotations.copy()
    rotations[:, knee] = [0.0, np.sin(np.radians(20.0)), 0.0, np.cos(np.radians(20.0))]  # 40 degrees about its length
    ankle = HUMAN.named("ankle", "left")
    rotations[:, ankle] = [0.0, np.sin(np.radians(20.0)), 0.0, np.cos(np.radians(20.0))]  # 80 in all; it has 30
    found = transcribe(replace(motion, rotations=rotations), 6.0)
    assert 20.0 < max(found.deviation.unwritten["legs"]) < 60.0
    assert max(found.deviation.unwritten["arms"]) < 2.0


def test_the_mirror_image_has_the_same_vocabulary() -> None:
    motion = recorded()
    one, other = transcribe(motion, 8.0), transcribe(mirrored(motion), 8.0)
    assert [len(one.keys), one.keys.tolist()] == [len(other.keys), other.keys.tolist()]
    words = [{layer: sorted(names) for layer, names in read_names(found).items()} for found in (one, other)]
    assert words[0] == words[1]


def read_names(found: Transcription) -> dict[str, list[str]]:
    """The names of each layer's positions."""
    names: dict[str, list[str]] = {}
    layer = ""
    for line in found.text.splitlines():
        if line in HUMAN.layers:
            layer = line
        elif line.startswith("clip"):
            break
        elif " = " in line:
            names.setdefault(layer, []).append(line.split(" = ")[0].strip())
    return names


def test_durations_follow_the_tempo(tmp_path: Path) -> None:
    motion = recorded(seconds=4.0)
    for tempo in (60.0, 108.0, 93.7):
        found = transcribe(motion, 8.0, tempo=tempo)
        assert f"tempo   {tempo:g}" in found.text
        assert composed(tmp_path, found).times[-1] == pytest.approx(motion.times[-1] - motion.times[0], abs=1e-3)


def test_a_standing_foot_stays_and_travel_is_written(tmp_path: Path) -> None:
    found = transcribe(ballet_clip("temps-lie").resample(30.0), 8.0)
    assert " on" in found.text
    end = found.motion.root[-1] - found.motion.root[0]
    went = found.recording.root[-1] - found.recording.root[0]
    assert np.linalg.norm((end - went)[[0, 2]]) <= 0.04 + 0.01


def test_a_leg_bears_also_while_its_foot_turns_or_slides() -> None:
    turning = prepare(ballet_clip("pirouettes").resample(30.0), 6.0)
    _, feet = find_foot_stances(turning.motion)
    stand_still = sum(stop - start for foot in feet for start, stop in foot.stances)
    assert stand_still < 0.9 * turning.bears.sum()
    assert turning.bears.any(axis=1).all()
    jumping = prepare(ballet_clip("sautes").resample(30.0), 6.0)
    assert 0.1 < (~jumping.bears.any(axis=1)).mean() < 0.5
    moved = jumping.motion
    support = find_support(moved.skeleton, moved.rotations, moved.root, moved.fps)
    assert support.airborne.any()
    assert not jumping.bears[support.airborne].any()


def test_a_jump_is_written_in_the_air() -> None:
    found = transcribe(ballet_clip("sautes").resample(30.0), 8.0)
    assert " up " in found.text
    assert found.motion.root[:, 1].max() == pytest.approx(found.recording.root[:, 1].max(), abs=0.05)


def test_one_frame_is_one_posture(tmp_path: Path) -> None:
    found = transcribe(recorded().slice(40, 41), 6.0)
    assert len(found.keys) == 1 == len(composed(tmp_path, found))


def test_angles_of_whole_degrees_come_back() -> None:
    rng = np.random.default_rng(3)
    least, most = HUMAN.limits
    degrees = np.zeros((40, len(HUMAN.skeleton), 3))
    for index, name in enumerate(HUMAN.skeleton.names):
        for angle in HUMAN.anatomy(name)[1].angles.values():
            low, high = least[index, angle.axis], most[index, angle.axis]
            degrees[:, index, angle.axis] = np.round(0.5 * rng.uniform(low, high, 40))
    degrees[:, 0, 1] = np.round(degrees[:, 0, 1])
    written = write_angles(
        BONES, HUMAN.rotations(dict(zip(HUMAN.skeleton.names, degrees.swapaxes(0, 1), strict=True))), 0.0
    )
    np.testing.assert_array_equal(written.facing, degrees[:, 0, 1])
    degrees[:, 0, 1] = 0.0
    np.testing.assert_array_equal(written.degrees, degrees)


@pytest.mark.parametrize(("turning", "below"), [("elbow", "wrist"), ("shoulder", "elbow")])
def test_a_segment_turns_about_its_length_as_the_next_one_needs_it(turning: str, below: str) -> None:
    bent = np.tile([0.0, 0.0, -60.0], (len(recorded()), 1))
    hands = HUMAN.rotations({"left_wrist": bent, "right_wrist": bent})
    rotations = recorded().rotations.copy()
    for side, turn in (("left", 50.0), ("right", -50.0)):  # which the joint below takes back
        joint, after, wrist = (HUMAN.named(name, side) for name in (turning, below, "wrist"))
        rotations[:, wrist] = hands[:, wrist]
        twist = rot.from_axis_angle([1.0, 0.0, 0.0], np.radians(turn))
        rotations[:, joint] = rot.mul(rotations[:, joint], twist)
        rotations[:, after] = rot.inv_mul(twist, rotations[:, after])
    written = write_angles(BONES, rotations, 0.0)
    off = deviations(BONES.directions(written.turned()), BONES.directions(rotations))
    assert np.percentile(off, 99.0) < 2.5


def test_merged_positions_are_few_and_near() -> None:
    rotations = prepare(recorded(), 8.0).motion.rotations
    exact, merged = write_angles(BONES, rotations, 0.0), write_angles(BONES, rotations, 8.0)
    arms = [HUMAN.named(joint, "left") for joint in HUMAN.layers["arms"]]
    assert len(np.unique(merged.degrees[:, arms], axis=0)) < 0.5 * len(np.unique(exact.degrees[:, arms], axis=0))
    off = deviations(BONES.directions(merged.turned()), BONES.directions(exact.turned()))
    assert np.all(np.percentile(off, 99.0, axis=0) <= BONES.allowed(8.0))


def test_a_trunk_and_its_mirror_image_are_written_for_one_side() -> None:
    rng = np.random.default_rng(5)
    trunks = np.round(rng.uniform(-30.0, 30.0, (50, 3, 3)))
    assert np.all(leads_left(trunks) != leads_left(mirror_trunk(trunks)))
    np.testing.assert_array_equal(mirror_trunk(mirror_trunk(trunks)), trunks)
    assert leads_left(np.zeros((3, 3)))


@pytest.mark.parametrize(
    ("direction", "bend", "word"),
    [
        ((0.0, -1.0, 0.0), 0.0, "down"),
        ((0.0, 1.0, 0.0), 90.0, "up-bent"),
        ((0.0, 0.0, 1.0), 0.0, "front-middle"),
        ((0.7, -0.7, 0.0), 0.0, "out-low"),
        ((-0.5, 0.7, 0.5), 0.0, "front-across-high"),
        ((0.0, 0.0, -1.0), 0.0, "back-middle"),
    ],
)
def test_limbs_are_named_by_direction_and_level(direction: tuple[float, ...], bend: float, word: str) -> None:
    assert limb_word(np.array(direction) / np.linalg.norm(direction), bend) == word


def test_trunks_are_named_by_lean_and_turn() -> None:
    assert trunk_word(np.array([0.0, 1.0, 0.0]), 5.0) == "upright"
    assert trunk_word(np.array([0.0, 0.5, 0.86]), -40.0) == "forward-turned"
    assert trunk_word(np.array([0.0, 0.1, -0.99]), 0.0) == "back-deep"
    assert trunk_word(np.array([0.6, 0.8, 0.0]), 0.0) == "aside"


def test_what_cannot_be_transcribed_is_refused_in_words() -> None:
    motion = recorded(seconds=2.0)
    with pytest.raises(MotionMindError, match=r"a tolerance must be from 1 to 90 degrees, not 0\.5"):
        transcribe(motion, 0.5)
    with pytest.raises(MotionMindError, match="a tempo must be from 1 to 6000"):
        transcribe(motion, tempo=0.0)
    slow = replace(motion, times=motion.times * 1000.0)
    with pytest.raises(MotionMindError, match=r"lasts .* s, and a transcription at most 600 s; choose a part"):
        transcribe(slow)


def test_an_insect_is_refused(run: Run) -> None:
    done = run("transcribe", "walk-hexapod/walk", "-o", "insect.score")
    assert done.code == 2
    assert len(done.err.splitlines()) == 1
    assert not Path("insect.score").exists()


def test_the_command_writes_a_score_that_compose_reads(run: Run) -> None:
    done = run(
        "transcribe", "ballet/temps-lie", "-o", "t.score", "--tolerance", "10", "--tempo", "108", "--report", "r.json"
    )
    assert done.code == 0
    assert "the fewest within 10 degrees and 5 cm" in done.out
    assert run("compose", "t.score", "-o", "t.bvh", "--fps", "30").code == 0
    assert read_motion("t.bvh").fps == pytest.approx(30.0)
    assert msgspec.json.decode(Path("r.json").read_bytes())["tolerance"] == 10.0
    assert read_score("t.score").tempo == 108.0
    ((rows, _),) = played(read_score("t.score"))
    assert len(rows) == len(msgspec.json.decode(Path("r.json").read_bytes())["keys"])


@pytest.mark.long
def test_the_score_is_seen_beside_the_recording(run: Run) -> None:
    done = run(
        "transcribe",
        "ballet/temps-lie",
        "--to",
        "40",
        "-o",
        "t.gif",
        "-o",
        "t.html",
        "-o",
        "t.png",
        "--tolerance",
        "20",
    )
    assert done.code == 0
    assert all(Path(f"t.{suffix}").stat().st_size > 5000 for suffix in ("gif", "html", "png"))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("ballet/temps-lie", "-o", "t.txt"), "must end in one of .score"),
        (("ballet/nothing", "-o", "t.score"), "no posture or clip 'nothing'"),
        (("ballet/temps-lie", "-o", "t.score", "--tolerance", "0"), "--tolerance"),
        (("ballet/temps-lie", "-o", "t.score", "--tempo", "0"), "--tempo"),
    ],
)
def test_the_command_refuses_bad_input_in_one_line(run: Run, arguments: tuple[str, ...], message: str) -> None:
    done = run("transcribe", *arguments)
    assert done.code == 2
    assert message in done.err
    assert not Path("t.score").exists()


@pytest.mark.long
@pytest.mark.parametrize("file", ["cmu-05/05_02.bvh", "cmu-29/29_02.amc", "cmu-135/135_06.amc", "indian/06.bvh"])
def test_recordings_come_back_within_what_is_reported(shared_data: Path, file: str, tmp_path: Path) -> None:
    motion = read_motion(shared_data / file)
    found, prepared = transcribe(motion, 6.0), prepare(motion, 6.0)
    assert composed(tmp_path, found).times[-1] == pytest.approx(found.recording.times[-1], abs=0.01)
    wide = BONES.lengths > 0.15
    played = found.motion.at(found.recording.times)
    off = deviations(BONES.directions(played.rotations), BONES.directions(found.recording.rotations))[:, wide]
    assert np.percentile(off.max(axis=1), 50.0) <= 6.0
    assert np.percentile(found.deviation.centimetres, 95.0) <= 3.0
    start = (prepared.root[0] - played.root[0]) * [1.0, 0.0, 1.0]
    assert rot.norm(played.root + start - prepared.root).max() <= 0.03  # with feet that bear put on the floor


def test_names_of_clips_are_those_that_a_score_allows() -> None:
    motion = replace(recorded(seconds=0.5), name="take 3/über (1).bvh")
    assert "clip über--1--bvh:" in transcribe(motion, 20.0).text
    assert "clip clip-05-02:" in transcribe(replace(motion, name="05_02"), 20.0).text


def test_a_title_stays_on_its_line(tmp_path: Path) -> None:
    found = transcribe(replace(recorded(seconds=0.5), name="hero.glb#Dance,\nagain,"), 20.0)
    assert found.text.startswith("title   hero.glb Dance, again\nbody    human23\n")
    assert len(composed(tmp_path, found)) == len(found.keys)
