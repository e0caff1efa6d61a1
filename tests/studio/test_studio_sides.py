"""What is asked of the engine at a seam, against what a variation of the same movement asks."""

import numpy as np
import pytest

from motionmind.body.mirror import mirrored
from motionmind.body.motion import Motion
from motionmind.errors import MotionMindError
from motionmind.studio.asks import Ask, Passing, Pin, Reach, Travel
from motionmind.studio.neighbours import End
from motionmind.studio.sides import options_of, sides_of
from motionmind.tween.engine import Engine
from motionmind.variation.piece import Piece


@pytest.fixture(scope="module")
def engine() -> Engine:
    return Engine.load("ballet")


@pytest.fixture(scope="module")
def clip(engine) -> Motion:
    return engine.corpus.motion(engine.corpus.clips[0]).resample(20.0)


def same(one: Motion | None, other: Motion | None) -> bool:
    if one is None or other is None:
        return one is other
    times = one.times - one.times[0], other.times - other.times[0]
    return (
        len(one) == len(other)
        and np.allclose(*times)
        and np.allclose(one.rotations, other.rotations)
        and np.allclose(one.root, other.root)
    )


@pytest.mark.parametrize("facing", ["free", "stage"])
@pytest.mark.parametrize(("i", "k"), [(40, 90), (7, 3), (0, 2), (1, 0), (50, 50)])
def test_a_seam_is_asked_about_as_a_variation_asks(clip, i, k, facing):
    piece = Piece.of(clip, facing=facing)
    sides = sides_of((End("c/x", i, True), End("c/x", k, True)), {"c/x": clip}.__getitem__, facing)
    for mine, theirs in zip(sides[:2], piece.ends(i, k), strict=True):
        assert np.allclose(mine.rotations, theirs.rotations)
        assert np.allclose(mine.root, theirs.root)
    before, after = piece.around(i, k)
    assert same(sides.before, before)
    assert same(sides.after, after)
    assert (before is None, after is None) == (i == 0, False)
    assert sides.seconds == pytest.approx(piece.durations[i])


def test_a_held_posture_does_not_move(clip):
    sides = sides_of((End("c/x", 40, False), End("c/x", 90, False)), {"c/x": clip}.__getitem__, "free")
    assert sides.before is None
    assert sides.after is None


def test_the_last_frame_has_nothing_after_it(clip):
    last = len(clip) - 1
    assert sides_of((End("c/x", 4, True), End("c/x", last, True)), {"c/x": clip}.__getitem__, "free").after is None


def test_bodies_must_be_one(clip):
    hexapod = Engine.load("walk-hexapod").corpus
    movements = {"c/x": clip, "hexapod/x": hexapod.motion(hexapod.clips[0])}
    with pytest.raises(MotionMindError, match=r"hexapod/x and c/x have different bodies: .*"):
        sides_of((End("c/x", 4, True), End("hexapod/x", 1, True)), movements.__getitem__, "free")


def test_wishes_are_options_of_the_engine(engine, clip):
    ask = Ask(2.5, (Passing("c/x", 30), Passing("~c/x", 2)), (Pin("left_ankle", "throughout"), Pin("right_wrist")))
    movements = {"c/x": clip, "~c/x": mirrored(clip)}
    options = options_of(ask, clip.skeleton, movements.__getitem__)
    assert options["duration"] == 2.5
    assert [
        np.allclose(via.rotations, movements[key].rotations[frame])
        for via, key, frame in zip(options["via"], ("c/x", "~c/x"), (30, 2), strict=True)
    ] == [True, True]
    assert options["hold"] == ["left_hip", "left_knee", "left_ankle"]
    assert options["pin"] == dict.fromkeys(["right_clavicle", "right_shoulder", "right_elbow", "right_wrist"], "A")
    assert options_of(Ask(), clip.skeleton, movements.__getitem__) == {}
    reach = Reach("left_wrist", (0.3, 1.4, 0.5), 1.2)
    assert options_of(Ask(reaches=(reach,)), clip.skeleton, {}.__getitem__) == {
        "reach": [("left_wrist", (0.3, 1.4, 0.5), 1.2)]
    }
    for facing, to in ((None, (1.0, 2.0)), (90.0, (1.0, 2.0, 90.0))):
        place, path = Travel(((1.0, 2.0),), facing), Travel(((0.5, 0.5), (1.0, 2.0)), facing)
        assert options_of(Ask(travel=place), clip.skeleton, {}.__getitem__) == {"to": to}
        assert options_of(Ask(travel=path), clip.skeleton, {}.__getitem__) == {"to": to, "along": path.points}
    stay = Pin("left_ankle", "place", 0.25, 0.5)
    assert options_of(Ask(pins=(stay,)), clip.skeleton, {}.__getitem__) == {"stay": [("left_ankle", 0.25, 0.5)]}
    for wrong in (
        Ask(pins=(Pin("tail"),)),
        Ask(pins=(Pin("tail", "place"),)),
        Ask(reaches=(Reach("tail", (0.0, 1.0, 0.0), 1.0),)),
    ):
        with pytest.raises(MotionMindError, match="no joint 'tail'"):
            options_of(wrong, clip.skeleton, movements.__getitem__)


def test_a_limb_that_is_pinned_stays_on_the_way(engine, clip):
    sides = sides_of((End("c/x", 10, False), End("c/x", 70, False)), {"c/x": clip}.__getitem__, "free")
    options = options_of(Ask(pins=(Pin("left_wrist"),)), clip.skeleton, {}.__getitem__)
    tween = engine.tween(sides.a, sides.b, **options)
    chain = engine.corpus.chains.index("left_wrist")
    assert tween.moves > 1
    assert (tween.path[1:-1, chain] == tween.path[0, chain]).all()
