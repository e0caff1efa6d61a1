"""Laws of edits and of the states that they lead to."""

from itertools import pairwise

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionmind.errors import MotionMindError
from motionmind.studio import edits as e
from motionmind.studio.checks import check_movements, check_names
from motionmind.studio.dancers import CastEdit
from motionmind.studio.edit_words import _DESCRIPTIONS, words_of
from motionmind.studio.neighbours import End, Verdict
from motionmind.studio.piece import State, apply, apply_all
from motionmind.studio.questions import question_of
from motionmind.studio.settings import SetCorpus, SetTempo, SetTitle

IDS = [f"b{number}" for number in range(8)]
FRAMES = st.integers(0, 12)
LENGTH = 10  # frames of each movement
ids = st.sampled_from(IDS)
before = st.none() | ids
sources = st.sampled_from(["ballet/adagio", "~ballet/adagio", "karate/kata", "own/rest"])
passing = st.builds(e.Passing, sources, FRAMES)
blocks = st.builds(e.Block, ids, sources, FRAMES, FRAMES, st.booleans())
notes = st.builds(
    e.Note, st.sampled_from(["n1", "n2"]), st.sampled_from(["note", "marker", "section"]), st.just("x"), ids, FRAMES
)
singles = st.one_of(
    st.builds(e.Insert, ids, sources, FRAMES, FRAMES, st.booleans(), before),
    st.builds(e.Move, ids, before),
    st.builds(e.Trim, ids, FRAMES, FRAMES),
    st.builds(e.HoldPosture, ids, st.sampled_from([0.0, 0.5, 3600.0])),
    st.builds(e.Play, ids, st.sampled_from([0.5, 1.0, 1.25]), st.integers(1, 3)),
    st.builds(e.Split, ids, FRAMES, ids, st.integers(1, 3), ids, ids),
    st.builds(e.Mirror, ids),
    st.builds(e.Delete, ids),
    st.builds(e.Choose, ids, ids, st.integers(1, 4)),
    st.builds(e.Decide, ids, ids, st.sampled_from(["open", "locked", "discarded"])),
    st.builds(e.Wish, ids, ids, st.none() | st.floats(0.1, 9.0), st.lists(passing, max_size=2).map(tuple)),
    st.builds(e.Arrange, st.lists(blocks, max_size=4).map(tuple), st.just({"words": "vary the piece"})),
    st.builds(e.SavePosture, st.sampled_from(["rest", "reach"]), st.none() | st.just("m-1")),
    st.builds(SetCorpus, st.sampled_from(["ballet", "karate"])),
    st.builds(SetTempo, st.floats(20.0, 300.0), st.integers(2, 16)),
    st.builds(SetTitle, st.text(max_size=5)),
    st.builds(e.Annotate, notes),
    st.builds(e.Erase, st.sampled_from(["n1", "n2"])),
    st.builds(e.SaveVersion, st.just("before"), st.booleans()),
    st.builds(e.GoBack, st.just("before")),
)
anything = singles | st.builds(e.Several, st.lists(singles, min_size=1, max_size=3).map(tuple))
BEGIN = State(
    corpus="ballet",
    blocks=tuple(e.Block(name, "ballet/adagio", 2, 8) for name in IDS[:4]),
    used=frozenset(IDS[:4]),
    postures={"rest": "m-0"},
)


def fits(state: State, edit: e.Edit) -> State | None:
    try:
        return apply(state, edit)
    except MotionMindError:
        return None


def played(history: list[e.Edit], state: State = BEGIN) -> tuple[list[e.Edit], State]:
    """The edits of a history that fit, and the state that they lead to."""
    kept = []
    for edit in history:
        after = fits(state, edit)
        if after is not None:
            kept.append(edit)
            state = after
    return kept, state


@given(st.lists(anything, max_size=12))
def test_state_is_what_its_edits_lead_to_when_read_back(history):
    kept, state = played(history)
    written = [msgspec.json.decode(msgspec.json.encode(edit), type=e.Edit) for edit in kept]
    assert written == kept
    assert apply_all(written, BEGIN) == state


@given(st.lists(anything, max_size=12))
def test_every_state_is_sound(history):
    _, state = played(history)
    names = [block.id for block in state.blocks]
    assert len(set(names)) == len(names)
    assert set(names) <= state.used
    assert BEGIN.used <= state.used
    for block in state.blocks:
        assert block.first <= block.last
        assert not block.source.startswith(("~", "own/"))
        assert block.first == block.last or block.hold == 0.0
        assert block.first < block.last or block.repeats == 1
    heard = [name for name, block in zip(names, state.blocks, strict=True) for _ in range(1 + (block.repeats > 1))]
    assert [seam.pair for seam in state.seams] == list(pairwise(heard))


@given(st.lists(singles, max_size=8), singles)
def test_what_an_edit_does_not_touch_stays(history, edit):
    _, state = played(history)
    after = fits(state, edit)
    if after is None or isinstance(edit, e.Arrange | e.GoBack):
        return
    touched = e.touched(edit)
    now = {block.id: block for block in after.blocks}
    for block in state.blocks:
        assert block.id in touched or now.get(block.id) == block
    rest = [block.id for block in state.blocks if block.id not in touched]
    assert [block.id for block in after.blocks if block.id not in touched] == rest
    for pair, verdict in state.verdicts.items():
        assert touched & {pair, *pair} or after.verdicts.get(pair) == verdict
    assert "/corpus" in touched or after.corpus == state.corpus
    assert "/title" in touched or after.title == state.title
    assert "/tempo" in touched or (after.tempo, after.counts) == (state.tempo, state.counts)
    for name, key in state.postures.items():
        assert f"own/{name}" in touched or after.postures[name] == key
    for name, note in state.notes.items():
        assert f"/note/{name}" in touched or after.notes[name].text == note.text


@given(st.lists(singles, max_size=6), singles, st.lists(singles, max_size=4))
def test_undo_by_replay_takes_back_that_edit_alone(history, taken_back, later):
    """Where the later edits rest on it in no way, they do the same without it."""
    _, state = played(history)
    if isinstance(taken_back, e.Arrange) or fits(state, taken_back) is None:
        return
    kept, after = played(later, apply(state, taken_back))
    mine = e.touched(taken_back)
    if any(mine & e.touched(edit) or isinstance(edit, e.Arrange) for edit in kept):
        return
    try:
        without = apply_all(kept, state)
    except MotionMindError:
        return  # a later edit rests on it
    others = {block.id: block for block in without.blocks if block.id not in mine}
    assert others == {block.id: block for block in after.blocks if block.id not in mine}
    for name in mine & {block.id for block in state.blocks}:
        assert without.block(name) == state.block(name)


@given(st.lists(singles, max_size=6), st.lists(singles, min_size=1, max_size=4))
def test_several_edits_are_done_together_or_not_at_all(history, together):
    _, state = played(history)
    kept, after = played(together, state)
    whole = fits(state, e.Several(tuple(together)))
    assert whole == (after if len(kept) == len(together) else None)


@given(st.lists(singles, max_size=6), ids)
def test_a_moved_block_stands_before_the_one_named(history, name):
    _, state = played(history)
    for block in state.blocks:
        after = fits(state, e.Move(block.id, name))
        if after is not None:
            assert after.blocks[after.place(block.id) + 1].id == name


@given(st.lists(singles, max_size=6), ids)
def test_mirroring_twice_and_moving_back_change_nothing(history, name):
    _, state = played(history)
    once = fits(state, e.Mirror(name))
    if once is not None:
        assert once != state
        assert apply(once, e.Mirror(name)).blocks == state.blocks
    for block in state.blocks:
        place = state.place(block.id)
        after = state.blocks[place + 1].id if place + 1 < len(state.blocks) else None
        away = apply(state, e.Move(block.id, None))
        assert away.blocks[-1] == block
        assert apply(away, e.Move(block.id, after)).blocks == state.blocks
        assert apply(away, e.Move(block.id, after)).verdicts == state.verdicts


@given(FRAMES, FRAMES, st.integers(-1, 14))
@settings(max_examples=200)
def test_trimming_and_splitting_stay_in_bounds(first, last, at):
    state = fits(BEGIN, e.Trim("b1", first, last))
    assert (state is None) == (first > last)
    if state is None:
        return
    split = fits(state, e.Split("b1", at, "new"))
    assert (split is None) == (not first < at <= last)
    if split is not None:
        one, other = split.block("b1"), split.block("new")
        assert (one.first, one.last + 1, other.last) == (first, other.first, last)
        assert split.seam("b1", "new").goes_on


def test_an_edit_names_movement_that_is_there_and_long_enough():
    def frames(key):
        if "nowhere" in key:
            raise MotionMindError(f"no movement {key}")
        return LENGTH

    good = [e.Insert("n", "karate/kata", 0, 9), e.Trim("b1", 0, 9), e.Wish("b0", "b1", 1.0, (e.Passing("own/rest"),))]
    bad = [
        e.Insert("n", "karate/kata", 0, 10),
        e.Insert("n", "nowhere/x", 0, 1),
        e.Trim("b1", 0, 10),
        e.Wish("b0", "b1", 1.0, (e.Passing("karate/kata", 10),)),
        e.Arrange((e.Block("n", "karate/kata", 3, 11),)),
        e.SavePosture("x", "nowhere/x"),
        e.Several((e.Mirror("b1"), e.Insert("n", "karate/kata", 0, 10))),
    ]
    for edit in good:
        check_movements(apply(BEGIN, edit), edit, frames)
    for edit in bad:
        with pytest.raises(MotionMindError, match=r"its frames are 0 to 9|no movement"):
            check_movements(apply(BEGIN, edit), edit, frames)


def test_a_locked_insertion_changes_only_when_it_is_unlocked():
    state = apply_all([e.Choose("b1", "b2", 3), e.Decide("b1", "b2", "locked")], BEGIN)
    for edit in (
        e.Choose("b1", "b2", 1),
        e.Wish("b1", "b2", 2.0),
        e.Trim("b1", 2, 7),
        e.Trim("b2", 3, 8),
        e.Mirror("b2"),
    ):
        with pytest.raises(MotionMindError, match="locked insertion: unlock it first"):
            apply(state, edit)
    assert apply(state, e.Trim("b1", 3, 8)).verdicts == state.verdicts
    assert apply(state, e.Split("b1", 5, "n")).seam("n", "b2").verdict == Verdict(
        chosen=3, decision="locked", corpus="ballet"
    )
    open_again = apply_all([e.Decide("b1", "b2", "open"), e.Trim("b1", 2, 7)], state)
    assert open_again.seam("b1", "b2").verdict == Verdict()


@pytest.mark.parametrize("name", [".", "..", "arms/."])
def test_a_posture_has_a_name_by_which_it_can_be_asked_for(name):
    with pytest.raises(MotionMindError, match="cannot be the name"):
        check_names(e.Several((SetTitle("Swan"), e.SavePosture(name, "m-1"))))
    check_names(e.SavePosture(name, None))  # which an earlier version let save it
    check_names(e.SavePosture(f"{name}bow", "m-1"))


def test_what_is_gone_is_said_without_names_that_nobody_gave():
    gone = apply(BEGIN, e.Delete("b1"))
    for edit in (e.Delete("b1"), e.Trim("b1", 2, 7), e.Mirror("b1"), e.Decide("b1", "b2", "locked")):
        with pytest.raises(MotionMindError, match=r"^this stretch is no longer in the piece$"):
            apply(gone, edit)


def test_a_saved_posture_that_is_used_stays_as_it_was():
    used = apply(BEGIN, e.Insert("n", "~own/rest", 0, 0))
    assert used.block("n") == e.Block("n", "m-0", 0, 0, mirrored=True)
    assert apply(used, e.SavePosture("rest", "m-1")).block("n").source == "m-0"
    assert apply(used, e.SavePosture("rest", None)).block("n").source == "m-0"
    with pytest.raises(MotionMindError, match="no posture is saved as reach"):
        apply(BEGIN, e.Insert("n", "own/reach", 0, 0))


def test_a_question_is_told_apart_by_all_that_its_answer_depends_on():
    seam = apply_all([e.Trim("b2", 4, 8), e.Mirror("b2")], BEGIN).seam("b1", "b2")
    versions = {"ballet": "v1", "karate": "v1"}
    asked = question_of(seam.ends, e.Ask(), "ballet", versions)
    one, other = seam.ends
    others = [
        question_of((one, other), e.Ask(), "karate", versions),
        question_of((one, other), e.Ask(), "ballet", {"ballet": "v2"}),
        question_of((one, other), e.Ask(2.0), "ballet", versions),
        question_of((one, other), e.Ask(pins=(e.Pin("left_wrist"),)), "ballet", versions),
        question_of((one, other), e.Ask(passing=(e.Passing("karate/kata", 3),)), "ballet", versions),
        question_of((one, other), e.Ask(reaches=(e.Reach("left_wrist", (0.0, 1.0, 0.0), 1.0),)), "ballet", versions),
        *(
            question_of((one, other), e.Ask(travel=e.Travel(points, facing)), "ballet", versions)
            for points, facing in ((((1.0, 2.0),), None), (((1.0, 2.0),), 0.0), (((1.0, 2.0), (1.0, 2.0)), None))
        ),
        question_of((other, one), e.Ask(), "ballet", versions),
        *(
            question_of((msgspec.structs.replace(one, **change), other), e.Ask(), "ballet", versions)
            for change in ({"key": "m-1"}, {"frame": 3}, {"moves": False})
        ),
    ]
    assert len({asked, *others}) == 1 + len(others)
    assert question_of(seam.ends, e.Ask(), "ballet", versions | {"karate": "v2"}) == asked
    # Projects keep their answers under these hashes.
    ends = End("ballet/arabesque", 0, moves=False), End("ballet/fifth", 0, moves=False)
    assert question_of(ends, e.Ask(), "ballet", {"ballet": "v1"}) == "2ca5cf5388b399177bad07d4735b25c8"
    wishes = e.Ask(2.0, (e.Passing("ballet/plie"),), (e.Pin("left_wrist", "place", 0.25, 1.0),))
    assert question_of(ends, wishes, "ballet", {"ballet": "v1"}) == "f2144278ae2e5603bac6c3f7f4f6f09d"
    kata = e.Ask(passing=(e.Passing("karate/kata", 3),))
    assert question_of(seam.ends, kata, "ballet", versions) != question_of(
        seam.ends, kata, "ballet", versions | {"karate": "v2"}
    )


@pytest.mark.parametrize(
    "text",
    [
        '{"edit": "insert", "id": "b 1", "source": "ballet/adagio", "first": 0, "last": 1}',
        '{"edit": "insert", "id": "b1", "source": "", "first": 0, "last": 1}',
        '{"edit": "insert", "id": "b1", "source": "x", "first": -1, "last": 1}',
        '{"edit": "trim", "block": "b1", "first": 0, "last": 1e9}',
        '{"edit": "ask", "left": "b1", "right": "b2", "seconds": 0}',
        '{"edit": "ask", "left": "b1", "right": "b2", "seconds": NaN}',
        '{"edit": "choose", "left": "b1", "right": "b2", "alternative": 0}',
        '{"edit": "several", "edits": []}',
        '{"edit": "several", "edits": [{"edit": "several", "edits": []}]}',
        '{"edit": "erase"}',
        '{"edit": "mirror", "block": "b1", "path": "/etc/passwd"}',
    ],
)
def test_no_edit_is_read_from_what_is_none(text):
    with pytest.raises(msgspec.DecodeError):
        msgspec.json.decode(text, type=e.Edit)


def test_words_say_what_an_edit_does():
    assert words_of(e.Several((e.Mirror("b1"), e.Decide("b1", "b2", "locked")))) == "lock an insertion"
    assert words_of(e.Several((e.Mirror("b1"),), "turn everything round")) == "turn everything round"
    assert words_of(e.SavePosture("rest", None)) == "delete the posture rest"
    for kind in e.Single.__args__:
        assert kind in _DESCRIPTIONS or kind in (
            *(e.Decide, e.Arrange, e.Annotate, e.SaveVersion, e.GoBack, e.SavePosture),
            *CastEdit.__args__,
        )


def test_a_word_on_a_seam_goes_with_its_ends_into_another_order() -> None:
    """As a variation makes it: the same junction comes of new stretches."""
    state = apply_all(
        [
            e.Insert("b1", "ballet/adagio", 0, 5),
            e.Insert("b2", "karate/kata", 3, 9),
            e.Insert("b3", "ballet/adagio", 7, 9),
            e.Decide("b1", "b2", "discarded"),
            e.Choose("b2", "b3", 3),
            e.Decide("b2", "b3", "locked"),
        ]
    )
    new = e.Block("n1", "ballet/adagio", 2, 5), e.Block("n2", "karate/kata", 3, 9), e.Block("n3", "ballet/adagio", 7, 8)
    after = apply(state, e.Arrange((*new, state.block("b3")), {}))
    assert [seam.verdict for seam in after.seams] == [Verdict(decision="discarded"), Verdict(chosen=3), Verdict()]
    assert apply(state, e.Arrange(state.blocks, {})).seams == state.seams


# --- notes ------------------------------------------------------------------------------------------------------------


@given(st.lists(singles, max_size=12))
def test_a_note_is_in_the_piece_unless_that_was_empty_meanwhile(history):
    state = apply(BEGIN, e.Annotate(e.Note("n3", "note", "x", "b1", 4)))
    for edit in history:
        after = fits(state, edit)
        state = after if after is not None and after.blocks else state
    assert state.notes["n3"].block in {block.id for block in state.blocks}


def shown_by(state: State, note: e.Note) -> tuple[str, bool, int] | None:
    """The movement and frame that a note is about; None if its block shows that no longer."""
    block = state.block(note.block)
    return (block.source, block.mirrored, note.frame) if block.first <= note.frame <= block.last else None


@given(st.integers(0, 3), st.integers(2, 8), st.integers(3, 8))
def test_a_note_goes_with_its_frame_when_its_stretch_is_split_moved_or_varied(place, frame, at):
    note = e.Note("n1", "note", "softer", IDS[place], frame, 0.2)
    state = apply(BEGIN, e.Annotate(note))
    about = shown_by(state, note)
    for edit in (e.Split(IDS[place], at, "b7"), e.Move(IDS[place]), e.Trim(IDS[place], 4, 5)):
        after = apply(state, edit)
        kept = after.notes["n1"]
        assert (kept.text, kept.after, kept.frame) == ("softer", 0.2, frame)
        if not isinstance(edit, e.Trim):
            assert shown_by(after, kept) == about
    assert apply(apply(state, e.Trim(IDS[place], 4, 5)), e.Trim(IDS[place], 2, 8)) == state  # it comes back
    pieces = tuple(
        e.Block(f"b{5 + i}", "ballet/adagio", first, last) for i, (first, last) in enumerate([(6, 8), (2, 5)])
    )
    varied = apply(state, e.Arrange(pieces))
    assert shown_by(varied, varied.notes["n1"]) == about
    alike = tuple(e.Block(f"c{i}", "ballet/adagio", 2, 8) for i in range(4))
    assert apply(state, e.Arrange(alike)).notes["n1"].block == f"c{place}"  # the nearest of several


@given(st.integers(0, 3), st.permutations(IDS[:4]))
def test_a_note_of_a_deleted_stretch_stays_at_its_place(place, order):
    others = tuple(e.Block(name, f"ballet/{name}", 2, 8) for name in IDS[:4])  # no two show the same
    state = State(blocks=others, used=frozenset(IDS[:4]))
    state = apply(state, e.Annotate(e.Note("n1", "section", "waltz", IDS[place], 5)))
    rest = list(IDS[:4])
    for name in order:
        rest.remove(name)
        after = apply(state, e.Delete(name))
        before, now = state.notes["n1"], after.notes["n1"]
        if name != before.block:
            assert now == before
        elif rest:
            later = [one for one in rest if IDS.index(one) > IDS.index(name)]
            assert now.block == (later[0] if later else rest[-1])
            assert now.frame == (2 if later else 8)
        state = after
    assert state.notes["n1"].text == "waltz"


@pytest.mark.parametrize(
    ("note", "words"),
    [
        (e.Note("n1", "note", "x", "b9", 2), "no longer in the piece"),
        (e.Note("n1", "note", "x", "b0", 9), "frames 2 to 8, not 9"),
        (e.Note("n1", "note", " ", "b0", 2), "a note needs a text"),
        (e.Note("n1", "section", "", "b0", 2), "a section needs a text"),
    ],
)
def test_a_note_is_refused_in_words(note, words):
    with pytest.raises(MotionMindError, match=words):
        apply(BEGIN, e.Annotate(note))
    assert apply(BEGIN, e.Annotate(e.Note("n1", "marker", "", "b0", 2))).notes["n1"].kind == "marker"
    with pytest.raises(MotionMindError, match="no longer there"):
        apply(BEGIN, e.Erase("n1"))
