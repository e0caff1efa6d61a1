"""What measures MotionMind: that runs are the same again, go on where they were left, and say what they found."""

from __future__ import annotations

import csv
import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import kimodo_files
import numpy as np
import pytest

ROOT = Path(__file__).parents[1]

pytestmark = [pytest.mark.long, pytest.mark.usefixtures("_importable")]


@pytest.fixture
def _importable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT))


class Here(Executor):
    """Does what it is given at once, in this process; after so many jobs it breaks down."""

    def __init__(self, jobs: int = 1000) -> None:
        self.left, self.done = jobs, 0

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        if self.done == self.left:
            future.set_exception(RuntimeError("broken off"))
        else:
            self.done += 1
            future.set_result(fn(*args, **kwargs))
        return future


def test_every_folder_is_listed_with_its_question_and_command() -> None:
    listed = subprocess.run(
        [sys.executable, "-m", "experiments"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout
    folders = [path.name for path in (ROOT / "experiments").iterdir() if path.is_dir() and path.name != "__pycache__"]
    for folder in folders:
        readme = (ROOT / "experiments" / folder / "README.md").read_text()
        assert f"{folder:16}{readme.splitlines()[0].lstrip('# ')}" in listed
        commands = (
            f"python -m experiments {folder}\n",
            f"python -m experiments.{folder}.",
            f"python experiments/{folder}/",
        )
        assert any(command in listed for command in commands)


@pytest.mark.parametrize("name", ["cliche", "turing"])
def test_a_run_writes_its_table_plot_and_section_and_is_the_same_again(name: str, tmp_path: Path) -> None:
    from experiments.harness import Setting, answer

    rows = answer(name, Setting(quick=True, data=None), Here(), tmp_path / "once")
    with (tmp_path / "once" / "found.csv").open() as file:
        read = list(csv.DictReader(file))
    assert [list(row.values()) for row in read] == [[str(value) for value in row.values()] for row in rows]
    assert ElementTree.parse(tmp_path / "once" / "found.svg").getroot().tag.endswith("svg")
    answer(name, Setting(quick=True, data=None), Here(), tmp_path / "again")
    for file in ("found.csv", "found.svg", "README.md"):
        assert (tmp_path / "once" / file).read_bytes() == (tmp_path / "again" / file).read_bytes()
    assert not list(tmp_path.glob("*/unfinished.jsonl"))


def test_a_run_that_was_broken_off_goes_on_where_it_was(tmp_path: Path) -> None:
    from experiments.harness import Setting, answer

    setting = Setting(quick=True, data=None)
    whole = Here()
    answer("turing", setting, whole, tmp_path / "whole")
    with pytest.raises(RuntimeError, match="broken off"):
        answer("turing", setting, Here(4), tmp_path / "broken")
    kept = (tmp_path / "broken" / "unfinished.jsonl").read_text()
    (tmp_path / "broken" / "unfinished.jsonl").write_text(kept[:-20])  # the last line was not written to its end
    rest = Here()
    answer("turing", setting, rest, tmp_path / "broken")
    assert rest.done == whole.done - len(kept.strip().splitlines()) + 1
    for file in ("found.csv", "found.svg", "README.md"):
        assert (tmp_path / "broken" / file).read_bytes() == (tmp_path / "whole" / file).read_bytes()


def test_what_people_wrote_around_what_was_found_stays(tmp_path: Path) -> None:
    from experiments.harness import BEGIN, END, Setting, answer

    (tmp_path / "README.md").write_text(f"# Mine\n\nBefore.\n\n{BEGIN}\nwhat was there\n{END}\n\nAfter.\n")
    answer("turing", Setting(quick=True, data=None), Here(), tmp_path)
    text = (tmp_path / "README.md").read_text()
    assert text.startswith(f"# Mine\n\nBefore.\n\n{BEGIN}\n")
    assert text.endswith(f"{END}\n\nAfter.\n")
    assert "what was there" not in text
    assert "Simulated raters" in text


def test_large_numbers_are_written_without_exponents() -> None:
    from experiments.charts import Panel, svg

    drawn = svg([Panel("growth", "postures", "MB", {"memory": [(784.0, 0.25), (80_379.0, 26_000.0)]}, log=True)])
    assert {">784<", ">80,379<", ">30,000<"} <= set(re.findall(r">[\d,.e+-]+<", drawn))


@pytest.mark.parametrize(
    "script", ["search/expansions.py", "search/heuristics.py", "wince/followed.py"], ids=lambda script: script
)
def test_scripts_run_quickly_on_what_is_bundled(script: str) -> None:
    done = subprocess.run(
        [sys.executable, f"experiments/{script}", "--quick"],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "| ballet" in done.stdout or "| 23 chains" in done.stdout


def test_a_name_that_is_no_question_is_refused() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "experiments", "weather"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert "no question 'weather'" in done.stderr


def test_tuning_does_not_write_where_results_are_reported() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "experiments", "inbetween", "--tuning"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert "--tuning needs --out" in done.stderr


# --- what bodies cannot do, and what is awkward -----------------------------------------------------------------------


def standing(**turns: tuple[str, float]) -> tuple[Any, Any, Any]:
    """A body that stands, ten times, with some joints turned about an axis by degrees; its rotations and root."""
    from motionmind import human23
    from motionmind.geometry import rotations as rot

    body = human23()
    rotations = np.tile(rot.IDENTITY, (10, len(body), 1))
    for joint, (axis, degrees) in turns.items():
        rotations[:, body.index(joint)] = rot.from_axis_angle(np.eye(3)["xyz".index(axis)], np.radians(degrees))
    ground = -body.positions_and_tips(rotations[0], np.zeros(3))[:, 1].min()
    return body, rotations, np.tile([0.0, ground, 0.0], (10, 1))


def test_parts_that_reach_into_each_other_collide() -> None:
    from experiments.net.run import collides

    for turns, expected in (
        ({}, (False, False)),
        ({"left_hip": ("z", -12.0), "right_hip": ("z", 12.0)}, (True, False)),  # legs crossed into each other
        ({"left_shoulder": ("z", -95.0)}, (False, True)),  # an arm through the hip
        ({"left_shoulder": ("z", -60.0), "left_knee": ("x", 60.0)}, (False, False)),
    ):
        assert tuple(found.any() for found in collides(*standing(**turns))) == expected, turns


def test_a_body_that_leans_is_off_balance() -> None:
    from experiments.net.run import off_balance

    assert off_balance(*standing()) == 0.0
    leaning = [off_balance(*standing(left_ankle=("x", -a), right_ankle=("x", -a), pelvis=("x", a))) for a in (20, 40)]
    assert 5.0 < leaning[0] < leaning[1]


def test_a_move_is_awkward_that_is_faster_and_rougher_than_the_corpus() -> None:
    from dataclasses import replace

    from experiments.panel.run import awkward, material, usual
    from motionmind.metrics.figures import at_rate

    engine, _ = material(None, "adagio alone")
    own = usual(engine)
    assert 0.0 < own.awkward < 50.0
    clip = engine.corpus.motion(engine.corpus.clips[0])
    moves = clip.times
    counts = [
        awkward(at_rate(replace(clip, times=moves / pace)), moves / pace, own.speed, own.jerk).sum()
        for pace in (0.5, 1.0, 2.0, 4.0)
    ]
    assert counts[0] == 0
    assert counts == sorted(counts)
    assert counts[-1] > 30


# --- the Turing test --------------------------------------------------------------------------------------------------


def test_ratings_are_weighed_as_textbooks_do() -> None:
    from scipy import stats

    from experiments.turing.analyse import judged

    rng = np.random.default_rng(0)
    made = np.arange(20) % 2 == 1
    ratings = rng.integers(1, 6, size=(12, 20)).astype(float)
    ratings[:, ~made] += 0.5
    found = judged(ratings, made)
    paired = stats.ttest_rel(ratings[:, ~made].mean(axis=1), ratings[:, made].mean(axis=1))
    assert found.f1 == pytest.approx(paired.statistic**2)
    films = stats.f_oneway(ratings[:, ~made].mean(axis=0), ratings[:, made].mean(axis=0))
    assert found.f2 == pytest.approx(films.statistic)
    assert found.min_f == pytest.approx(1.0 / (1.0 / found.f1 + 1.0 / found.f2))
    assert found.p > max(paired.pvalue, films.pvalue)
    assert found.difference - found.half == pytest.approx(paired.confidence_interval(0.95).low)
    assert judged(ratings + 1.0, made).p == pytest.approx(found.p)
    assert judged(ratings, ~made).difference == pytest.approx(-found.difference)


def test_simulated_raters_who_see_no_difference_are_seldom_told_to() -> None:
    from experiments.turing.run import work

    (none,) = work(raters=10, difference=0.0, tests=300, seed=1)
    (much,) = work(raters=40, difference=1.0, tests=50, seed=1)
    assert none["told"] <= 0.08
    assert much["told"] > 0.9
    assert much["seen"] == pytest.approx(1.0, abs=0.25)


def test_the_box_holds_films_that_say_nothing_and_answers_that_can_be_read(tmp_path: Path) -> None:
    from experiments.turing.analyse import read
    from experiments.turing.box import SCALES, fill

    fill(tmp_path, None, "karate", 2, 0)
    key = json.loads((tmp_path / "key.json").read_text())
    assert sorted(one["kind"] for one in key.values()) == ["danced", "made"]
    page = (tmp_path / "index.html").read_text()
    for film in key:
        assert (tmp_path / f"{film}.gif").stat().st_size > 1000
        assert film in page
    assert not any(word in page for word in ('danced"', 'made"', "karate", "http"))
    answers = []
    for rater in "ab":
        answers.append(tmp_path / f"answers-{rater}.json")
        given = {film: dict.fromkeys(SCALES, 3) for film in key}
        answers[-1].write_text(json.dumps({"rater": rater, "order": list(key), "answers": given}))
    ratings, made = read(tmp_path / "key.json", answers)
    assert list(ratings) == list(SCALES)
    assert made.sum() == 1
    with pytest.raises(SystemExit, match="two raters"):
        read(tmp_path / "key.json", answers[:1] * 2)


# --- in-betweening ----------------------------------------------------------------------------------------------------


def test_takes_of_a_phrase_are_held_out_together(shared_data: Path) -> None:
    from experiments.material import families

    data = str(shared_data)
    assert ("05_18", "05_19", "05_20") in families(data, "cmu-05")
    assert ("135_02", "135_03") in families(data, "cmu-135")
    assert ("16_08", "16_57") in families(data, "cmu-16")
    assert all(len(family) == 1 for family in families(data, "indian"))
    assert sum(map(len, families(data, "cmu-16"))) == 58


def test_no_family_is_learned_from_that_is_held_out(shared_data: Path) -> None:
    from experiments.harness import Setting
    from experiments.inbetween.run import DANCERS, TUNED_ON, jobs, keep_apart, lesson_of
    from experiments.material import families

    for name, data in (("karate", None), ("cmu-05", str(shared_data))):
        takes = max(families(data, name), key=len)
        lesson = lesson_of(data, (name,), takes)
        keep_apart(lesson.engine.corpus, takes)
        assert not {piece.name.split(".")[0] for piece in lesson.pieces} & set(takes)
        others = {take for family in families(data, name) for take in family} - set(takes)
        assert {clip.name.split(".")[0] for clip in lesson.engine.corpus.clips} == others
        with pytest.raises(ValueError, match="held out"):
            keep_apart(lesson.engine.corpus, [min(others)])
    for job in jobs(Setting(quick=False, data=shared_data)):
        assert job["teachers"] in ([job["name"]], [name for name in DANCERS if name != job["name"]])
    tuning = jobs(Setting(quick=False, data=shared_data, tuning=True))
    assert {job["name"] for job in tuning} == set(TUNED_ON) < set(DANCERS)


def test_a_held_out_take_is_found_however_it_was_learned() -> None:
    from dataclasses import replace

    from experiments.inbetween.run import keep_apart
    from experiments.material import corpus
    from motionmind.corpus.gather import gather

    whole = corpus(None, "karate")
    held, *clips = (whole.recording(clip).slice(0, 40) for clip in whole.clips)
    part, copy = replace(held, name=f"{held.name}.2"), replace(held, name=f"{held.name} (2)")
    for more, options in (([held], {"mirror": True}), ([held], {"reverse": 1.0}), ([part], {}), ([copy], {})):
        with pytest.raises(ValueError, match=held.name):
            keep_apart(gather("rest", clips + more, rate=5, flips="keep", **options), [held.name])
    mixed = gather("mixed", clips, rate=5, mix=[(gather("other", [held], rate=5, mirror=True), 0.5)])
    with pytest.raises(ValueError, match=held.name):
        keep_apart(mixed, [held.name])
    keep_apart(gather("rest", clips, rate=5, mirror=True, reverse=1.0), [held.name])


def ends_of(whole: Any, start: int, frames: int) -> Any:
    from experiments.inbetween.rivals import Ends

    end = start + frames
    before, after = whole.slice(start - 3, start + 1), whole.slice(end, end + 4)
    return Ends(whole.posture(start), whole.posture(end), frames, before, after)


def test_every_way_leads_from_a_to_b_exactly() -> None:
    from experiments.inbetween.genmm import Examples, between
    from experiments.inbetween.rivals import Segments, at_rest, hermite, slerp
    from experiments.material import movement
    from motionmind.geometry import rotations as rot

    one, two = (pieces[0] for pieces in list(movement(None, "karate", 60).values())[:2])
    ends = ends_of(one, 100, 36)
    segments, examples = Segments([two], 36), Examples.of([two])
    for made in (
        slerp(ends),
        at_rest(ends),
        hermite(ends),
        segments.nearest(ends, 1),
        segments.nearest(ends, 8),
        between(ends, examples.patches),
    ):
        rotations, root = made
        assert len(rotations) == len(root) == 37
        for frame, posture in ((0, ends.a), (-1, ends.b)):
            assert rot.angle(rotations[frame], posture.rotations).max() < 1e-7
            assert root[frame] == pytest.approx(posture.root)


def test_cubics_leave_and_arrive_as_the_body_moved() -> None:
    from dataclasses import replace

    from experiments.inbetween.rivals import hermite
    from experiments.material import movement
    from motionmind.geometry import rotations as rot

    whole = next(iter(movement(None, "karate", 60).values()))[0]
    ends = ends_of(whole, 79, 524)  # so long that a frame is as good as nothing; the body moves at both ends
    for known in (ends, replace(ends, after=None)):
        rotations, root = hermite(known)
        turn = rot.log(rot.inv_mul(whole.rotations[78], whole.rotations[79]))
        assert rot.log(rot.inv_mul(rotations[0], rotations[1])) == pytest.approx(turn, abs=0.02 * np.abs(turn).max())
        step = whole.root[79] - whole.root[78]
        assert root[1] - root[0] == pytest.approx(step, abs=0.02 * np.abs(step).max())
    rotations, root = hermite(ends)
    turn = rot.log(rot.inv_mul(whole.rotations[603], whole.rotations[604]))
    assert rot.log(rot.inv_mul(rotations[-2], rotations[-1])) == pytest.approx(turn, abs=0.02 * np.abs(turn).max())


def test_the_nearest_segment_is_the_window_itself_wherever_it_faces() -> None:
    from dataclasses import replace

    from experiments.inbetween.rivals import Segments
    from experiments.material import movement
    from motionmind.geometry import rotations as rot

    whole = next(iter(movement(None, "karate", 60).values()))[0]
    ends = ends_of(whole, 100, 36)
    turn = rot.about_vertical(1.0)
    elsewhere = whole.rotations.copy()
    elsewhere[:, 0] = rot.mul(turn, elsewhere[:, 0])
    turned = replace(whole, rotations=elsewhere, root=1.0 + rot.mul_vec(turn, whole.root))
    rotations, root = Segments([turned], 36).nearest(ends, 1)
    assert rot.angle(rotations, whole.rotations[100:137]).max() < 1e-6
    assert root == pytest.approx(whole.root[100:137], abs=1e-6)


def test_generative_motion_matching_keeps_what_is_made_of_the_examples() -> None:
    from experiments.inbetween.genmm import Examples, described, freely, restored, solve_motion
    from experiments.material import movement
    from motionmind.geometry import rotations as rot

    whole = next(iter(movement(None, "karate", 60).values()))[0].slice(0, 150)
    frames = described(whole.rotations, whole.root)
    rotations, root = restored(frames, whole.rotations[0, 0], whole.root[0])
    assert rot.angle(rotations, whole.rotations).max() < 1e-6
    assert root == pytest.approx(whole.root, abs=1e-9)
    examples = Examples.of([whole])
    again = solve_motion(frames, examples.patches, [1.0], lambda made: made)
    assert again == pytest.approx(frames, abs=1e-5)
    free, _ = freely(examples, 90, seed=1)
    nearest = [rot.angle(one, whole.rotations).mean(axis=-1).min() for one in free[:, None]]
    assert np.median(nearest) < np.radians(15.0)  # it is made of the examples, blended
    assert not np.array_equal(free, freely(examples, 90, seed=2)[0])


def test_gains_are_of_sums_and_their_interval_is_over_families() -> None:
    from experiments.inbetween.tables import MEANS, together

    def row(family: str, windows: int, l2q: float) -> dict[str, Any]:
        return {
            "family": family,
            "windows": windows,
            "npss": 1.0,
            "power": 1.0,
            "slerp": 2.0,
            **dict.fromkeys(MEANS, 0.5),
            "l2q": l2q,
        }

    rows = [row("a", 10, 1.0), row("b", 30, 1.5), row("b", 10, 1.5), row("c", 50, 1.8)]
    found = together(rows)
    assert found["gain"] == pytest.approx(1.0 - (10.0 + 60.0 + 90.0) / 200.0)
    assert found["families"] == 3
    assert 0.09 < found["least"] < found["gain"] < found["most"] < 0.51
    same = together([row("a", 10, 1.5), row("b", 30, 1.5)])
    assert same["least"] == pytest.approx(same["most"]) == pytest.approx(0.25)


def test_windows_that_do_not_overlap_are_counted() -> None:
    from experiments.inbetween.run import disjoint

    starts = range(0, 30, 6)
    assert disjoint([(0, start) for start in starts], 18) == 2
    assert disjoint([(piece, start) for start in starts for piece in (0, 1)], 12) == 6
    assert disjoint([(0, 0), (0, 150)], 18) == 2


def test_in_betweening_is_measured_on_what_is_bundled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from experiments.harness import Setting, answer
    from experiments.inbetween import run

    whole = run.families
    monkeypatch.setattr(run, "families", lambda data, name: whole(data, name)[:2])  # for less to learn
    rows = answer("inbetween", Setting(quick=True, data=None), Here(), tmp_path)
    kinds = {row["kind"] for row in rows if row["given"] == run.GIVEN[0]}
    assert {"danced", "slerp", "nearest segment", "mean of eight", "GenMM", "motionmind"} <= kinds
    for row in rows:
        if row["kind"] == "danced":
            assert row["l2q"] == row["npss"] == row["l2p"] == 0.0
        if row["kind"] == "slerp":
            assert row["l2q"] == pytest.approx(row["slerp"])
    assert "The worst: heian" in (tmp_path / "README.md").read_text()


# --- beside Kimodo ---------------------------------------------------------------------------------------------------


def test_ways_through_key_frames_meet_them_in_bundled_movement(tmp_path: Path) -> None:
    from experiments.harness import Setting, answer
    from experiments.kimodo.run import CALM, CUBIC, GAPS, KIMODO, VIAS

    rows = answer("kimodo", Setting(quick=True, data=None), Here(), tmp_path)
    assert {(row["given"], row["kind"]) for row in rows} == {
        (given, kind) for given in ("asked", "1 s", "2 s") for kind in (KIMODO, CUBIC, GAPS, CALM, VIAS)
    }
    for row in rows:
        assert row["keys"] == (2 if row["given"] == "1 s" else 1)
        if row["kind"] != VIAS:  # which fix neither place nor time
            assert row["worst_mm"] == row["worst_degrees"] == 0.0
        if row["kind"] == KIMODO:
            assert row["off"] == 0.0
        else:
            assert row["off"] > 10.0
    assert "| Kimodo | 0 | 0 | 0 | 0 |" in (tmp_path / "README.md").read_text()


@pytest.mark.filterwarnings("ignore:.*the floor")  # so little movement does not show it
def test_key_frames_that_were_asked_are_read_beside_the_movement(tmp_path: Path) -> None:
    from experiments.kimodo import material
    from motionmind.formats._kimodo import from_kimodo
    from motionmind.geometry import rotations as rot

    arrays = kimodo_files.movement(30, frames=46)
    body, local, root = from_kimodo(arrays, "a.npz")
    folder = tmp_path / "kimodo" / "one"
    folder.mkdir(parents=True)
    np.savez(folder / "motion.npz", **arrays | {"foot_contacts": np.ones((46, 4), dtype=bool)})
    turns = {frame: rot.log(local[frame]).tolist() for frame in (5, 10, 31)}
    asked = [
        {"type": "root2d", "frame_indices": [3], "smooth_root_2d": [[0.0, 0.0]]},
        *(
            {"type": kind, "frame_indices": frames}
            | {"local_joints_rot": [turns[frame] for frame in frames]}
            | {"root_positions": (root[frames] + [0.0, 0.0, 0.1]).tolist()}
            for kind, frames in (("fullbody", [10, 31]), ("left-hand", [5]))
        ),
    ]
    (folder / "constraints.json").write_text(json.dumps(asked))
    found = material.demo(str(tmp_path), "one")
    assert len(found.motion) == 46
    assert list(found.keys("asked")) == [0, 10, 31, 45]
    assert list(found.keys("1 s")) == [0, 30, 45]
    for frame in (10, 31):
        wanted = found.motion.posture(frame)
        assert rot.angle(found.asked[frame].rotations, wanted.rotations).max() < 1e-6
        np.testing.assert_allclose(found.asked[frame].root - wanted.root, [0.0, 0.0, 0.1], atol=1e-6)
    steps = np.diff(body.positions(local, root)[..., [0, 2]], axis=0)
    feet = [body.index(f"{side}{joint}") for side in ("Left", "Right") for joint in ("Foot", "ToeBase")]
    wanted_mm = 1000.0 * np.linalg.norm(steps[:, feet], axis=-1).mean()
    assert material.marked_slide(str(tmp_path), "one") == pytest.approx(wanted_mm)


def test_a_question_without_its_movement_is_skipped_in_one_line(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "experiments", "kimodo", "--data", str(tmp_path), "--out", str(tmp_path / "out")],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == "kimodo: skipped, its recorded movement is not there (--data)\n"
    assert not (tmp_path / "out").exists()


# --- the clock --------------------------------------------------------------------------------------------------------


def shown_signs(rng: np.random.Generator, person: str, count: int) -> list[dict[str, Any]]:
    """Signs of recordings of a person, of whom each has an own strength, at three speeds; some show nothing."""
    from experiments.clock.held_out import SIGNS

    rows = []
    strength = rng.uniform(0.7, 1.4)
    for number in range(count):
        shown = strength * rng.lognormal(sigma=0.2, size=len(SIGNS))
        shown[rng.uniform(size=len(SIGNS)) < 0.2] = np.nan
        for speed in (0.5, 1.0, 2.0):
            usual = [speed**2, 12.0 * speed**2, 0.4 * speed, speed**2, 1.2 * speed**2, speed**2, 0.9]
            signs = dict(zip(SIGNS, shown * usual, strict=True)) | {"leg": 0.9, "pull": speed**2}
            rows.append(
                {"group": person, "family": f"{person}{number // 2}", "recording": f"{person}{number}", "speed": speed}
                | {"of": "whole"}
                | signs
            )
    return rows


def test_bounds_chosen_by_rule_question_none_of_those_they_were_chosen_on() -> None:
    from experiments.clock.held_out import choose_bounds, questioned, signs_of
    from motionmind.body.tempo import question_signs

    rng = np.random.default_rng(0)
    people = [f"p{number}" for number in range(6)]
    rows = [row for person in people for row in shown_signs(rng, person, 10)]
    for margin in (0.0, 0.2):
        bounds = choose_bounds(rows, margin)
        assert not any(question_signs(signs_of(row), bounds) for row in rows if row["speed"] == 1.0)
    tight, wide = (
        [row["hit"] for row in questioned(rows, [(people[:3], people[3:])], margin) if row["speed"] == 1.0]
        for margin in (0.0, 0.2)
    )
    assert sum(tight) > sum(wide)
    assert all(narrow or not broad for narrow, broad in zip(tight, wide, strict=True))
    tried = questioned(rows, [(people[:3], people[3:]), (people[3:], people[:3])], 0.0)
    assert [row["group"] for row in tried] == [row["group"] for row in (*rows[90:], *rows[:90])]
    strange = [row | {"fall": 500.0} if row["group"] == "p5" else row for row in rows]
    assert choose_bounds(strange[:150], 0.0) == choose_bounds(rows[:150], 0.0)
    changed = [row["hit"] for row in questioned(strange, [(people[:5], people[5:])], 0.0) if row["speed"] == 1.0]
    assert all(changed)


def test_intervals_of_shares_are_over_families() -> None:
    from experiments.clock.held_out import share

    row = {"group": "a", "of": "whole", "speed": 1.0}
    rows = [row | {"family": f"f{number}", "hit": number < 5} for number in range(10)]
    assert share(rows, "whole", 1.0).startswith("50.0 (2")
    assert share([one for one in rows for _ in range(50)], "whole", 1.0) == share(rows, "whole", 1.0)
    assert share([one | {"hit": False} for one in rows], "whole", 1.0) == "0.0 (0.0 to 30.0)"
    assert share([one | {"hit": True} for one in rows], "whole", 1.0) == "100.0 (70.0 to 100.0)"


def test_the_clock_of_bundled_movement_is_tried(tmp_path: Path) -> None:
    from experiments.clock.run import SPEEDS
    from experiments.harness import Setting, answer

    rows = answer("clock", Setting(quick=True, data=None), Here(), tmp_path)
    assert {row["speed"] for row in rows} == {1.0, *SPEEDS}
    assert not any(row["questioned"] for row in rows if row["speed"] == 1.0)
    assert "Bounds chosen by rule" not in (tmp_path / "README.md").read_text()  # there is one person


# --- variety ----------------------------------------------------------------------------------------------------------


def test_what_is_cut_from_an_example_covers_it_and_has_no_variety() -> None:
    from experiments.material import movement
    from experiments.variety.measures import coverage, distances, global_diversity, local_diversity
    from motionmind.geometry import rotations as rot

    whole = next(iter(movement(None, "karate", 60).values()))[0].rotations[:160]
    same = distances(whole, whole)
    assert coverage(same, 0.01) == 1.0
    assert local_diversity(same) == pytest.approx(0.0, abs=1e-6)
    swapped = distances(np.concatenate([whole[100:], whole[:100]]), whole)
    assert global_diversity(swapped) == pytest.approx(0.0, abs=1e-6)
    assert local_diversity(swapped) > 0.001  # the windows across the cut
    assert coverage(distances(whole[:80], whole), 0.01) == pytest.approx(50 / 130, abs=0.02)
    turned = whole.copy()
    turned[:, 0] = rot.mul(rot.about_vertical(1.0), turned[:, 0])
    assert distances(turned, whole).diagonal().max() < 1e-6
    far = distances(np.tile(rot.IDENTITY, (60, 23, 1)), whole)
    assert far.min() > 2.0
    assert coverage(far) == 0.0


def test_the_best_patches_of_an_example_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    from experiments.variety import measures

    monkeypatch.setattr(measures, "WINDOW", 2)
    off = np.random.default_rng(0).uniform(size=(6, 4))

    def cheapest(start: int) -> float:
        if start == len(off):
            return 0.0
        return min(
            (
                sum(off[start + k, at + k] for k in range(size)) + cheapest(start + size)
                for size in range(2, len(off) - start + 1)
                for at in range(off.shape[1] - size + 1)
            ),
            default=np.inf,
        )

    assert measures.global_diversity(off) == pytest.approx(cheapest(0) / len(off))


def test_variety_is_measured_on_what_is_bundled(tmp_path: Path) -> None:
    from experiments.harness import Setting, answer

    rows = answer("variety", Setting(quick=True, data=None), Here(), tmp_path)
    assert [row["kind"] for row in rows] == ["vary", "GenMM"]
    assert all(0.0 <= row["closely"] <= row["coverage"] <= 1.0 for row in rows)


def test_what_dancers_do_themselves_is_hardly_ever_beyond_them() -> None:
    """Their own windows exceed a limit of five about as often as limits say, and shaken or hurried ones always."""
    from dataclasses import replace

    from experiments.wince.dancers import MEASURES, dancers, see

    ballet = dancers(None, "ballet")
    rng = np.random.default_rng(0)
    long = [k for k, clip in enumerate(ballet.clips) if len(clip) > 60]
    beyond = []
    for k in rng.choice(long, size=100):
        start = int(rng.integers(len(ballet.clips[k]) - 45))
        piece = ballet.clips[k].slice(start, start + 45)
        worst = ballet.worst(see(piece))
        assert set(worst) == set(MEASURES)
        assert ballet.limits(45).own < 0.03
        beyond.append(max(worst.values()) > 1.0)
        shaken = replace(piece, root=piece.root + 0.1 * (np.arange(45) % 2)[:, None])
        assert ballet.worst(see(shaken))["root acceleration"] > 1.0
        hurried = replace(piece, rotations=piece.rotations[::-1][[0, -1] * 22 + [0]])
        still = np.allclose(piece.rotations[0], piece.rotations[-1], atol=0.2)
        assert still or ballet.worst(see(hurried))["joints"] > 1.0
    assert np.mean(beyond) <= 0.06


def test_pairs_on_one_leg_stand_on_one_spot() -> None:
    from experiments.wince.dancers import dancers, on_the_same_spot
    from motionmind.body.support import standing_rise

    ballet = dancers(None, "ballet")
    pairs = ballet.one_leg_pairs(20, seed=0)
    assert len(pairs) == 20
    for i, k in pairs:
        a, b = ballet.ends[i], ballet.ends[k]
        there = on_the_same_spot(a, b)
        ends = np.stack([a.rotations, there.rotations]), np.stack([a.root, there.root])
        assert np.isfinite(standing_rise(a.skeleton, *ends))  # the foot makes no step
        np.testing.assert_allclose(there.rotations[1:], b.rotations[1:])
        assert there.root[1] == pytest.approx(b.root[1])


def test_what_leads_into_the_air_ends_in_the_air() -> None:
    from experiments.wince.dancers import dancers, nearer
    from motionmind.body.contact import lowest_height

    ballet = dancers(None, "ballet")
    for i, k in ballet.jumps(10, seed=0):
        a, b = ballet.ends[i], ballet.ends[k]
        assert lowest_height(b.skeleton, b.rotations, b.root) > 0.1
        moved = nearer(a, b, 1.0)
        assert np.hypot(*(moved.root - a.root)[[0, 2]]) <= 1.0 + 1e-9
        assert moved.root[1] == b.root[1]


def test_joint_moves_within_tolerance_are_those_between_the_ends() -> None:
    from experiments.wince.followed import near
    from motionmind import Engine

    engine = Engine.load("ballet")
    tween = engine.tween(engine.posture("ballet/arabesque"), engine.posture("ballet/fifth"))
    tolerances = engine.space.tolerances
    count, within, within_three = near(tween, tolerances)
    off = [list(zip(row, tolerances, strict=True)) for row in tween.path_degrees[1:-1]]
    assert count == (tween.moves - 1) * len(tween.joints) == sum(map(len, off))
    assert within == sum(degrees <= tolerance + 0.1 for row in off for degrees, tolerance in row)
    assert within_three == sum(degrees <= 3.0 * tolerance + 0.1 for row in off for degrees, tolerance in row)
    assert 0 < within < within_three <= count


def test_shares_are_of_sums_and_their_interval_is_over_pairs() -> None:
    from experiments.wince.followed import share

    found, low, high = share(np.array([10, 45]), np.array([10, 90]))
    assert (found, low, high) == (0.55, 0.5, 1.0)
    assert share(np.array([3, 6]), np.array([4, 8])) == (0.75, 0.75, 0.75)
    rng = np.random.default_rng(1)
    drawn = np.array([share(rng.binomial(50, 0.8, 100), np.full(100, 50)) for _ in range(200)])
    assert 0.9 < np.mean((drawn[:, 1] <= 0.8) & (drawn[:, 2] >= 0.8)) <= 1.0


# --- synthesis --------------------------------------------------------------------------------------------------------


def test_files_are_compared_on_the_pairs_that_all_of_them_made() -> None:
    from experiments.synthesis.measure import pairs
    from experiments.synthesis.tables import report

    old = pairs("", "ballet", 3) | {"windows": [], "auc": {}}
    assert [row["kind"] for row in old["pairs"]] == ["far"] * 3 + ["one leg", "jump"]
    assert all(row["ms"] > 0.0 and row["low"] > 0.0 for row in old["pairs"])
    slow = [row | {"ms": row["ms"] + 1000.0} for row in old["pairs"][:-1]]
    text = report({"old": {"ballet": old}, "new": {"ballet": old | {"pairs": slow}}})
    table = {line.split(" | ")[0].strip("| "): line.strip("| ").split(" | ")[1:] for line in text.splitlines()[4:]}
    assert table["ms"][1].endswith(" !")
    assert [name for name, cells in table.items() if any(cell.endswith("!") for cell in cells)] == ["ms"]
    assert table["seconds"][0] == table["seconds"][1]


# --- transcription ----------------------------------------------------------------------------------------------------


def test_the_fewest_postures_follow_every_frame_and_as_many_even_ones_do_not(tmp_path: Path) -> None:
    from experiments.harness import Setting, answer

    rows = {row["method"]: row for row in answer("transcription", Setting(quick=True, data=None), Here(), tmp_path)}
    assert rows["fewest, joined"]["followed"] == 1.0
    assert rows["even, joined"]["followed"] < 0.95
    assert rows["transcribe"]["postures"] == rows["even, joined"]["postures"]
    for part in ("legs", "arms", "torso", "head"):
        assert rows["transcribe"][part] == pytest.approx(rows["fewest, joined"][part], abs=0.2)
        assert rows["transcribe"][part] >= rows["transcribe"][f"unwritten_{part}"] - 12.0


def test_a_kata_is_found_again_turned_mirrored_and_without_a_step() -> None:
    from experiments.kata.steps import aligned_supports, best_alignment, danced

    kata = danced(None, "karate/heian-shodan")
    assert [step.foot for step in kata.steps[:6]] == [0, 1, 1, 1, 0, 0]
    assert [int(sector) for sector in kata.sectors[6:9]] == [0, 0, 0]  # age-uke, ahead
    found = best_alignment(kata, kata.turned(3, mirrored=True))
    assert (found.cost, found.mirrored, found.sectors) == (0.0, True, 3)
    supports = aligned_supports(found)
    np.testing.assert_array_equal(*supports)
    assert set(supports[0].tolist()) == {1, 2, 3}
    shorter = best_alignment(kata, kata.in_order(np.delete(np.arange(len(kata.steps)), 7)))
    assert shorter.cost == 0.5
    assert [pair for pair in shorter.pairs if None in pair] == [(7, None)]


def test_the_recorded_kata_has_the_steps_of_the_composed_one(shared_data: Path) -> None:
    from experiments.kata.run import work

    rows = work(str(shared_data), "cmu-135/135_06", "karate/heian-shodan", None, 3)
    paired = [row for row in rows if row["direction"] != ""]
    assert len(paired) >= 20
    assert all(row["foot_one"] == row["foot_other"] for row in paired)
    assert sum(row["direction"] <= 45.0 and row["facing"] <= 45.0 for row in paired) >= 19


def test_steps_of_bundled_kata_are_compared_and_drawn(tmp_path: Path) -> None:
    from experiments.harness import Setting, answer

    rows = answer("kata", Setting(quick=True, data=None), Here(), tmp_path)
    assert rows[0]["agree"] > 0.9
    assert rows[0]["random"] < 12.0
    drawn = (tmp_path / "found.svg").read_text()
    assert drawn.count("<circle") == 22 + 21  # the tips of the arrows
    assert ElementTree.fromstring(drawn).tag.endswith("svg")


# --- A* ---------------------------------------------------------------------------------------------------------------


def test_searches_are_listened_to_and_kept_to_their_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "experiments" / "search"))
    import expansions

    from motionmind import Engine

    engine, (case, *_) = Engine.load("ballet"), expansions.FORGETFUL
    for one in expansions.posed(case, engine, 3, 0):
        best = one.solve(5_000)
        assert best.status == "optimal"
        assert expansions.effort(case._replace(sweeps=None), one, 5_000).ratio == 1.0
        with expansions.listening(500) as walks, expansions.bounded(case, one.problem) as problem:
            answer = one._replace(problem=problem).solve(5_000)
        assert answer.lower_bound <= best.cost + 1e-6
        assert sum(walk.found.expansions for walk in walks) == answer.expansions
        assert all(walk.straight == (len(answer.path) - 1) * answer.path.shape[1] for walk in walks)
        assert max(walk.found.peak_nodes for walk in walks) <= 500
        assert any(walk.found.forgotten for walk in walks) == (answer.peak_nodes == 500)
    assert expansions.astar.search.__module__ == "motionmind.search.astar"
    assert expansions.bounding.MAX_STATE_PAIRS > 0


# --- growth -----------------------------------------------------------------------------------------------------------


def test_performances_are_read_on_bodies_of_their_own_whoever_reads_them() -> None:
    from experiments.scale.run import Job, perform, performance
    from motionmind import Engine
    from motionmind.corpus.recordings import Recording

    corpus = Engine.load("ballet").corpus
    clip = corpus.recording(corpus.clips[0], 0, 40).resample(30.0)
    made = [performance(clip, Job(None, 0, number)) for number in range(3)]
    heights = [motion.skeleton.height for motion in made]
    assert max(heights) / min(heights) > 1.01
    assert len({motion.name for motion in made}) == 3
    (one, spent), (same, _) = perform(Job(None, 1, 2)), perform(Job(None, 1, 2))
    assert isinstance(one, Recording)
    np.testing.assert_array_equal(one.pieces[0].rotations, same.pieces[0].rotations)
    assert spent.bytes > 10_000.0
    assert spent.frames >= 6 * len(one.pieces[0].times) - 6
    assert min(spent.reading, spent.retargeting, spent.taking) > 0.0


# A process of its own, in which nothing else frees memory. It holds the array until the watching thread has seen it.
_HOLDING = """
import time
import numpy as np
from experiments.scale.memory import Memory, own_memory

before = own_memory()
with Memory() as memory:
    held = np.ones(8_000_000)
    until = time.monotonic() + 60.0
    while memory.most < before + 40.0 and time.monotonic() < until:
        time.sleep(0.01)
    del held
if own_memory() < before + 20.0 and memory.most > before + 40.0:
    print("the most is known after it is gone")
"""


def test_memory_is_watched_at_its_most() -> None:
    from experiments.scale.memory import own_memory

    if not own_memory():
        pytest.skip("this system does not say how much memory is a process's own")
    done = subprocess.run([sys.executable, "-c", _HOLDING], cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "the most is known after it is gone\n"), done.stderr
