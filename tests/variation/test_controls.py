"""Controls: their orders, what quadrants compose, and that they are judged, reviewed and filed as other variations."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bundled_clips import ballet_clip
from hypothesis import given, settings
from hypothesis import strategies as st

from motionmind.body.contact import contact_points
from motionmind.body.limbs import TRUNK, sided_parts
from motionmind.body.motion import Insertion, Motion
from motionmind.chaos.flows import FLOWS, find_flow
from motionmind.chaos.reorder import itinerary, runs
from motionmind.credits.credit import Credit
from motionmind.errors import FormatError, MotionMindError, WrongTypeError
from motionmind.formats import read_motion
from motionmind.names.finding import open_collection
from motionmind.names.spelling import Source
from motionmind.plots.portrait import portrait_of
from motionmind.tween.engine import Engine
from motionmind.variation.orders import ORDERS, REFUSED
from motionmind.variation.piece import Piece
from motionmind.variation.posture_names import name_postures
from motionmind.variation.variation import Variation, vary
from motionmind.variation.variation_json import read_variation, write_variation

pytestmark = pytest.mark.long

CONTROLS = ORDERS[1:]
RANDOM = tuple(name for name in CONTROLS if name != "dabby")
SEEDS = st.integers(0, 10_000)
COUNT = 16  # postures of the piece that is smoothed


@pytest.fixture(scope="module")
def karate() -> Engine:
    return Engine.load("karate")


@pytest.fixture(scope="module")
def kata(karate: Engine) -> Piece:
    """A piece that travels and turns."""
    clip = next(one for one in karate.corpus.clips if one.name == "heian-shodan")
    return Piece.of(karate.corpus.motion(clip).slice(0, COUNT))


@pytest.fixture(scope="module")
def smoothed(kata: Piece, karate: Engine) -> dict[str, Variation]:
    leaving = {by: {} if "depart" in REFUSED[by] else {"depart": 0.7} for by in CONTROLS}  # more than one seam
    return {by: vary(kata, karate, by=by, seed=3, alternatives=1, **leaving[by]) for by in CONTROLS}


def adagio() -> Motion:
    return ballet_clip("adagio")


# --- orders ---------------------------------------------------------------------------------------------------------


@given(st.integers(1, 60), SEEDS)
def test_a_shuffle_is_a_permutation(count: int, seed: int) -> None:
    found = vary(adagio().slice(0, count), by="shuffle", seed=seed)
    assert sorted(found.order) == list(range(count))
    assert found.course is None


@settings(max_examples=20)
@given(
    seed=SEEDS,
    flow=st.sampled_from(["lorenz", "rossler", "chua"]),
    skip=st.sampled_from([3, 10, 20]),
    options=st.sampled_from(
        [
            {},
            {"nudge": 1.0},
            {"nudge": (0.3, -0.2, 0.1)},
            {"depart": 0.5},
            {"start": (1.0, 2.0, 3.0)},
            {"step": 0.005, "transient": 5000},
        ]
    ),
)
def test_chunks_are_those_of_the_attractors_order_with_the_same_options(
    seed: int, flow: str, skip: int, options: dict[str, Any]
) -> None:
    options = {**options, "flow": find_flow(flow), "skip": skip}
    own, found = vary(adagio(), **options), vary(adagio(), by="chunks", seed=seed, **options)
    assert sorted(found.order) == list(range(len(adagio())))
    assert sorted(runs(found.order)) == sorted(runs(own.order))
    assert found.course == own.course


def test_chunks_keep_the_stretches_of_limits() -> None:
    own = vary(adagio(), flow=FLOWS["rossler"], stretch=5, depart=0.15)
    found = vary(adagio(), flow=FLOWS["rossler"], stretch=5, depart=0.15, by="chunks", seed=1)
    assert sorted(runs(found.postures)) == sorted(runs(own.postures))
    assert sorted(found.postures) == list(range(len(adagio())))
    assert len(runs(own.postures)) > 3
    assert min(runs(found.postures)) >= 5 > min(runs(found.order))
    assert found.report()["limits"] == {"inserted": None, "stretch": 5}


@pytest.mark.parametrize("flow", ["lorenz", "rossler"])
@pytest.mark.parametrize("length", [None, 30, 90])
def test_dabbys_mapping_reads_the_attractors_own_trajectories(flow: str, length: int | None) -> None:
    own = vary(adagio(), flow=FLOWS[flow], length=length)
    found = vary(adagio(), flow=FLOWS[flow], length=length, by="dabby")
    assert found.course == own.course
    passed = itinerary(FLOWS[flow], len(adagio()), length, nudge=own.course.nudge)
    assert len(found.order) == len(passed.points)
    x = passed.sites[:, 0]
    for place, posture in zip(passed.points[:, 0], found.order, strict=True):
        assert x[posture] == min(x[x >= place], default=x.max())
    assert not np.array_equal(found.order, own.order)


def rows(motion: Motion, frames: np.ndarray, joints: np.ndarray) -> list[tuple[float, ...]]:
    """The rotations of some joints at some frames, sorted."""
    found = motion.rotations[np.ix_(frames, joints)].reshape(len(frames), -1)
    return sorted(map(tuple, found.tolist()))


def lowest(piece: Piece) -> np.ndarray:
    """The height of the lowest point of each posture [N]."""
    motion = piece.motion
    places, _ = contact_points(motion.skeleton, motion.rotations[piece.frames], motion.root[piece.frames])
    return np.asarray(places[..., 1].min(axis=-1))


@settings(max_examples=20)
@given(clip=st.sampled_from(["adagio", "jetes", "jump"]), seed=SEEDS, facing=st.sampled_from(["free", "stage"]))
def test_quadrants_keep_every_parts_postures_whole(clip: str, seed: int, facing: str) -> None:
    piece = Piece.of(ballet_clip(clip).resample(20.0), 5.0, facing)  # type: ignore[arg-type]
    found = vary(piece, by="quadrants", seed=seed)
    composed = found.piece
    assert np.array_equal(found.order, np.arange(len(piece)))
    assert composed.facing == facing
    np.testing.assert_allclose(composed.durations, piece.durations)
    for joints in sided_parts(piece.motion.skeleton).values():
        assert rows(composed.motion, composed.frames, joints) == rows(piece.motion, piece.frames, joints)
    # The root is where it was in one of the postures that the trunk may be from, and the body as high.
    trunk, low = sided_parts(piece.motion.skeleton)[TRUNK], lowest(piece)
    own, moved = piece.motion.rotations[piece.frames][:, trunk], composed.motion.rotations[:, trunk]
    for n, height in enumerate(lowest(composed)):
        sources = np.flatnonzero((own == moved[n]).all(axis=(1, 2)))
        places = piece.motion.root[piece.frames[sources]]
        beside = (places[:, [0, 2]] == composed.motion.root[n, [0, 2]]).all(axis=1)
        assert (beside & np.isclose(low[sources], height, atol=1e-9)).any()


@pytest.mark.parametrize("by", RANDOM)
def test_a_seed_decides_all_and_another_gives_another_order(by: str, tmp_path: Path) -> None:
    seeds = {"a": 7, "b": 7, "c": 8}
    for name, seed in seeds.items():
        write_variation(tmp_path / name, vary(adagio(), by=by, seed=seed))  # type: ignore[arg-type]
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
    first, other = (read_variation(tmp_path / name).motion() for name in ("a", "c"))
    assert not np.array_equal(first.rotations[:9], other.rotations[:9])


def test_without_a_seed_it_is_0(kata: Piece) -> None:
    assert np.array_equal(vary(kata, by="shuffle").order, vary(kata, by="shuffle", seed=0).order)
    assert vary(kata, by="dabby", seed=5).control.seed is None


# --- quadrants ------------------------------------------------------------------------------------------------------


def test_no_step_between_composed_postures_is_the_pieces_own(smoothed: dict[str, Variation], karate: Engine) -> None:
    found = smoothed["quadrants"]
    steps = [(n, n + 1) for n in range(COUNT - 1)]
    assert [(seam.start, seam.end) for seam in found.seams] == steps
    assert [(one.start, one.end) for one in found.transitions] == steps
    counts = found.report()["counts"]
    assert (counts["departed"], counts["mean_chunk"], counts["longest_chunk"], counts["unjudged"]) == (1.0, 1.0, 1, 0)
    cut = found.cut(3, 8, before=15)
    assert len(cut.seams) == COUNT - 1
    assert [seam.start for seam in cut.seams if seam.transition is None] == [2, 14, 8]
    assert {seam.transition.corpus for seam in cut.smooth(karate, alternatives=1).seams} == {"karate"}


def test_what_leads_to_composed_postures_is_given_no_velocity(smoothed: dict[str, Variation]) -> None:
    piece = smoothed["quadrants"].piece
    assert {piece.around(n, n + 1) for n in range(COUNT - 1)} == {(None, None)}


def test_composed_postures_stand_where_the_last_one_stood(kata: Piece) -> None:
    motion = vary(kata, by="quadrants").motion()
    np.testing.assert_allclose(np.ptp(motion.root[:, [0, 2]], axis=0), 0.0, atol=1e-12)


def test_composed_postures_are_credited_as_the_piece_is(kata: Piece) -> None:
    whole = kata.motion
    assert vary(whole, by="quadrants").motion().credits == whole.credits
    named = replace(whole, recorded=())
    assert vary(named, by="quadrants").motion().credits == (Credit(1.0, "heian-shodan"),)
    mark = Insertion(whole.times[4:11], credits=(Credit(1.0, "plies", corpus="ballet"),))
    marked = replace(named, insertions=(mark,))
    made = vary(marked, by="quadrants").motion()
    assert made.insertions == ()
    assert made.credits == marked.credits
    assert {credit.corpus for credit in made.credits} == {"", "ballet"}


def test_composed_postures_are_named_as_no_frame_of_the_clip(kata: Piece) -> None:
    collection = open_collection(Source("karate", "corpus", "karate"), None)
    found = vary(kata, by="quadrants", seed=1)
    names = name_postures(found.piece, collection)
    assert "composed@5" in names
    assert not any(name.startswith("heian-shodan@") for name in names)
    assert any(name.startswith("heian-shodan@") for name in name_postures(kata, collection))


# --- judged, reviewed and filed -------------------------------------------------------------------------------------


@pytest.mark.parametrize("by", CONTROLS)
def test_a_control_is_judged_and_smoothed_as_a_variation_is(by: str, smoothed: dict[str, Variation]) -> None:
    found = smoothed[by]
    assert found.seams
    assert all(seam.transition is not None for seam in found.seams)
    assert all(seam.insertion for seam in found.seams if seam.transition.is_abrupt)
    assert {one.options["seed"] for one in found.transitions if one.candidates} == {3}  # of samples, too
    motion, frames = found.arrange()
    own = found.piece.motion.rotations[found.piece.frames[found.postures]]
    assert np.array_equal(motion.rotations[frames, 1:], own[:, 1:])


@pytest.mark.parametrize("by", ORDERS)
def test_the_report_says_which_order_it_is(by: str, kata: Piece) -> None:
    report = vary(kata, by=by, seed=4).report()  # type: ignore[arg-type]
    seed = 4 if by in RANDOM else None
    assert report["control"] == (None if by == "attractor" else {"by": by, "seed": seed})
    assert (report["course"] is None) == (by in ("shuffle", "quadrants"))
    order = np.array(report["order"])
    own = np.zeros(len(order) - 1) if by == "quadrants" else np.diff(order) == 1
    lengths = np.diff([0, *(np.flatnonzero(own == 0) + 1), len(order)])
    counts = report["counts"]
    assert counts["mean_chunk"] == pytest.approx(lengths.mean())
    assert counts["longest_chunk"] == lengths.max()
    assert counts["departed"] == pytest.approx(np.mean((own == 0) & (np.diff(order) != 0)))


@pytest.mark.parametrize("by", CONTROLS)
def test_edits_are_made_and_undone(by: str, smoothed: dict[str, Variation], karate: Engine, tmp_path: Path) -> None:
    found = smoothed[by]
    first, second, third, *_ = (seam.number for seam in found.seams if seam.insertion)
    edited = found.approve(first).discard(second).replace(third, 1).cut(2, 4, before=9).smooth(karate, alternatives=1)
    assert [type(edit).__name__ for edit in edited.edits][:2] == ["Approve", "Discard"]
    write_variation(tmp_path / "edited.json", edited)
    again = read_variation(tmp_path / "edited.json")
    assert again.report() == edited.report()
    while again.edits:
        again = again.undo()
    assert again.report() == found.report()


@pytest.mark.parametrize("by", CONTROLS)
def test_a_control_is_read_as_it_was_written(by: str, smoothed: dict[str, Variation], tmp_path: Path) -> None:
    file = tmp_path / "v.json"
    write_variation(file, smoothed[by])
    again = read_variation(file)
    assert again.control == smoothed[by].control
    assert again.by == by
    assert again.report() == smoothed[by].report()
    write_variation(tmp_path / "again.json", again)
    assert (tmp_path / "again.json").read_bytes() == file.read_bytes()
    assert np.array_equal(read_motion(file).times, read_motion(tmp_path / "again.json").times)


def test_the_attractors_files_have_no_field_of_controls(kata: Piece, tmp_path: Path) -> None:
    write_variation(tmp_path / "v.json", vary(kata))
    section = json.loads((tmp_path / "v.json").read_bytes())["variation"]
    assert section.keys() == {"version", "piece", "course", "order", "joins", "edits"}
    assert section["piece"].keys() == {"motion", "frames", "facing"}


@pytest.mark.parametrize(
    ("by", "change", "message"),
    [
        ("attractor", {"course": None}, "a variation by attractor has a course"),
        ("shuffle", {"control": None}, "a variation by attractor has a course"),
        ("chunks", {"course": None}, "a variation by chunks has a course"),
        ("chunks", {"control": {"by": "shuffle", "seed": 0}}, "a variation by shuffle has no course"),
        ("shuffle", {"control": {"by": "quadrants", "seed": 0}}, "if and only if it is by quadrants"),
        ("quadrants", {"control": {"by": "shuffle", "seed": 0}}, "if and only if it is by quadrants"),
        ("shuffle", {"control": {"by": "shuffle", "seed": -1}}, "seed"),
        ("shuffle", {"control": {"by": "shuffle"}}, "a control by shuffle has a seed"),
        ("dabby", {"control": {"by": "dabby", "seed": 1}}, "a control by dabby has no seed"),
        ("shuffle", {"control": {"by": "cards", "seed": 1}}, "cards"),
    ],
)
def test_files_whose_parts_do_not_fit_are_refused(
    by: str, change: dict[str, object], message: str, kata: Piece, tmp_path: Path
) -> None:
    file = tmp_path / "v.json"
    write_variation(file, vary(kata, by=by))  # type: ignore[arg-type]
    content = json.loads(file.read_bytes())
    content["variation"] |= change
    file.write_text(json.dumps(content))
    with pytest.raises(FormatError, match=message):
        read_variation(file)


# --- refused --------------------------------------------------------------------------------------------------------

GIVEN: dict[str, object] = {
    "flow": FLOWS["rossler"],
    "nudge": 0.5,
    "depart": 0.3,
    "start": (1.0, 1.0, 20.0),
    "skip": 10,
    "step": 0.01,
    "transient": 100,
    "length": COUNT,
    "inserted": 0.3,
    "stretch": 2,
}


@pytest.mark.parametrize("by", CONTROLS)
def test_what_an_order_does_not_take_is_refused_and_all_else_taken(by: str, kata: Piece, karate: Engine) -> None:
    assert set().union(*REFUSED.values()) == set(GIVEN)
    for name, value in GIVEN.items():
        call: Callable[[], Variation] = lambda: vary(  # noqa: E731
            kata,
            karate,
            by=by,
            watch=lambda _: True,
            **{name: value},  # noqa: B023
        )
        if name in REFUSED[by]:  # type: ignore[index]
            with pytest.raises(MotionMindError, match=f"^{name} is not for {by}, which "):
                call()
        else:
            assert call().by == by


def test_orders_and_seeds_that_there_are_not_are_refused(kata: Piece) -> None:
    with pytest.raises(MotionMindError, match="no order by 'shufle'; did you mean shuffle"):
        vary(kata, by="shufle")  # type: ignore[arg-type]
    for seed in (-1, 2**63):
        with pytest.raises(MotionMindError, match="seed must be a whole number from 0"):
            vary(kata, by="shuffle", seed=seed)
    with pytest.raises(WrongTypeError, match="seed must be a whole number"):
        vary(kata, by="shuffle", seed=1.5)  # type: ignore[arg-type]


@pytest.mark.parametrize("by", RANDOM)
def test_random_orders_have_no_portrait(by: str, kata: Piece) -> None:
    with pytest.raises(MotionMindError, match=f"a variation by {by} is random, and has no trajectory"):
        portrait_of(vary(kata, by=by))  # type: ignore[arg-type]


def test_cells_of_dabbys_mapping_are_strips_up_to_the_next_site(kata: Piece) -> None:
    found = portrait_of(vary(kata, by="dabby"))
    assert np.array_equal(found.postures_at(found.points), found.order)
    assert found.order[0] != 0
    assert found.parting == 0
    assert np.array_equal(found.postures_at(found.sites), np.arange(COUNT))
    x = np.sort(found.sites[:, 0])
    middle = np.zeros((COUNT - 1, 3))
    middle[:, 0] = 0.5 * (x[1:] + x[:-1])
    assert np.array_equal(found.sites[found.postures_at(middle), 0], x[1:])
