"""The summary line of a tween, and its visible flaws."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from motionmind.learned.plausibility import Sighting
from motionmind.names.postures import find_posture
from motionmind.tween.certificate import Bridge
from motionmind.tween.engine import Engine
from motionmind.tween.headline import beyond, feet_staying, headline, shown_beyond
from motionmind.tween.result import Tween


@pytest.mark.parametrize(
    ("value", "said"),
    [
        (0.35, "leans 0.35 m beyond its support, at most 0.22 m in the corpus"),
        (0.2249, "leans 0.225 m beyond its support, at most 0.216 m in the corpus"),
        (0.2162, "leans 0.2162 m beyond its support, at most 0.2160 m in the corpus"),
        (0.216 + 1e-9, "leans 0.21600 m beyond its support, at most 0.21600 m in the corpus"),
    ],
)
def test_what_exceeds_the_corpus_by_little_gets_the_digits_that_show_it(value: float, said: str) -> None:
    assert shown_beyond("balance", Sighting(value, 0.216, "m")) == said


@pytest.fixture(scope="module")
def tween() -> Tween:
    return Engine.load("ballet").tween(find_posture("ballet/arabesque").posture, find_posture("ballet/fifth").posture)


def test_it_says_length_proof_following_and_attestation(tween: Tween) -> None:
    assert headline(tween) == (
        f"{tween.moves} moves, {tween.motion.times[-1]:.1f} s. Path proven optimal, all from ballet. Motion follows "
        f"{tween.followed[1:-1].mean():.0%} of it; {tween.motion_attested:.0%} of its own transitions occur in ballet"
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
        ({"motion_attested": 0.5}, "; 50% of its own transitions occur in ballet"),
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
        ("balance", Sighting(0.31, 0.1, "m"), "leans 0.31 m beyond its support, at most 0.10 m in the corpus"),
        (
            "sliding",
            Sighting(0.8, 0.4, ""),
            "feet slide: near the floor one moves in 80% of a second, at most",
        ),
        ("pace", Sighting(3.0, 1.5, "", "left_hip"), "left_hip is 3.0x as fast as fast movement of the corpus"),
    ):
        (sentence,) = beyond(shown(tween, name, sighting))
        assert sentence.startswith(said)
        assert beyond(shown(tween, name, replace(sighting, value=0.0))) == []
    near, far = Bridge("neck", 0, 29.0, 29.0), Bridge("left_hip", 2, 108.2, 108.2)
    assert beyond(replace(tween, bridges=(near,))) == []
    assert beyond(replace(tween, bridges=(near, far))) == ["left_hip turns by 108 degrees in move 3, as in no clip"]


@pytest.fixture
def shown() -> Callable[[Tween, str, Sighting], Tween]:
    """A function that returns a tween which shows a viewer something else."""

    def change(tween: Tween, name: str, sighting: Sighting) -> Tween:
        changed = replace(tween)
        changed.__dict__["shown"] = {**tween.shown, name: sighting}  # a cached property
        return changed

    return change
