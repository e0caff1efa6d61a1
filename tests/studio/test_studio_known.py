"""How well a corpus knows a posture, bringing it to what is known, and postures as lines of a score."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from motionmind import Engine
from motionmind.body.contact import contact_points
from motionmind.body.motion import Posture
from motionmind.errors import MotionMindError
from motionmind.geometry import rotations as rot
from motionmind.notation.compose import posture as score_posture
from motionmind.notation.read import read_score
from motionmind.studio.handles import handles_of, mirror, turned, turns_of
from motionmind.studio.known import Memory
from motionmind.studio.reach import drag, standing_feet, standing_soles
from motionmind.studio.score_lines import score_lines


@pytest.fixture(scope="module")
def ballet() -> Engine:
    return Engine.load("ballet")


@pytest.fixture(scope="module")
def memory(ballet: Engine) -> Memory:
    return Memory(ballet)


def _posture(engine: Engine, number: int) -> Posture:
    corpus = engine.corpus
    return Posture(corpus.skeleton, corpus.rotations[number], corpus.root[number])


def _strange(posture: Posture) -> Posture:
    """A posture that no dancer of the corpus has taken."""
    posture = turned(posture, "left_shoulder", "flexion", -58.0)
    return turned(posture, "head" if "head" in posture.skeleton.names else "cervical", "bend", -24.0)


def test_every_posture_of_the_corpus_is_seen_at_every_joint(ballet: Engine, memory: Memory) -> None:
    for number in range(0, len(ballet.corpus), 211):
        assert set(memory.known(_posture(ballet, number))) == {"seen"}


def test_the_further_a_joint_is_turned_from_all_that_was_seen_the_less_it_is_known(
    ballet: Engine, memory: Memory
) -> None:
    posture = _posture(ballet, 0)
    joint = posture.skeleton.index("left_shoulder")
    order = {"seen": 0, "near": 1, "unseen": 2}
    found = [
        order[memory.known(turned(posture, "left_shoulder", "flexion", -degrees))[joint]] for degrees in range(0, 60, 4)
    ]
    assert found[0] == 0
    assert found[-1] == 2
    others = set(memory.known(turned(posture, "left_shoulder", "flexion", -56.0)))
    assert others == {"seen", "unseen"}


def test_one_step_brings_a_posture_to_what_is_known(ballet: Engine, memory: Memory) -> None:
    strange = _strange(_posture(ballet, 0))
    assert "unseen" in memory.known(strange)
    found = memory.bring_joints(strange)
    assert "unseen" not in memory.known(found)
    assert standing_feet(found) == standing_feet(strange)
    was, now = (contact_points(p.skeleton, p.rotations, p.root)[0][standing_soles(strange)] for p in (strange, found))
    assert np.abs(now - was).max() < 1e-3


def test_the_dragged_hand_stays_where_that_can_be(ballet: Engine, memory: Memory) -> None:
    posture = _posture(ballet, 0)
    wrist = posture.skeleton.index("left_wrist")
    place = posture.skeleton.positions(posture.rotations, posture.root)[wrist] + np.array([0.02, 0.1, 0.05])
    strange = drag(posture, "left_wrist", place)
    assert set(memory.known(strange)) != {"seen"}
    found = memory.bring_joints(strange, "left_wrist")
    assert "unseen" not in memory.known(found)
    assert np.linalg.norm(found.skeleton.positions(found.rotations, found.root)[wrist] - place) < 1e-3


def test_the_nearest_whole_posture_of_one_of_the_corpus_is_itself(ballet: Engine, memory: Memory) -> None:
    posture = _posture(ballet, 432)
    way = rot.about_vertical(1.0)
    turned_round = Posture(
        posture.skeleton, np.concatenate([rot.mul(way, posture.rotations[:1]), posture.rotations[1:]]), posture.root
    )
    found, clip, seconds = memory.bring_whole(turned_round)
    assert rot.angle(found.rotations, turned_round.rotations).max() < 1e-6
    assert clip
    assert seconds >= 0.0


def test_a_posture_of_another_body_is_not_compared(memory: Memory) -> None:
    insect = Engine.load("walk-hexapod").corpus
    assert not memory.fits(Posture(insect.skeleton, insect.rotations[0], insect.root[0]))


def test_turning_a_joint_stops_at_its_limits(ballet: Engine) -> None:
    posture = _posture(ballet, 0)
    for turn in turns_of(posture):
        for degrees in (turn.least - 30.0, turn.most + 30.0):
            if abs(np.clip(degrees, turn.least, turn.most)) > 170.0:  # beyond which comes the other half of the round
                continue
            found = turned(posture, turn.joint, turn.angle, degrees)
            after = next(t for t in turns_of(found) if (t.joint, t.angle) == (turn.joint, turn.angle))
            nearest = np.clip(degrees, turn.least, turn.most)
            assert abs(np.sin(np.radians(after.degrees - nearest) / 2.0)) < 1e-6


def test_turning_a_joint_by_an_angle_that_it_lacks_says_which_there_are(ballet: Engine) -> None:
    with pytest.raises(MotionMindError, match=r"left_knee has no angle bend"):
        turned(_posture(ballet, 0), "left_knee", "bend", 10.0)


def test_mirrored_twice_is_itself(ballet: Engine) -> None:
    posture = _posture(ballet, 77)
    again = mirror(mirror(posture))
    assert rot.angle(again.rotations, posture.rotations).max() < 1e-6
    np.testing.assert_allclose(again.root, posture.root)


def test_handles_are_joints_of_the_body(ballet: Engine) -> None:
    for engine in (ballet, Engine.load("walk-hexapod")):
        skeleton = engine.corpus.skeleton
        handles = handles_of(skeleton)
        assert {handle.on for handle in handles} <= set(skeleton.names)
        assert len({handle.words for handle in handles}) == len(handles) >= 8


@pytest.mark.parametrize("number", [0, 500, 1500])
def test_lines_of_a_score_are_the_posture_to_a_degree(ballet: Engine, number: int, tmp_path: Path) -> None:
    posture = _posture(ballet, number)
    score = tmp_path / "own.score"
    score.write_text(f"title Own\nbody human23\n{score_lines(posture, 'my own!')}", encoding="utf-8")
    found = score_posture(read_score(score), "my-own")
    assert np.degrees(rot.angle(found.rotations[1:], posture.rotations[1:])).max() < 1.5
