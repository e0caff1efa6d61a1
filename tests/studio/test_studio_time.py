"""Laws of time in a piece: how long its parts last, and that what is held stands still."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionmind import human23
from motionmind.body.motion import Motion
from motionmind.errors import MotionMindError
from motionmind.formats import read_motion, write_motion
from motionmind.formats.bvh import write_bvh
from motionmind.geometry import rotations as rot
from motionmind.studio import edits as e
from motionmind.studio.piece import State, apply, apply_all
from motionmind.studio.placement import Marks, lay_out, performance
from motionmind.studio.project import Project, RefusedError
from motionmind.studio.questions import question_of
from motionmind.studio.settings import SetTempo
from motionmind.studio.sides import sides_of
from motionmind.studio.varying import Clock, Wanted, vary_blocks

HOLDS = st.sampled_from([0.0, 0.001, 0.4, 1.25, 30.0])


def wander(seed: int, frames: int) -> Motion:
    """A person whose joints turn at random."""
    rng = np.random.default_rng(seed)
    turns = rot.exp(np.cumsum(rng.normal(0.0, 0.03, (frames, 23, 3)), axis=0))
    root = np.cumsum(rng.normal(0.0, 0.02, (frames, 3)), axis=0) + np.array([0.0, 1.0, 0.0])
    return Motion(human23(), turns, root, np.arange(frames) / 30.0, name=f"wander {seed}")


MOVEMENTS = {"c/one": wander(1, 30), "c/two": wander(2, 20), "c/posture": wander(3, 1), "m-found": wander(4, 7)}
movement = MOVEMENTS.__getitem__


def posture(name: str, hold: float, source: str = "c/two", frame: int = 5) -> e.Insert:
    return e.Insert(name, source, frame, frame, hold=hold)


@st.composite
def pieces(draw: st.DrawFn) -> State:
    """Stretches and postures, held or not."""
    edits = []
    for number in range(draw(st.integers(1, 6))):
        first, last = sorted((draw(st.integers(0, 19)), draw(st.integers(0, 19))))
        source = draw(st.sampled_from(["c/one", "c/two"]))
        if draw(st.booleans()):
            edits.append(posture(f"b{number}", draw(HOLDS), source, first))
        elif first == last:
            edits.append(e.Insert(f"b{number}", source, first, last))
        else:
            time = {"pace": draw(st.sampled_from([0.5, 0.8, 1.0, 1.0, 2.0])), "repeats": draw(st.integers(1, 3))}
            edits.append(e.Insert(f"b{number}", source, first, last, **time))
    return apply_all(edits, State(corpus="c"))


def steady(state: State) -> State:
    """The piece at the recorded pace, each stretch once."""
    return apply_all([e.Play(block.id) for block in state.blocks], state)


def unheld(state: State) -> State:
    return apply_all([e.HoldPosture(block.id, 0.0) for block in state.blocks], state)


@given(pieces(), st.sets(st.integers(0, 4)))
@settings(max_examples=60, deadline=None)
def test_a_piece_lasts_longer_by_what_is_held(state, inserted):
    marks = Marks(movement)
    places = {seam.pair: place for place, seam in enumerate(state.seams)}

    def insertion(seam):
        return "m-found" if places[seam.pair] in inserted else None

    # Only seams that go on either way: a held posture within a recording is a seam of its own.
    if any(one.goes_on != other.goes_on for one, other in zip(state.seams, unheld(state).seams, strict=True)):
        return
    held, bare = (lay_out(one, insertion, marks) for one in (state, unheld(state)))
    holds = np.cumsum([0.0, *(block.hold for block in state.blocks)])
    assert held.seconds == pytest.approx(bare.seconds + holds[-1])
    for number, (one, other) in enumerate(zip(held.blocks, bare.blocks, strict=True)):
        assert one.at == pytest.approx(other.at + holds[number])
        assert one.seconds == pytest.approx(other.seconds + state.blocks[number].hold)
        assert one.place == pytest.approx(other.place)


@given(pieces())
@settings(max_examples=40, deadline=None)
def test_what_is_held_stands_still_and_all_else_moves_as_before(state):
    layout = lay_out(state, lambda _: "m-found", Marks(movement))
    whole = performance(list(layout.parts), movement)
    assert whole.times[-1] - whole.times[0] == pytest.approx(layout.seconds)
    assert (np.diff(whole.times) > 0.0).all()
    for block, part in zip(state.blocks, layout.blocks, strict=True):
        if not block.hold:
            continue
        at = whole.at(np.linspace(part.at, part.at + part.seconds, 9))
        assert np.ptp(at.rotations, axis=0).max() < 1e-12
        assert np.ptp(at.root, axis=0).max() < 1e-12


@pytest.mark.parametrize("suffix", [".bvh", ".glb", ".json"])
def test_files_of_the_piece_stand_still_too(tmp_path: Path, suffix: str) -> None:
    state = apply_all([e.Insert("b0", "c/one", 0, 9), posture("b1", 1.01), e.Insert("b2", "c/one", 20, 29)])
    layout = lay_out(state, lambda _: "m-found", Marks(movement))
    whole = performance(list(layout.parts), movement)
    path = tmp_path / f"piece{suffix}"
    if suffix == ".bvh":
        write_bvh(path, whole.resample(30.0), "m")
    else:
        write_motion(path, whole)
    back = read_motion(path)
    held = layout.blocks[1]
    times = back.times - back.times[0]
    at = back.at(back.times[0] + np.linspace(held.at + 0.001, held.at + held.seconds - 0.001, 20))
    rate = 30.0 if suffix == ".bvh" else 1e9
    inner = (times >= held.at + 1.0 / rate) & (times <= held.at + held.seconds - 1.0 / rate)
    frames = back.rotations[inner] if suffix == ".bvh" else at.rotations
    assert len(frames) > 10
    assert rot.angle(frames, frames[:1]).max() < 1e-3
    assert times[-1] == pytest.approx(layout.seconds, abs=1.0 / 30.0)


@pytest.mark.parametrize("seconds", ["-1", "-0.001", "3600.5", "1e999", "NaN", "Infinity", '"long"', "null"])
@pytest.mark.parametrize(
    "text",
    [
        '{{"edit": "hold", "block": "b1", "seconds": {}}}',
        '{{"edit": "insert", "id": "n", "source": "c/two", "first": 0, "last": 0, "hold": {}}}',
        '{{"edit": "arrange", "blocks": [{{"id": "n", "source": "c/two", "first": 0, "last": 0, "hold": {}}}]}}',
    ],
)
def test_no_hold_is_out_of_bounds(text: str, seconds: str) -> None:
    with pytest.raises(msgspec.DecodeError, match=r"^[^\n]+\Z"):
        msgspec.json.decode(text.format(seconds), type=e.Edit)


def test_only_a_posture_is_held() -> None:
    state = apply_all([e.Insert("b1", "c/two", 3, 9), posture("b2", 2.0)])
    for edit in (e.HoldPosture("b1", 1.0), e.Insert("n", "c/two", 3, 9, hold=1.0)):
        with pytest.raises(MotionMindError, match="only a posture can be held: this stretch has frames 3 to 9"):
            apply(state, edit)
    longer = apply(state, e.Trim("b2", 5, 6))
    assert longer.block("b2").hold == 0.0
    assert apply(state, e.Trim("b2", 7, 7)).block("b2").hold == 2.0
    assert apply(state, e.Mirror("b2")).block("b2").hold == 2.0


def test_a_held_posture_within_a_recording_is_a_seam_that_can_be_smoothed() -> None:
    recorded = [e.Insert("b1", "c/two", 0, 4), posture("b2", 0.0), e.Insert("b3", "c/two", 6, 9)]
    state = apply_all(recorded)
    assert [seam.goes_on for seam in state.seams] == [True, True]
    held = apply(state, e.HoldPosture("b2", 1.0))
    assert [seam.goes_on for seam in held.seams] == [False, False]
    twice = apply(held, e.Insert("b4", "c/two", 5, 5, before="b3", hold=1.0))
    assert [seam.goes_on for seam in twice.seams] == [False, True, False]


def test_insertions_begin_and_end_at_rest_beside_a_held_posture() -> None:
    state = apply_all([e.Insert("b1", "c/one", 0, 9), posture("b2", 0.5), e.Insert("b3", "c/one", 20, 29)])
    for number, sides in enumerate(sides_of(seam.ends, movement, "free") for seam in state.seams):
        still, moving = (sides.after, sides.before) if number == 0 else (sides.before, sides.after)
        assert still is not None
        assert np.ptp(still.rotations, axis=0).max() < 1e-12
        assert still.times[-1] - still.times[0] >= 0.2 - 1e-9
        assert moving is not None
        assert np.ptp(moving.rotations, axis=0).max() > 1e-3
    assert sides_of(unheld(state).seams[0].ends, movement, "free").after is None


def test_findings_stay_while_only_the_length_of_a_hold_changes() -> None:
    state = apply_all([e.Insert("b1", "c/one", 0, 9), posture("b2", 0.0), e.Decide("b1", "b2", "locked")])
    asked = question_of(state.seams[0].ends, e.Ask(), "c", {})
    assert b"rests" not in msgspec.json.encode(state.seams[0].ends)  # as in files from before there were holds
    with pytest.raises(MotionMindError, match="locked insertion: unlock it first"):
        apply(state, e.HoldPosture("b2", 1.0))
    held = apply_all([e.Decide("b1", "b2", "open"), e.HoldPosture("b2", 1.0), e.Decide("b1", "b2", "locked")], state)
    longer = apply(held, e.HoldPosture("b2", 3.0))
    assert longer.seams[0].verdict == held.seams[0].verdict
    now = [question_of(one.seams[0].ends, e.Ask(), "c", {}) for one in (held, longer)]
    assert now[0] == now[1] != asked


def test_a_variation_holds_the_same_postures() -> None:
    state = apply_all([posture(f"b{n}", 0.5 * n, "c/one", n) for n in range(12)])
    found = vary_blocks(state.blocks, Wanted(depart=0.5), lambda key: Clock(movement(key).times, None))
    assert len({block.first for block in found.blocks}) > 3
    for block in found.blocks:
        assert block.hold == 0.5 * block.first
    apply(state, e.Arrange(found.blocks, {}))


def test_a_hold_is_undone_redone_and_read_back(make_project: Callable[..., Project]) -> None:
    project = make_project()
    project.edit("w", e.Insert("b1", "ballet/adagio", 3, 3))
    before = project.state
    project.edit("w", e.HoldPosture("b1", 2.5))
    held = project.state
    assert held.block("b1").hold == 2.5
    assert project.undoable("w") == "hold a posture"
    project.undo("w")
    assert msgspec.json.encode(project.state.blocks) == msgspec.json.encode(before.blocks)
    project.redo("w")
    assert project.state == held
    with pytest.raises(RefusedError, match="no longer in the piece"):
        project.edit("w", e.HoldPosture("b9", 1.0))
    project.close()
    assert make_project().state == held


def test_a_file_from_before_there_were_holds_opens(make_project: Callable[..., Project], tmp_path: Path) -> None:
    project = make_project()
    project.edit("w", e.Insert("b1", "ballet/adagio", 3, 3))
    project.close()
    path = tmp_path / "piece.motionmind"
    data = path.read_bytes()
    old = data.replace(b',"hold":0.0', b"")
    assert old != data
    path.write_bytes(old)
    assert make_project().state.block("b1").hold == 0.0


# --- pace and repeats -----------------------------------------------------------------------------------------------


@given(pieces())
@settings(max_examples=60, deadline=None)
def test_a_stretch_lasts_as_long_as_pace_and_repeats_say(state) -> None:
    layout, once = (lay_out(one, lambda _: "m-found", Marks(movement)) for one in (state, steady(state)))
    found = float(movement("m-found").times[-1])
    for block, part, end, plain in zip(state.blocks, layout.blocks, layout.ends, once.blocks, strict=True):
        assert part.seconds == pytest.approx((plain.seconds - block.hold) / block.pace + block.hold)
        assert end - part.at == pytest.approx(block.repeats * part.seconds + (block.repeats - 1) * found)
    assert layout.seconds == pytest.approx(layout.parts[-1].at + layout.parts[-1].seconds)
    assert len(layout.insertions) == len(layout.gaps) == len(state.seams)
    for (begin, end), insertion in zip(layout.gaps, layout.insertions, strict=True):
        assert insertion is None or (insertion.at, insertion.seconds) == pytest.approx((begin, end - begin))


@given(pieces())
@settings(max_examples=40, deadline=None)
def test_every_recorded_posture_is_kept_at_its_time(state) -> None:
    """Pace moves the frames in time, and leaves each as it is."""
    layout = lay_out(state, lambda _: "m-found", Marks(movement))
    whole = performance(list(layout.parts), movement)
    for part in layout.parts:
        if part.inserted or part.first == part.last:
            continue
        own = movement(part.key)
        frames = slice(part.first, part.last + 1)
        shares = (own.times[frames] - own.times[part.first]) / (own.times[part.last] - own.times[part.first])
        shown = whole.at(part.at + part.seconds * shares)
        assert rot.angle(shown.rotations[:, 1:], own.rotations[frames, 1:]).max() < 1e-6
        assert shown.root[:, 1] == pytest.approx(own.root[frames, 1])


def test_repeats_are_copies_but_for_their_seam() -> None:
    repeated = apply_all([e.Insert("b1", "c/one", 3, 12, pace=0.5, repeats=3), e.Insert("b2", "c/two", 0, 5)])
    copies = apply_all(
        [*(e.Insert(f"b{n}", "c/one", 3, 12, pace=0.5) for n in range(3)), e.Insert("b9", "c/two", 0, 5)]
    )
    one, other = (lay_out(state, lambda _: "m-found", Marks(movement)) for state in (repeated, copies))
    assert one.parts == other.parts
    assert [seam.pair for seam in repeated.seams] == [("b1", "b1"), ("b1", "b2")]
    chosen = apply(repeated, e.Choose("b1", "b1", 2))
    assert chosen.seam("b1", "b1").verdict.chosen == 2
    assert chosen.seam("b1", "b2").verdict.chosen == 1
    assert repeated.seams[0].ends == copies.seams[0].ends


@given(st.integers(1, 4), st.integers(1, 4), st.integers(5, 11), st.booleans())
@settings(max_examples=40, deadline=None)
def test_a_stretch_that_repeats_is_split_into_stretches_that_play_the_same(turn, repeats, at, is_open) -> None:
    turn = min(turn, repeats)
    state = apply_all([e.Insert("b0", "c/two", 0, 5), e.Insert("b1", "c/one", 3, 12, pace=0.5, repeats=repeats)])
    state = apply(state, e.Insert("b2", "c/two", 0, 5))
    decided = [e.Choose("b0", "b1", 4), e.Choose("b1", "b2", 3), e.Annotate(e.Note("n", "marker", "", "b1", 5))]
    if repeats > 1:
        decided += [e.Choose("b1", "b1", 2), *([] if is_open else [e.Decide("b1", "b1", "locked")])]
    state = apply(state, e.Several(tuple(decided), "decide"))
    after = apply(state, e.Split("b1", at, "n2", turn, "n1", "n3"))
    one, other = (
        performance(
            list(lay_out(each, lambda seam: None if seam.goes_on else "m-found", Marks(movement)).parts), movement
        )
        for each in (state, after)
    )
    times = np.linspace(one.times[0], one.times[-1], 200)
    assert other.times[-1] == pytest.approx(one.times[-1])
    assert rot.angle(one.at(times).rotations, other.at(times).rotations).max() < 1e-6
    played = [(block.first, block.last) for block in after.blocks for _ in range(block.repeats)]
    whole = (3, 12)
    assert played[1:-1] == [*[whole] * (turn - 1), (3, at - 1), (at, 12), *[whole] * (repeats - turn)]
    verdicts = {ends: seam.verdict for seam in state.seams for ends in [seam.ends]}
    for seam in after.seams:
        assert seam.goes_on or seam.ends not in verdicts or seam.verdict == verdicts[seam.ends]
    note = after.notes["n"]
    assert after.block(note.block).first <= note.frame <= after.block(note.block).last


def test_velocities_at_a_seam_have_the_pace_of_their_stretch() -> None:
    state = apply_all([e.Insert("b1", "c/one", 0, 19, pace=0.5), e.Insert("b2", "c/two", 4, 19, pace=2.0)])
    paced, plain = (sides_of(one.seams[0].ends, movement, "free") for one in (state, steady(state)))
    for side, pace in (("before", 0.5), ("after", 2.0)):
        mine, own = getattr(paced, side), getattr(plain, side)
        count = min(len(mine), len(own)) - 1
        frames = slice(-count, None) if side == "before" else slice(0, count)
        assert np.diff(mine.times[frames]) == pytest.approx(np.diff(own.times[frames]) / pace)
        assert mine.times[-1] - mine.times[0] >= 0.2 - 1e-9
    assert paced.seconds == pytest.approx(2.0 * plain.seconds)
    assert b"pace" not in msgspec.json.encode(steady(state).seams[0].ends)


def test_what_cannot_be_played_so_is_refused() -> None:
    state = apply_all([e.Insert("b1", "c/two", 3, 9), posture("b2", 2.0), e.Play("b1", 2.0, 3)])
    for edit, reason in [
        (e.Play("b2", 1.0, 2), "a posture cannot repeat: hold it for longer"),
        (e.Split("b1", 5, "n"), "give new ids to its other playings"),
        (e.Split("b1", 5, "n", 3), "give new ids to its other playings"),
        (e.Split("b1", 5, "n", 4, "o", "p"), "cannot split playing 4: the stretch plays 3 times"),
        (e.Split("b1", 5, "n", 2, "n", "p"), "id n is taken"),
        (e.Split("b1", 5, "n", 2, "o", "b2"), "id b2 is taken"),
        (e.Split("b1", 10, "n", 2, "o", "p"), "the stretch has frames 3 to 9"),
        (e.Play("b9", 1.0, 2), "no longer in the piece"),
    ]:
        with pytest.raises(MotionMindError, match=reason):
            apply(state, edit)
    assert apply(state, e.Trim("b1", 5, 5)).block("b1").repeats == 1
    assert apply(state, e.Trim("b1", 5, 6)).block("b1").repeats == 3
    locked = apply(state, e.Decide("b1", "b1", "locked"))
    with pytest.raises(MotionMindError, match="locked insertion"):
        apply(locked, e.Play("b1", 1.0, 3))
    assert apply(locked, e.Play("b1", 2.0, 5)).seam("b1", "b1").verdict.decision == "locked"


@pytest.mark.parametrize("fields", ['"pace": 0.49', '"pace": 2.01', '"pace": NaN', '"repeats": 0', '"repeats": 1.5'])
def test_no_pace_or_repeats_are_out_of_bounds(fields: str) -> None:
    for text in (
        '{"edit": "play", "block": "b1", %s}',
        '{"edit": "insert", "id": "n", "source": "c", "first": 0, "last": 1, %s}',
    ):
        with pytest.raises(msgspec.DecodeError):
            msgspec.json.decode(text % fields, type=e.Edit)


def test_a_variation_plays_stretches_as_the_piece_does() -> None:
    blocks = (e.Block("b1", "c/one", 0, 14, pace=0.5, repeats=3), e.Block("b2", "c/one", 15, 29, pace=2.0))
    state = State(blocks=blocks, used=frozenset({"b1", "b2"}))

    def varied(nudge: float) -> tuple[e.Block, ...]:
        return vary_blocks(blocks, Wanted(nudge=nudge), lambda key: Clock(movement(key).times, None)).blocks

    assert varied(0.0) == blocks
    other = varied(4.0)
    assert len(other) > 2
    for block in other:
        assert block.pace == (0.5 if block.first < 15 else 2.0)
        assert block.repeats == (3 if (block.first, block.last) == (0, 14) else 1)
    apply(state, e.Arrange(other, {}))


def test_pace_and_repeats_are_undone_redone_and_read_back(make_project: Callable[..., Project]) -> None:
    project = make_project()
    project.edit("w", e.Insert("b1", "ballet/adagio", 3, 9))
    before = project.state
    project.edit("w", e.Play("b1", 0.75, 2))
    played = project.state
    project.undo("w")
    assert msgspec.json.encode(project.state.blocks) == msgspec.json.encode(before.blocks)
    project.redo("w")
    project.close()
    assert make_project().state == played


# --- tempo ----------------------------------------------------------------------------------------------------------


def test_the_tempo_belongs_to_the_project(make_project: Callable[..., Project]) -> None:
    project = make_project()
    before = project.state
    assert (before.tempo, before.counts) == (120.0, 8)
    project.edit("w", SetTempo(92.5, 6))
    counted = project.state
    assert (counted.tempo, counted.counts) == (92.5, 6)
    assert project.undoable("w") == "change the tempo"
    project.undo("w")
    assert project.state == before
    project.redo("w")
    project.close()
    assert make_project().state == counted


@pytest.mark.parametrize("fields", ['"tempo": 19.9', '"tempo": 301', '"tempo": NaN', '"tempo": 90, "counts": 1', ""])
def test_no_tempo_is_out_of_bounds(fields: str) -> None:
    with pytest.raises(msgspec.DecodeError):
        msgspec.json.decode(f'{{"edit": "tempo"{", " if fields else ""}{fields}}}', type=e.Edit)
