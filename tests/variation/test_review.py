"""The review of a variation: edits that can be undone, and what comes of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from command_line import Run
from hypothesis import given, settings
from hypothesis import strategies as st

from motionmind.chaos.flows import FLOWS
from motionmind.errors import MotionMindError
from motionmind.formats import read_motion
from motionmind.tween.engine import Engine
from motionmind.variation.piece import Piece
from motionmind.variation.variation import Variation, vary
from motionmind.variation.variation_json import read_variation, write_variation

LENGTH = 61


@pytest.fixture(scope="module")
def karate() -> Engine:
    return Engine.load("karate")


@pytest.fixture(scope="module")
def variation(karate: Engine) -> Variation:
    clip = next(one for one in karate.corpus.clips if one.name == "heian-shodan")
    return vary(
        Piece.of(karate.corpus.motion(clip)), karate, flow=FLOWS["rossler"], nudge=1.0, length=LENGTH, alternatives=2
    )


def inserted(variation: Variation) -> list[int]:
    return [seam.number for seam in variation.seams if seam.insertion]


def decided(variation: Variation) -> dict[int, tuple[str, int]]:
    return {seam.number: (seam.decision, seam.chosen) for seam in variation.seams}


places = st.integers(0, LENGTH - 1)
cuts = st.tuples(places, places, st.integers(0, LENGTH)).filter(lambda cut: not min(cut[:2]) < cut[2] <= max(cut[:2]))
edits = st.lists(
    st.one_of(
        st.tuples(st.sampled_from(["approve", "discard", "replace"]), st.integers(0, 100)),
        st.tuples(st.just("smooth"), st.integers(1, 3)),
        cuts.map(lambda cut: ("cut", (min(cut[:2]), max(cut[:2]), cut[2]))),
    ),
    max_size=6,
)


def edit(variation: Variation, engine: Engine, what: str, how: object) -> Variation:
    """An edit of any kind; `how` picks one of the seams there are, or says what to cut, or the most moves."""
    if what == "cut":
        return variation.cut(*how)  # type: ignore[misc]
    if what == "smooth":
        return variation.smooth(engine, alternatives=1, max_moves=how)
    if what == "replace":
        many = [seam for seam in variation.seams if seam.transition and len(seam.transition.candidates) > 1]
        seam = many[how % len(many)]  # type: ignore[operator]
        return variation.replace(seam.number, 3 - seam.chosen)
    numbers = inserted(variation)
    if not numbers:
        return variation
    number = numbers[how % len(numbers)]  # type: ignore[operator]
    found: Variation = getattr(variation, what)(number)
    return found


def seen(variation: Variation) -> list[object]:
    """All that a reviewer sees of it, and which movement it is that stands at each seam."""
    report = {key: value for key, value in variation.report().items() if key != "edits"}
    return [report, [id(seam.insertion) for seam in variation.seams]]


@pytest.mark.long
@settings(max_examples=10)
@given(edits=edits)
def test_undo_takes_back_one_edit_after_another(
    variation: Variation, karate: Engine, edits: list[tuple[str, object]]
) -> None:
    states = [variation]
    for what, how in edits:
        after = edit(states[-1], karate, what, how)
        assert (seen(after) == seen(states[-1])) == (after is states[-1])  # what changes nothing is no edit
        if after is not states[-1]:
            states.append(after)
    found = states[-1]
    for before in states[-2::-1]:
        found = found.undo()
        assert found.report() == before.report()
        assert seen(found) == seen(before)
    with pytest.raises(MotionMindError, match="there is no edit to undo"):
        found.undo()


def test_undone_movement_is_what_it_was_to_the_last_bit(variation: Variation) -> None:
    first, second, *_ = (
        seam.number for seam in variation.seams if seam.transition and len(seam.transition.candidates) == 2
    )
    one = variation.discard(first).replace(second, 2).cut(4, 9, 30).undo().undo().undo().motion()
    assert np.array_equal(one.rotations, variation.motion().rotations)
    assert np.array_equal(one.times, variation.motion().times)


@settings(max_examples=30)
@given(chosen=st.lists(st.integers(0, 100), min_size=2, max_size=5, unique_by=lambda n: n % 7))
def test_approving_and_discarding_commute(variation: Variation, chosen: list[int]) -> None:
    numbers = list(dict.fromkeys(inserted(variation)[n % 7] for n in chosen))
    half = len(numbers) // 2
    one = variation.approve(*numbers[:half]).discard(*numbers[half:])
    other = variation.discard(*numbers[half:]).approve(*numbers[:half])
    assert decided(one) == decided(other)
    assert np.array_equal(one.motion().rotations, other.motion().rotations)


def test_the_result_is_all_insertions_but_those_discarded(variation: Variation) -> None:
    first, second, third, *_ = inserted(variation)
    found = variation.approve(first).discard(second, third)
    assert len(found.motion().insertions) == len(variation.motion().insertions) - 2
    assert {seam.number for seam in found.seams if seam.is_abrupt} == {second, third}
    assert set(inserted(found.discard(*inserted(found)))) == set()
    assert not found.discard(*inserted(found)).motion().inserted().any()


def test_another_alternative_stands_in_its_place_and_is_open_again(variation: Variation) -> None:
    seam = next(one for one in variation.seams if one.transition and len(one.transition.candidates) == 2)
    found = variation.discard(seam.number).replace(seam.number, 2)
    (now,) = (one for one in found.seams if one.number == seam.number)
    assert (now.decision, now.chosen) == ("open", 2)
    assert seam.transition
    assert now.insertion is seam.transition.candidates[1]
    longer = seam.transition.candidates[1].motion.times[-1] - seam.transition.candidates[0].motion.times[-1]
    assert found.motion().times[-1] == pytest.approx(variation.motion().times[-1] + longer)


@settings(max_examples=50)
@given(cut=cuts)
def test_cut_and_paste_moves_postures_and_loses_none(variation: Variation, cut: tuple[int, int, int]) -> None:
    first, last, before = min(cut[:2]), max(cut[:2]), cut[2]
    found = variation.cut(first, last, before)
    own = variation.postures.tolist()
    marked = [*own[:before], None, *own[before:]]  # the place to paste is marked, then what is cut taken out
    shift = before <= first
    taken = marked[first + shift : last + 1 + shift]
    rest = marked[: first + shift] + marked[last + 1 + shift :]
    at = rest.index(None)
    assert found.postures.tolist() == rest[:at] + taken + rest[at + 1 :]
    assert sorted(found.postures) == sorted(own)
    leaps = [n for n, (i, k) in enumerate(pairwise(found.postures)) if k not in (i, i + 1)]
    assert [seam.at for seam in found.seams] == leaps
    assert [seam.number for seam in found.seams] == list(range(1, len(found.seams) + 1))
    motion, frames = found.arrange()
    assert np.array_equal(motion.rotations[frames, 1:], found.piece.motion.rotations[found.postures, 1:])


@pytest.mark.long
def test_new_seams_are_not_judged_until_they_are_smoothed(variation: Variation, karate: Engine) -> None:
    found = variation.cut(5, 9, 60)
    old = {(seam.start, seam.end) for seam in variation.seams}
    unjudged = {(seam.start, seam.end) for seam in found.seams if seam.transition is None}
    assert unjudged
    assert not unjudged & old
    smoothed = found.approve(inserted(found)[0]).smooth(karate, alternatives=1)
    assert all(seam.transition and not seam.is_abrupt for seam in smoothed.seams)
    assert decided(smoothed) == decided(smoothed.undo())
    assert smoothed.smooth(karate) is smoothed
    # What is known of a transition is known wherever it comes.
    assert not [
        seam for seam in smoothed.cut(0, 0, LENGTH).cut(LENGTH - 1, LENGTH - 1, 0).seams if seam.transition is None
    ]


def test_what_changes_nothing_is_no_edit(variation: Variation) -> None:
    first = inserted(variation)[0]
    approved = variation.approve(first)
    for one, again in (
        (variation, variation.approve()),
        (variation, variation.discard()),
        (variation, variation.cut(0, 19, 20)),
        (variation, variation.cut(0, 0, 0)),
        (variation, variation.replace(first, 1)),
        (approved, approved.approve(first)),
    ):
        assert again is one


@pytest.mark.long
def test_nobody_has_approved_what_is_put_in_later(variation: Variation, karate: Engine) -> None:
    bare = vary(variation.piece, flow=FLOWS["rossler"], nudge=1.0, length=LENGTH)
    found = bare.approve(*(seam.number for seam in bare.seams)).smooth(karate, alternatives=1)
    assert {seam.decision for seam in found.seams if seam.insertion} == {"open"}
    assert {seam.decision for seam in found.seams if not seam.insertion} <= {"approved"}
    assert {seam.decision for seam in found.undo().seams} == {"approved"}


def test_a_discarded_insertion_is_made_anew_and_is_open(variation: Variation, karate: Engine) -> None:
    transitions = [(seam.start, seam.end) for seam in variation.seams]
    gone = next(
        seam
        for seam in variation.seams
        if seam.transition and len(seam.transition.candidates) == 2 and transitions.count((seam.start, seam.end)) == 1
    )
    kept = next(number for number in inserted(variation) if number != gone.number)
    without = variation.approve(kept).replace(gone.number, 2).discard(gone.number)
    found = without.smooth(karate, alternatives=1, novelty=1.0)
    now = {seam.number: seam for seam in found.seams}
    assert (now[gone.number].decision, now[gone.number].chosen) == ("open", 1)
    assert now[gone.number].transition.options["novelty"] == 1.0  # type: ignore[union-attr]
    assert now[gone.number].insertion is not gone.insertion
    others = {number: seam.insertion for number, seam in now.items() if number != gone.number}
    assert others == {seam.number: seam.insertion for seam in without.seams if seam.number != gone.number}
    assert now[kept].decision == "approved"
    assert seen(found.undo()) == seen(without)
    # Where nothing is found what there was stays, as an alternative to come back to.
    assert without.smooth(karate, strict=True, max_moves=1) is without


@pytest.mark.long
def test_what_stands_elsewhere_is_not_made_anew(variation: Variation, karate: Engine) -> None:
    seam = next(one for one in variation.seams if one.insertion)
    order = np.array([seam.start, seam.end, seam.start, seam.end])
    twice = replace(variation, order=order, transitions=()).smooth(karate, alternatives=1)
    first, *_, last = (one.number for one in twice.seams if (one.start, one.end) == (seam.start, seam.end))
    some = twice.discard(first)
    assert some.smooth(karate, novelty=1.0) is some
    both = some.discard(last).smooth(karate, novelty=1.0)
    assert [one.decision for one in both.seams if one.number in (first, last)] == ["open", "open"]


REFUSED: list[tuple[Callable[[Variation], object], str]] = [
    (lambda v: v.approve(999), "no seam 999; there are 1, 2"),
    (lambda v: v.discard(999), "no seam 999"),
    (lambda v: v.replace(inserted(v)[0], 9), "has alternatives 1 to"),
    (lambda v: v.cut(5, 200, 1), f"cannot cut 5..200: postures are 0 to {LENGTH - 1}"),
    (lambda v: v.cut(9, 5, 1), "cannot cut 9..5"),
    (lambda v: v.cut(1.5, 2, 5), "first must be a whole number, not 1.5"),  # type: ignore[arg-type]
    (lambda v: v.approve(1, True), "a seam's number must be a whole number, not True"),
    (lambda v: v.discard(1.0), "a seam's number must be a whole number"),  # type: ignore[arg-type]
    (lambda v: v.replace(inserted(v)[0], "2"), "an alternative's number must be"),  # type: ignore[arg-type]
    (lambda v: v.cut(5, 9, 7), "cannot paste before 7: it is itself among 5..9"),
    (lambda v: v.cut(5, 9, LENGTH + 1), f"cannot paste before {LENGTH + 1}"),
    (
        lambda v: (found := v.cut(5, 9, 60)).discard(next(s.number for s in found.seams if s.transition is None)),
        "has no insertion to discard",
    ),
]


@pytest.mark.parametrize(("refused", "message"), REFUSED)
def test_what_cannot_be_done_is_refused(
    variation: Variation, refused: Callable[[Variation], object], message: str
) -> None:
    with pytest.raises(MotionMindError, match=message):
        refused(variation)


# --- the command line -----------------------------------------------------------------------------------------------


@pytest.fixture
def file(variation: Variation, tmp_path: Path) -> Path:
    path = tmp_path / "variation.json"
    write_variation(path, variation)
    return path


@pytest.mark.long
def test_review_on_the_command_line_is_review_from_python(run: Run, file: Path, variation: Variation) -> None:
    first, second, third, *_ = inserted(variation)
    two = next(seam.number for seam in variation.seams if seam.transition and len(seam.transition.candidates) == 2)
    original = file.read_bytes()
    listed = run("review", file, "--list")
    assert listed.code == 0
    stays = bool(variation.report()["counts"]["stays"])
    assert len(listed.out.splitlines()) == 6 + stays + 1 + len(variation.seams)
    assert file.read_bytes() == original
    for arguments in (
        ("--approve", f"{first},{second}"),
        ("--discard", third),
        ("--replace", two, "--alternative", 2),
        ("--cut", "10..14", "--paste", 30),
        ("--smooth", "karate", "--alternatives", 1),
        ("--approve", "all"),
    ):
        done = run("review", file, *arguments)
        assert done.code == 0, done.err
    expected = variation.approve(first, second).discard(third).replace(two, 2).cut(10, 14, 30)
    expected = expected.smooth(Engine.load("karate"), alternatives=1)
    expected = expected.approve(*inserted(expected))
    assert run("review", file, "--json").json == expected.report()
    np.testing.assert_allclose(read_motion(file).root, expected.motion().root, atol=1e-8)
    assert run("review", file, "--undo", "--undo", "-o", "other.json").code == 0
    assert run("review", "other.json", "--json").json == expected.undo().undo().report()
    done = run("review", file, *(6 * ["--undo"]))
    assert done.code == 0
    assert file.read_bytes() == original


@pytest.mark.parametrize(
    ("arguments", "messages"),
    [
        (("--cut", "0..19", "--paste", 20), ["nothing changed"]),
        (
            ("--smooth", "karate"),
            ["no seam left to smooth; --discard a seam to smooth it again", "nothing changed"],
        ),
    ],
)
def test_what_changes_nothing_is_said(run: Run, file: Path, arguments: tuple[object, ...], messages: list[str]) -> None:
    before = file.read_bytes()
    done = run("review", file, *arguments)
    assert (done.code, done.out) == (0, "")
    assert done.err.splitlines() == [f"note: {message}" for message in messages]
    assert file.read_bytes() == before
    assert run("review", file, "--approve", "all").out.startswith("written")
    assert run("review", file, "--approve", "all").err == "note: nothing changed\n"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--approve", "999"), "no seam 999"),
        (("--approve", "one"), "'one' is neither a number"),
        (("--cut", "1..2"), "--cut and --paste need each other"),
        (("--cut", "1...2", "--paste", "3"), "'1...2' is neither a posture's number"),
        (("--replace", "1"), "--replace and --alternative need each other"),
        (("--undo",), "there is no edit to undo"),
        (("--smooth", "nothing"), "no corpus 'nothing'"),
        (("--strict",), "--strict needs --smooth"),
        (("--alternatives", "2"), "--alternatives needs --smooth"),
        (("-o", "out.json"), "-o is for an edited variation"),
        (("--approve", "all", "-o", "out.bvh"), "the name must end in one of .json"),
    ],
)
def test_bad_edits_are_one_line_and_change_nothing(
    run: Run, file: Path, arguments: tuple[str, ...], message: str
) -> None:
    before = file.read_bytes()
    done = run("review", file, *arguments)
    assert done.code == 2
    assert message in done.err
    assert len(done.err.strip().splitlines()) == 1
    assert file.read_bytes() == before
    assert sorted(path.name for path in file.parent.iterdir()) == [file.name]


def test_what_is_no_variation_is_refused(run: Run, file: Path, variation: Variation) -> None:
    from motionmind.formats import write_motion

    write_motion(file.parent / "motion.json", variation.motion())
    done = run("review", "motion.json", "--list")
    assert done.code == 2
    assert "holds movement alone, where a variation was expected" in done.err


def test_what_is_read_holds_what_was_written(file: Path, variation: Variation) -> None:
    assert read_variation(file).report() == variation.report()
