"""The summary line of a tween, and its visible flaws."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionmind.learned.plausibility import MEASURES, UNITS_AND_MEANINGS, Sighting
from motionmind.names.postures import find_posture
from motionmind.tween.certificate import Bridge
from motionmind.tween.engine import Engine
from motionmind.tween.headline import beyond, feet_staying, headline, shown_beyond
from motionmind.tween.result import Tween


@given(st.sampled_from(sorted(MEASURES)), st.floats(0.0, 40.0), st.floats(0.0, 40.0))
def test_the_two_sides_of_a_warning_never_read_alike(name: str, value: float, most: float) -> None:
    sighting = Sighting(value, most, UNITS_AND_MEANINGS[name][0], "pelvis")
    numbers = re.findall(r"[\d.]+", shown_beyond(name, sighting).replace("m/s^2", ""))
    assert len(numbers) == 2
    if sighting.is_beyond:
        assert float(numbers[0]) > float(numbers[1])


@pytest.mark.parametrize(
    ("name", "value", "most", "is_beyond"),
    [
        ("crossed_limbs", 0.2719, 0.2718, False),
        ("balance", 0.069, 0.060, False),
        ("balance", 0.071, 0.060, True),
        ("bounce", 27.0, 18.6, False),
        ("bounce", 28.0, 18.6, True),
        ("pace", 1.04, 1.0, False),
        ("sliding", 0.44, 0.40, False),
        ("sliding", 0.50, 0.40, True),
    ],
)
def test_only_an_excess_that_a_viewer_notices_counts(name: str, value: float, most: float, is_beyond: bool) -> None:
    assert Sighting(value, most, UNITS_AND_MEANINGS[name][0]).is_beyond == is_beyond


@pytest.fixture(scope="module")
def tween() -> Tween:
    return Engine.load("ballet").tween(find_posture("ballet/arabesque").posture, find_posture("ballet/fifth").posture)


def test_it_says_length_proof_following_and_attestation(tween: Tween) -> None:
    assert headline(tween) == (
        f"{tween.moves} moves, {tween.motion.times[-1]:.1f} s. Path proven optimal, all from ballet. Motion reaches "
        f"{tween.followed[1:-1].mean():.0%} of the path's joint states; {tween.motion_attested:.0%} of the motion's "
        "transitions occur in ballet"
    )


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {"status": "bounded", "cost": 102.0, "lower_bound": 100.0},
            ". Path at most 2% above the optimum, all from ",
        ),
        (
            {"status": "bounded", "cost": 100.001, "lower_bound": 100.0},
            ". Path at most 1% above the optimum, all from ",
        ),
        ({"status": "bounded", "lower_bound": 0.0}, ". Path without a proven bound, all from "),
        (
            {"status": "interrupted", "cost": 150.0, "lower_bound": 100.0},
            ". Path at most 50% above the optimum (interrupted), all from ",
        ),
        ({"status": "sampled"}, ". Path sampled, all from "),
        ({"differs": (0.3,)}, ". Path proven optimal among paths that differ this much, all from "),
        ({"bridges": (Bridge("neck", 0, 5.0, 5.0),)}, ", all from ballet except 1 transition of neck. "),
        (
            {"bridges": tuple(Bridge(name, 0, 5.0, 5.0) for name in "abcd")},
            ", all from ballet except 4 transitions of a, b, c and 1 more. ",
        ),
        ({"sources": ()}, ", all from the corpus. "),
        ({"motion_attested": 0.5}, "; 50% of the motion's transitions occur in ballet"),
        ({"motion_attested": None}, "; nothing moves"),
        ({"path": np.zeros((1, 3), np.int32)}, "no move: A and B are the same posture"),
    ],
)
def test_it_says_what_is_so(tween: Tween, changes: dict[str, Any], said: str) -> None:
    assert said in headline(replace(tween, **changes))


def test_feet_that_do_not_stay_are_not_said_to(tween: Tween) -> None:
    far = np.linspace(0.0, 1.0, len(tween.motion))[:, None]
    carried = replace(tween, motion=replace(tween.motion, root=tween.motion.root + far * [1.0, 0.0, 0.0]))
    assert feet_staying(carried.motion) == []
    still = replace(tween.motion, rotations=np.tile(tween.motion.rotations[-1:], (len(tween.motion), 1, 1)))
    still = replace(still, root=np.tile(tween.motion.root[-1:], (len(tween.motion), 1)))
    assert feet_staying(still) == ["both feet stay in place"]


def test_an_insect_has_more_feet_than_two() -> None:
    engine = Engine.load("walk-hexapod")
    ends = (find_posture(f"walk-hexapod/{name}").posture for name in ("stand", "groom"))
    (said,) = feet_staying(engine.tween(*ends).motion)
    assert re.fullmatch(r"(all 6|[1-5] of 6) feet stay in place", said)


def test_a_viewer_winces_at_what_the_corpus_never_shows_and_at_far_bridges(
    tween: Tween, shown: Callable[[Tween, str, Sighting], Tween]
) -> None:
    assert beyond(tween) == []
    for name, sighting, said in (
        ("balance", Sighting(0.31, 0.1, "m"), "leans 31 cm beyond its support, at most 10 cm in the corpus"),
        (
            "sliding",
            Sighting(0.8, 0.4, ""),
            "feet slide: one moves near the floor for 80% of a second, at most",
        ),
        ("pace", Sighting(3.0, 1.5, "", "left_hip"), "left_hip is 3.00x as fast as fast movement of the corpus"),
    ):
        (sentence,) = beyond(shown(tween, name, sighting))
        assert sentence.startswith(said)
        assert beyond(shown(tween, name, replace(sighting, value=0.0))) == []
    near, far = Bridge("cervical", 0, 29.0, 29.0), Bridge("left_hip", 2, 108.2, 108.2)
    followed = replace(tween, bridges=(near, far), followed=np.ones_like(tween.followed))
    seconds = tween.motion.insertions[0].times[2]
    assert beyond(replace(followed, bridges=(near,))) == []
    assert beyond(followed) == [f"left_hip turns by 108 degrees at {seconds:.1f} s, as in no clip"]
    unseen = tween.followed.copy()
    unseen[3, tween.joints.index("left_hip")] = False
    assert beyond(replace(followed, followed=unseen)) == []


@pytest.fixture
def shown() -> Callable[[Tween, str, Sighting], Tween]:
    """A function that returns a tween which shows a viewer something else."""

    def change(tween: Tween, name: str, sighting: Sighting) -> Tween:
        changed = replace(tween)
        changed.__dict__["shown"] = {**tween.shown, name: sighting}  # a cached property
        return changed

    return change
