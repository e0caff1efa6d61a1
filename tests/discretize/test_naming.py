"""States that are named after a score's words: near all of its postures, apart from each other, and told apart."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from motionmind._typing import Floats
from motionmind.body.motion import Motion
from motionmind.discretize.library import Library
from motionmind.discretize.naming import name_states
from motionmind.errors import MotionMindError
from motionmind.geometry import rotations as rot
from motionmind.notation.compose import motions
from motionmind.notation.read import read_score
from motionmind.notation.score import Score

CORPORA = Path(__file__).parents[2] / "corpora"
ROUNDED = 1.5  # degrees: three turns, each rounded to whole degrees

TURNS = """title  Turns
body   human23
legs
  stand = stand out 10 turn 8
  bend = stand out 10 turn 8, bend 30
clip still: Three postures
  start | stand
  1     | bend
  1     | stand
clip turned: And to the side
  start face 90 | stand
  1     | bend
  1     | stand
  1     | bend
  1     | stand
"""


ARMS = """title  Arms
body   human23
arms
  low = elbow flexion 12
  flexed = elbow flexion 90
clip uneven: The left arm hangs
  start | | low / flexed
  1     | | low
"""


def scores(name: str) -> list[Score]:
    return [read_score(file) for file in sorted((CORPORA / name).glob("*.score")) if "clip" in file.read_text()]


def seen(motion: Motion, joint: str, stage: bool) -> Floats:
    """Orientations of a joint in each posture [T, 4]; of a pair's, those of the left, and of the right in a mirror."""
    names, rotations = motion.skeleton.names, motion.rotations.copy()
    if not stage:
        rotations[:, 0] = rot.mul(rot.about_vertical(-rot.heading(rotations[:, 0])), rotations[:, 0])
    if joint in names:
        return rotations[:, names.index(joint)]
    left, right = (rotations[:, names.index(f"{side}_{joint}")] for side in ("left", "right"))
    return np.concatenate([left, rot.mirror(right)])


@pytest.fixture(scope="module", params=[("macarena", False), ("karate", False), ("macarena", True)], ids=str)
def named(request: pytest.FixtureRequest) -> tuple[list[Score], Library, bool, dict[str, Floats]]:
    """Scores, the library of 20 degrees, 8 at the knees, whether facings count, and orientations by joint [N, 4]."""
    name, stage = request.param
    found = scores(name)
    library = name_states(found, 20.0, {"knee": 8.0}, stage=stage)
    played = [motion for score in found for motion in motions(score, score.clips)]
    return found, library, stage, {j: np.concatenate([seen(m, j, stage) for m in played]) for j in library.tables}


def test_every_posture_is_near_a_named_state_and_states_are_apart(
    named: tuple[list[Score], Library, bool, dict[str, Floats]],
) -> None:
    _, library, _, orientations = named
    for joint, turned in orientations.items():
        states = library.rotations(joint)
        within = 8.0 if joint == "knee" else 20.0
        off = np.degrees(rot.angle(turned[:, None], states))
        assert off.min(axis=1).max() < within + ROUNDED, joint
        apart = np.degrees(rot.angle(states[:, None], states))[~np.eye(len(states), dtype=bool)]
        assert apart.min(initial=180.0) > within - 2.0 * ROUNDED, joint
        assert np.all(off.min(axis=0) < ROUNDED), joint  # each is one that occurs


def test_the_most_frequent_orientation_comes_first(
    named: tuple[list[Score], Library, bool, dict[str, Floats]],
) -> None:
    _, library, _, orientations = named
    first = 0
    for joint, turned in orientations.items():
        alike = np.array([np.sum(rot.angle(turned, one) < 1e-4) for one in turned[:: max(1, len(turned) // 200)]])
        state = library.rotations(joint)[0]
        first += np.sum(np.degrees(rot.angle(turned, state)) < ROUNDED) >= alike.max()
    assert first >= len(orientations) - 1  # one orientation may go by several words


def test_states_have_the_scores_own_words_and_numbers_where_these_are_the_same(
    named: tuple[list[Score], Library, bool, dict[str, Floats]],
) -> None:
    found, library, _, _ = named
    text = " ".join(file.read_text() for file in Path(found[0].path).parent.glob("*.score"))
    for table in library.tables.values():
        for name in table:
            assert name.split()[0].strip(",") in text, name
        for name in table:
            stem, _, number = name.removesuffix(")").rpartition(" (")
            if number.isdecimal() and int(number) > 2:
                assert f"{stem} ({int(number) - 1})" in table


def test_facings_name_states_of_the_pelvis_on_stage_alone(tmp_path: Path) -> None:
    (tmp_path / "turns.score").write_text(TURNS)
    score = read_score(tmp_path / "turns.score")
    free, stage = (name_states([score], 12.0, stage=on) for on in (False, True))
    assert not any("facing" in name for table in free.tables.values() for name in table)
    assert [name for name in stage.tables["pelvis"] if name.endswith(", facing 90")]
    assert len(stage.tables["pelvis"]) == 2 * len(free.tables["pelvis"])
    assert stage.tables["knee"] == free.tables["knee"]
    assert list(free.tables["knee"]) == ["stand", "bend"]


def test_each_side_is_named_by_its_own_words(tmp_path: Path) -> None:
    (tmp_path / "arms.score").write_text(ARMS)
    library = name_states([read_score(tmp_path / "arms.score")], 12.0)
    assert list(library.tables["elbow"]) == ["low", "flexed"]
    assert np.degrees(rot.angle(library.rotations("elbow"), rot.IDENTITY)) == pytest.approx([12.0, 90.0])


def test_turns_are_written_the_shorter_way_about() -> None:
    library = name_states(scores("macarena"), 5.0)
    degrees = [
        abs(float(turn.split()[1])) for table in library.tables.values() for turns in table.values() if turns
        for turn in str(turns).split(", ")
    ]  # fmt: skip
    assert np.mean(np.array(degrees) > 100.0) < 0.05


def test_nothing_to_name_and_two_bodies_are_refused() -> None:
    with pytest.raises(MotionMindError, match="no score: no clip to name states after"):
        name_states([], 10.0)
    with pytest.raises(MotionMindError, match="a library is for one body"):
        name_states([*scores("macarena"), *scores("walk-hexapod")], 10.0)
    with pytest.raises(MotionMindError, match="tolerance in degrees"):
        name_states(scores("macarena"), 0.0)
