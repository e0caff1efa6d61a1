"""Tweens of duets: both ends are exact, and the couple keeps together between them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bundled_clips import ballet_clip

from motionmind.body.mirror import mirrored
from motionmind.body.motion import Motion
from motionmind.duets import tween_duet
from motionmind.duets.relations import relate
from motionmind.ensemble.dancers import Dancer
from motionmind.errors import MotionMindError, SkeletonError
from motionmind.tween.engine import Engine


@pytest.fixture(scope="module")
def ballet() -> Engine:
    return Engine.load("ballet")


def face_to_face(clip: str, apart: float) -> tuple[Motion, Motion]:
    """Dancers who mirror each other in the plane z = 0."""
    piece = ballet_clip(clip).resample(30.0)
    one = Dancer("one", piece, (0.0, -0.5 * apart)).placed()
    other = Dancer("other", mirrored(piece), (0.0, 0.5 * apart), np.pi).placed()
    return one, replace(other, times=one.times)


def couple(duet: tuple[Motion, Motion], frame: int) -> tuple[object, object]:
    return duet[0].posture(frame), duet[1].posture(frame)


def test_hands_that_both_ends_hold_are_held_between_them(ballet: Engine) -> None:
    duet = face_to_face("adagio", 0.6)
    relations = relate(*duet)
    held = relations.held[70] & relations.held[130]
    assert held.any()
    found = tween_duet(ballet, couple(duet, 70), couple(duet, 130), [face_to_face("valse", 0.6)])  # type: ignore[arg-type]
    for motion, own in zip(found.motions, duet, strict=True):
        for frame, given in ((0, 70), (-1, 130)):
            np.testing.assert_allclose(motion.root[frame], own.root[given], atol=1e-9)
            np.testing.assert_allclose(np.abs(np.sum(motion.rotations[frame] * own.rotations[given], -1)), 1.0)
    np.testing.assert_array_equal(*(motion.times for motion in found.motions))
    kept = relate(*found.motions)
    assert found.deviation.hand is not None
    assert found.deviation.hand < 0.04
    assert np.linalg.norm(kept.hands[:, held], axis=-1).max() < 0.2
    assert found.distances == (pytest.approx(kept.distances.min()), pytest.approx(kept.distances.max()))
    assert found.deviation.place < 0.15
    assert found.usual is not None
    apart = ballet.tween(duet[1].posture(70), duet[1].posture(130), duration=float(found.motions[0].times[-1])).motion
    gaps = np.linalg.norm(relate(found.motions[0], apart).hands[:, held], axis=-1)
    assert gaps.max() > 1.5 * np.linalg.norm(kept.hands[:, held], axis=-1).max()


def test_a_couple_travels_as_its_leader_does(ballet: Engine) -> None:
    """The leader goes 1.5 m to its side, and the follower, 1 m before it, faces it all the way."""
    duet = face_to_face("temps-lie", 1.2)
    x, _, z = duet[0].root[20]
    found = tween_duet(ballet, couple(duet, 0), couple(duet, 20), to=(x + 1.5, z, 30.0))  # type: ignore[arg-type]
    kept, wanted = relate(*found.motions), relate(*duet)
    np.testing.assert_allclose(kept.places[-1], wanted.places[20], atol=1e-6)
    assert np.cos(kept.facings[-1] - wanted.facings[20]) == pytest.approx(1.0)
    assert found.usual is None
    assert found.path.attested == 0.0
    assert found.distances[0] > 1.0
    assert found.distances[1] < 1.45


def test_a_leader_who_stays_waits_for_a_follower_who_goes(ballet: Engine) -> None:
    a, b = (ballet.posture(name) for name in ("fifth", "tendu"))
    beside, away = (replace(a, root=a.root + np.array([far, 0.0, 0.0])) for far in (0.8, 1.3))
    found = tween_duet(ballet, (a, beside), (a, replace(b, root=away.root)))
    assert len(found.motions[0]) == len(found.motions[1]) > 20
    assert np.ptp(found.motions[0].root, axis=0).max() < 0.1


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"a": 1}, "a must be two, leader and follower, not 1"),
        ({"duets": [1]}, "duets: duet 1 must be two, leader and follower, not 1"),
        ({"duets": [2], "times": True}, "duets: the dancers of duet 1 have different times; resample them together"),
    ],
)
def test_what_is_no_duet_is_refused(ballet: Engine, changed: dict[str, object], told: str) -> None:
    duet = face_to_face("temps-lie", 1.2)
    a = couple(duet, 0)[: 1 if "a" in changed else 2]
    other = duet[1].slice(0, 30) if "times" in changed else duet[1]
    duets = [(duet[0], other)[: int(number)] for number in changed.get("duets", [])]  # type: ignore[attr-defined]
    with pytest.raises(MotionMindError) as error:
        tween_duet(ballet, a, couple(duet, 20), duets)  # type: ignore[arg-type]
    assert str(error.value) == told


def test_another_body_is_refused_by_its_role(ballet: Engine) -> None:
    duet, insect = face_to_face("temps-lie", 1.2), Engine.load("walk-hexapod").corpus
    posture = insect.motion(insect.clips[0]).posture(0)
    with pytest.raises(SkeletonError, match="the follower in A is on another skeleton than corpus 'ballet'"):
        tween_duet(ballet, (duet[0].posture(0), posture), (duet[0].posture(20), posture))
