"""Seams judged and smoothed: what a worker answers, and what the studio makes of it in the background."""

import re
import time
from itertools import pairwise

import numpy as np
import pytest

from motionmind.geometry import rotations as rot
from motionmind.geometry.polylines import offsets_to
from motionmind.studio import worker_loop
from motionmind.studio.alternatives import MAX_ALTERNATIVES
from motionmind.studio.asks import Ask, Passing, Pin, Reach, Travel
from motionmind.studio.neighbours import End
from motionmind.studio.seams import Question, judge, smooth
from motionmind.studio.sides import options_of, sides_of
from motionmind.tween.engine import Engine
from motionmind.variation.piece import Piece
from motionmind.variation.seams import judge_transitions


def say_nothing(done, of, words="", partial=None):
    assert 0 <= done <= of


@pytest.fixture(scope="module")
def engine() -> Engine:
    return worker_loop.engine_of("ballet")


@pytest.fixture(scope="module")
def clips(engine):
    return {f"ballet/{clip.name}": engine.corpus.motion(clip) for clip in engine.corpus.clips}


def question(clips, ends, ask=Ask()):  # noqa: B008 - it cannot change
    sides = sides_of(ends, clips.__getitem__, "stage")
    return Question("q", sides, options_of(ask, sides.a.skeleton, clips.__getitem__), ask != Ask())


def test_seams_are_abrupt_where_a_variation_says_so(engine, clips):
    """One definition of abrupt."""
    clip = clips["ballet/plies"]
    pairs = [(i, k) for i in range(0, 60, 7) for k in range(3, 66, 9) if k not in (i, i + 1)]
    judged = judge_transitions(Piece.of(clip, facing=engine.corpus.facing), pairs, engine, whole_body=False)
    asked = [question(clips, (End("ballet/plies", i, True), End("ballet/plies", k, True))) for i, k in pairs]
    findings = judge(say_nothing, "ballet", asked)
    assert [found.abrupt for found in findings] == [one.is_abrupt for one in judged]
    assert {found.abrupt for found in findings} == {True, False}
    for found in findings:
        assert found.insertions == (None if found.abrupt else ())
        assert found.words.startswith(("seen in ballet",) if not found.abrupt else ("too fast: ", "not seen in"))


def test_insertions_lead_exactly_from_one_side_to_the_other(clips):
    ends = End("ballet/plies", 20, True), End("ballet/adagio-barre", 9, True)
    asked = question(clips, ends)
    found, failure = smooth(say_nothing, "ballet", asked)
    assert failure == ""
    assert 1 < len(found) <= MAX_ALTERNATIVES
    assert len({motion.rotations.tobytes() for motion, _ in found}) == len(found)
    for motion, words in found:
        assert np.array_equal(motion.rotations[[0, -1]], [asked.sides.a.rotations, asked.sides.b.rotations])
        assert words
    assert asked.sides.before is not None


def test_wishes_are_kept(engine, clips):
    ends = End("ballet/plies", 20, False), End("ballet/adagio-barre", 9, False)
    (motion, _), *_ = smooth(say_nothing, "ballet", question(clips, ends, Ask(3.0)))[0]
    assert motion.times[-1] == pytest.approx(3.0)
    passing = Passing("ballet/tendus", 12)
    (motion, _), *_ = smooth(say_nothing, "ballet", question(clips, ends, Ask(passing=(passing,))))[0]
    wanted = engine.corpus.to_chains(clips["ballet/tendus"].rotations[12:13])
    states = engine.space.assign(engine.corpus.to_chains(motion.rotations))
    way = rot.angle(engine.corpus.to_chains(motion.rotations), wanted)
    assert (states == engine.space.assign(wanted)).mean(axis=1).max() > 0.9, way.max(axis=1)


def test_places_are_reached_or_the_words_say_how_far_off_they_are(clips):
    ends = End("ballet/plies", 20, False), End("ballet/adagio-barre", 9, False)
    (plain, _), *_ = smooth(say_nothing, "ballet", question(clips, ends, Ask(2.0)))[0]
    wrist = plain.skeleton.index("right_wrist")
    place = plain.at([1.0]).positions()[0, wrist] + [0.0, 0.1, 0.0]
    near, far = (Reach("right_wrist", (float(place[0]), float(place[1]) + up, float(place[2])), 1.0) for up in (0, 9))
    (motion, words), *_ = smooth(say_nothing, "ballet", question(clips, ends, Ask(2.0, reaches=(near,))))[0]
    assert np.linalg.norm(motion.at([1.0]).positions()[0, wrist] - place) < 0.01
    assert re.search(r"reaches the place to 0\.\d cm", words)
    (motion, words), *_ = smooth(say_nothing, "ballet", question(clips, ends, Ask(2.0, reaches=(far,))))[0]
    off = np.linalg.norm(motion.at([1.0]).positions()[0, wrist] - far.place)
    assert f"right wrist is {100.0 * off:.1f} cm from its place at 1 s" in words
    assert "reaches" not in words
    late = Reach("right_wrist", near.place, 2.5)
    found, failure = smooth(say_nothing, "ballet", question(clips, ends, Ask(2.0, reaches=(late,))))
    assert found == []
    assert failure == "no movement found: reach right_wrist: 2.5 s is not between A and B: the movement lasts 2.00 s"


def test_a_drawn_path_is_followed_and_the_words_say_how_far_off_it_is(clips):
    ends = End("ballet/plies", 20, False), End("ballet/adagio-barre", 9, False)
    corner = Travel(((0.0, 1.0), (1.0, 1.0)), 60.0)
    found, failure = smooth(say_nothing, "ballet", question(clips, ends, Ask(travel=corner)))
    assert failure == ""
    for motion, words in found:
        off = 100.0 * max(_off(motion, np.array([[0.0, 0.0], *corner.points])))
        reported = re.search(r"travels 2\.0 m, up to (\d+) cm off the path", words)
        assert reported
        assert float(reported[1]) == pytest.approx(off, abs=1.0)
        assert motion.root[-1, [0, 2]] == pytest.approx([1.0, 1.0], abs=0.01)
        assert np.degrees(rot.heading(motion.rotations[-1, 0])) == pytest.approx(60.0, abs=0.1)
    far = Travel(((0.0, 4.0), (2.0, 4.0), (-2.0, 4.0), (0.0, 8.0)))
    (motion, words), *_ = smooth(say_nothing, "ballet", question(clips, ends, Ask(0.5, travel=far)))[0]
    assert re.search(r"travels \d+\.\d m to 0, 8 m, facing .* degrees; up to \d+ cm off the path", words)


def _off(motion, path):
    """The greatest distances of the body from a path [P, 2], and of the path from the body's own, metres."""
    own = motion.root[:, [0, 2]]
    return (np.linalg.norm(offsets_to(a, b), axis=1).max() for a, b in ((path, own), (own, _dense(path))))


def _dense(path):
    return np.concatenate([np.linspace(one, other, 200) for one, other in pairwise(path)])


def test_what_cannot_be_is_said_in_a_line(clips):
    ends = End("ballet/plies", 20, False), End("ballet/adagio-barre", 9, False)
    held = Ask(
        pins=tuple(Pin(f"{side}_{joint}", "throughout") for side in ("left", "right") for joint in ("wrist", "ankle"))
    )
    found, failure = smooth(say_nothing, "ballet", question(clips, ends, held))
    assert found == []
    assert failure == "no movement meets all wishes: drop a posture, a hand or a foot"


def test_a_corpus_of_another_body_is_said_in_a_line(clips):
    ends = End("ballet/plies", 20, True), End("ballet/adagio-barre", 9, True)
    (found,) = judge(say_nothing, "walk-hexapod", [question(clips, ends)])
    assert found.abrupt
    assert found.insertions == ()
    assert found.words == "walk-hexapod and the piece have different bodies: nothing can be inserted"


def wait_for(served, wanted, seconds=60.0):
    """The piece as it is when `wanted` of its seams' states is true."""
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        piece = served.project()["piece"]
        if wanted([seam["state"] for seam in piece["seams"]]):
            return piece
        time.sleep(0.05)
    raise AssertionError([seam["state"] for seam in piece["seams"]])


def test_seams_are_smoothed_in_the_background(studio_server):
    studio_server.insert("b1", "ballet/plies", 0, 20)
    studio_server.insert("b2", "ballet/adagio-barre", 9, 15)
    studio_server.insert("b3", "ballet/adagio-barre", 16, 20)
    piece = wait_for(studio_server, lambda states: states == ["inserted", "smooth"])
    seam = piece["seams"][0]
    assert len(seam["alternatives"]) > 1
    assert piece["parts"][1]["key"] == seam["alternatives"][0]["key"]
    choose = {"left": "b1", "right": "b2", "alternative": 2}
    chosen = studio_server.edit(edit="choose", **choose)["piece"]
    assert chosen["parts"][1]["key"] == seam["alternatives"][1]["key"]
    left_out = studio_server.edit(edit="decide", left="b1", right="b2", decision="discarded")["piece"]
    assert left_out["seams"][0]["state"] == "discarded"
    assert len(left_out["parts"]) == 3
    # Back to where it was: what was found once is a fact, and is there at once.
    studio_server.edit(edit="trim", block="b1", first=0, last=12)
    back = studio_server.edit(edit="trim", block="b1", first=0, last=20)["piece"]["seams"][0]
    assert back["state"] == "inserted"
    assert back["alternatives"] == seam["alternatives"]


@pytest.mark.long
def test_smoothing_is_stopped_and_goes_on(studio_server):
    for number, clip in enumerate(("plies", "adagio-barre", "tendus", "fondus", "plies-crossed", "frappes")):
        studio_server.insert(f"b{number}", f"ballet/{clip}", 5 + number, 9 + number)
    wait_for(studio_server, lambda states: "abrupt" in states)
    assert studio_server.send("DELETE", "/api/seams").status == 200
    stopped = wait_for(studio_server, lambda states: True)
    time.sleep(1.0)
    still = [seam["state"] for seam in studio_server.project()["piece"]["seams"]]
    assert still == [seam["state"] for seam in stopped["seams"]]
    assert "abrupt" in still
    studio_server.post("/api/seams", {})
    wait_for(studio_server, lambda states: not {"abrupt", "waiting"} & set(states), 240.0)


def test_the_newest_seam_is_smoothed_first(studio_server):
    for number, clip in enumerate(("plies", "adagio-barre", "tendus", "fondus")):
        studio_server.insert(f"b{number}", f"ballet/{clip}", 5 + number, 9 + number)
    assert studio_server.send("DELETE", "/api/seams").status == 200
    wait_for(studio_server, lambda states: True)
    studio_server.post("/api/seams", {})
    wait_for(studio_server, lambda states: "abrupt" in states)
    studio_server.insert("b9", "ballet/frappes", 5, 9)
    first = wait_for(studio_server, lambda states: "inserted" in states)
    second = wait_for(studio_server, lambda states: states.count("inserted") > 1)
    assert "inserted" in (first["seams"][3]["state"], second["seams"][3]["state"])
