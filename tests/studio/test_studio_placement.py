"""Where a piece's parts stand in time and on the floor, against the variation's own arrangement of a piece."""

from dataclasses import replace
from itertools import pairwise

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionmind.body.mirror import mirrored
from motionmind.body.motion import Insertion, Motion
from motionmind.body.skeleton import Skeleton
from motionmind.errors import MotionMindError
from motionmind.geometry import rotations as rot
from motionmind.studio import edits as e
from motionmind.studio.findings import Finding, Found
from motionmind.studio.piece import State, apply_all
from motionmind.studio.placement import Marks, lay_out, performance
from motionmind.studio.view import state_of, view_of
from motionmind.variation.piece import Piece

BODY = Skeleton(
    "stick", ("root", "left_arm", "right_arm"), (-1, 0, 0), np.array([[0, 1, 0], [0.3, 0, 0], [-0.3, 0, 0.0]])
)


def wander(seed: int, frames: int) -> Motion:
    """A body that walks and turns at random."""
    rng = np.random.default_rng(seed)
    turns = rot.exp(rng.normal(0.0, 0.4, (frames, 3, 3)))
    turns[:, 0] = rot.mul(rot.about_vertical(np.cumsum(rng.normal(0.0, 0.3, frames))), turns[:, 0])
    root = np.cumsum(rng.normal(0.0, 0.2, (frames, 3)), axis=0) + np.array([3.0, 1.0, -2.0])
    return Motion(BODY, turns, root, np.arange(frames) / 10.0, name=f"wander {seed}")


MOVEMENTS = {"c/one": wander(1, 30), "c/two": wander(2, 20), "c/posture": wander(3, 1), "m-found": wander(4, 6)}
MOVEMENTS["~c/one"] = mirrored(MOVEMENTS["c/one"])


def movement(key: str) -> Motion:
    if key not in MOVEMENTS:
        raise MotionMindError(f"no movement {key}")
    return MOVEMENTS[key]


def piece_of(*blocks: tuple[str, int, int]) -> State:
    return apply_all([e.Insert(f"b{n}", *block) for n, block in enumerate(blocks)])


stretches = st.lists(
    st.tuples(st.sampled_from(["c/one", "c/two", "~c/one"]), st.integers(0, 19), st.integers(0, 19)).map(
        lambda drawn: (drawn[0], min(drawn[1:]), max(drawn[1:]))
    ),
    min_size=1,
    max_size=6,
)


@given(stretches, st.sets(st.integers(0, 4)))
@settings(max_examples=60, deadline=None)
def test_each_part_is_set_down_where_the_one_before_ends(blocks, inserted):
    state = piece_of(*blocks)
    marks = Marks(movement)
    places = {seam.pair: n for n, seam in enumerate(state.seams)}
    layout = lay_out(state, lambda seam: "m-found" if places[seam.pair] in inserted else None, marks)
    parts = list(layout.parts)
    assert parts[0].at == 0.0
    assert layout.seconds == pytest.approx(parts[-1].at + parts[-1].seconds)
    for before, after in pairwise(parts):
        goes_on = before.key == after.key and after.first == before.last + 1
        gap = after.at - before.at - before.seconds
        repeats = before.key == after.key and before.last == after.first
        step = marks.step(before.key, before.last)
        assert gap == pytest.approx(0.0 if before.inserted or after.inserted or repeats else step)
        if goes_on:
            assert (after.place, after.turn) == (before.place, before.turn)
            continue
        end, begin = (
            performance([msgspec.structs.replace(part, inserted=False)], movement) for part in (before, after)
        )
        assert end.root[-1, [0, 2]] == pytest.approx(begin.root[0, [0, 2]])
        turned = rot.heading(end.rotations[-1, 0]) - rot.heading(begin.rotations[0, 0])
        assert np.cos(turned) == pytest.approx(1.0)


@given(stretches, st.sets(st.integers(0, 4)), st.sets(st.integers(0, 4)))
@settings(max_examples=60, deadline=None)
def test_a_requested_facing_turns_all_that_follows_where_dancers_face_the_audience(blocks, inserted, facing):
    state = piece_of(*blocks)
    asked = {seam.pair: n in facing for n, seam in enumerate(state.seams)}
    places = {seam.pair: n for n, seam in enumerate(state.seams)}
    for (left, right), faces in asked.items():
        travel = e.Travel(((1.0, 2.0), (0.5, 2.5)), 40.0 if faces else None)
        state = apply_all([e.Wish(left, right, travel=travel)], state)
    marks = Marks(movement, lambda _: "stage")
    layout = lay_out(state, lambda seam: "m-found" if places[seam.pair] in inserted else None, marks)
    own = iter(state.seams)
    seam = None
    for before, after in pairwise(layout.parts):
        seam = next(own) if not before.inserted else seam
        end, begin = (
            performance([msgspec.structs.replace(part, inserted=False)], movement) for part in (before, after)
        )
        if before.inserted and asked[seam.pair]:
            turned = rot.heading(end.rotations[-1, 0]) - rot.heading(begin.rotations[0, 0])
            assert np.cos(turned) == pytest.approx(1.0)
        else:
            assert after.turn == before.turn
        if not seam.goes_on:
            assert end.root[-1, [0, 2]] == pytest.approx(begin.root[0, [0, 2]])


@given(stretches, st.sampled_from(["free", "stage"]))
@settings(max_examples=40, deadline=None)
def test_the_performance_is_the_variation_s_arrangement(blocks, facing):
    """The same stretches of one movement, arranged as a variation is."""
    blocks = [("c/one", first, last) for _, first, last in blocks]
    state = piece_of(*blocks)
    motion = performance(list(lay_out(state, lambda _: None, Marks(movement, lambda _: facing)).parts), movement)
    order, last = [], -1
    for _, first, stop in blocks:
        order += list(range(first + (first == last), stop + 1))  # a variation holds a posture that comes twice
        last = stop
    arranged = Piece.of(MOVEMENTS["c/one"], facing=facing).arrange(np.array(order), {}).motion
    assert np.abs(motion.times - motion.times[0] - (arranged.times - arranged.times[0])).max() < 1e-9
    assert rot.angle(motion.rotations, arranged.rotations).max() < 1e-6
    assert motion.root == pytest.approx(arranged.root, abs=1e-9)


def test_insertions_begin_and_end_with_the_postures_beside_them():
    one, two = MOVEMENTS["c/one"].posture(9), MOVEMENTS["c/two"].posture(4)

    def level(posture):
        turned = posture.rotations.copy()
        turned[0] = rot.mul(rot.about_vertical(-rot.heading(turned[0])), turned[0])
        return turned

    frames = np.stack([level(one), level(two), level(two)])
    root = np.array([[0, one.root[1], 0], [0.2, 1.1, 0.3], [0.5, two.root[1], 0.7]])
    MOVEMENTS["m-led"] = Motion(
        BODY, frames, root, np.array([0.0, 0.4, 0.8]), insertions=(Insertion(np.array([0.0, 0.8])),)
    )
    state = piece_of(("c/one", 2, 9), ("c/two", 4, 12))
    layout = lay_out(state, lambda _: "m-led", Marks(movement))
    motion = performance(list(layout.parts), movement)
    assert len(motion) == 8 + 1 + 9
    assert motion.insertions[0].times == pytest.approx([0.7, 1.5])
    assert motion.times[[7, 8, 9]] == pytest.approx([0.7, 1.1, 1.5])
    assert motion.inserted().tolist() == [False] * 8 + [True] + [False] * 9
    # What follows is as far from where the insertion began, and turned, as the insertion says.
    heading = rot.heading(motion.rotations[7, 0])
    way = rot.mul_vec(rot.about_vertical(heading), np.array([0.5, 0.0, 0.7]))
    assert (motion.root[9] - motion.root[7])[[0, 2]] == pytest.approx(way[[0, 2]])


def test_states_of_a_seam():
    seam = piece_of(("c/one", 0, 5), ("c/two", 0, 5)).seams[0]
    found = (Found("m-found", 0.5, "usual"),)
    assert state_of(seam, None) == "waiting"
    assert state_of(seam, Finding("q", False, "", ())) == "smooth"
    assert state_of(seam, Finding("q", True, "", None)) == "abrupt"
    assert state_of(seam, Finding("q", False, "", None)) == "waiting"
    assert state_of(seam, Finding("q", True, "", ())) == "none found"
    assert state_of(seam, Finding("q", True, "", found)) == "inserted"
    wished = seam._replace(verdict=type(seam.verdict)(e.Ask(2.0)))
    assert state_of(wished, Finding("q", False, "no movement found", ())) == "none found"
    discarded = seam._replace(verdict=type(seam.verdict)(decision="discarded"))
    assert state_of(discarded, Finding("q", True, "", found)) == "discarded"
    assert state_of(piece_of(("c/one", 0, 5), ("c/one", 6, 9)).seams[0], None) == "smooth"


def test_the_view_names_what_stands_where():
    state = piece_of(("c/one", 0, 5), ("c/two", 3, 5), ("c/posture", 0, 0))
    finding = Finding("q", True, "it leaps", (Found("m-found", 0.5, "usual"),))
    view = view_of(state, lambda seam: finding if seam.left.id == "b0" else None, Marks(movement), str.upper)
    assert [part["key"] for part in view["parts"]] == ["c/one", "m-found", "c/two", "c/posture"]
    assert [seam["state"] for seam in view["seams"]] == ["inserted", "waiting"]
    assert [(block["id"], block["title"], block["frames"]) for block in view["blocks"]] == [
        ("b0", "C/ONE", 30),
        ("b1", "C/TWO", 20),
        ("b2", "C/POSTURE", 1),
    ]
    at = [view["seams"][0]["at"], view["blocks"][1]["at"], view["seams"][1]["at"], view["seconds"]]
    assert at == pytest.approx([0.5, 1.0, 1.2, 1.3])
    empty = view_of(State(), lambda _: None, Marks(movement), str.upper)
    assert empty == {"seconds": 0.0, "parts": [], "blocks": [], "seams": [], "notes": []}


def test_parts_that_cannot_be_one_movement_are_refused():
    with pytest.raises(MotionMindError, match="the piece is empty"):
        performance([], movement)
    other = replace(MOVEMENTS["c/two"], skeleton=replace(BODY, names=("root", "left_arm", "tail")))
    parts = list(lay_out(piece_of(("c/one", 0, 5), ("c/two", 3, 5)), lambda _: None, Marks(movement)).parts)
    with pytest.raises(MotionMindError, match="c/two and c/one have different bodies"):
        performance(parts, {**MOVEMENTS, "c/two": other}.__getitem__)
    longer = lay_out(piece_of(("c/two", 3, 25)), lambda _: None, Marks(movement))
    with pytest.raises(MotionMindError, match="c/two has no frame 25: its frames are 0 to 19"):
        performance(list(longer.parts), movement)


def test_what_is_missing_keeps_its_place_and_is_said_to_be_missing() -> None:
    piece = piece_of(("c/one", 0, 5), ("gone/clip", 10, 40), ("c/two", 3, 5))
    view = view_of(piece, lambda _: None, Marks(movement), str.upper)
    assert [block["missing"] for block in view["blocks"]] == [False, True, False]
    assert view["blocks"][1]["seconds"] == pytest.approx(1.0)
    assert view["blocks"][2]["at"] > view["blocks"][1]["at"] + 1.0
    assert {part["key"] for part in view["parts"]} == {"c/one", "c/two"}


def test_what_was_inserted_stands_until_a_wish_is_answered() -> None:
    piece = piece_of(("c/one", 0, 5), ("c/two", 3, 5))
    found = Found("m-found", 0.5, "usual")
    view = view_of(piece, lambda _: None, Marks(movement), str.upper, lambda _: found)
    assert [part["key"] for part in view["parts"]] == ["c/one", "m-found", "c/two"]
    assert (view["seams"][0]["state"], view["seams"][0]["seconds"]) == ("waiting", pytest.approx(0.5))
    abrupt = Finding("q", True, "not seen", None)  # is looked at, but what joins it is still sought
    view = view_of(piece, lambda _: abrupt, Marks(movement), str.upper, lambda _: found)
    assert [part["key"] for part in view["parts"]] == ["c/one", "m-found", "c/two"]
    none = Finding("q", True, "no movement found", ())
    view = view_of(piece, lambda _: none, Marks(movement), str.upper, lambda _: found)
    assert [part["key"] for part in view["parts"]] == ["c/one", "c/two"]
