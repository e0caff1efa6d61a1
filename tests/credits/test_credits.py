"""Laws of credits: shares that add up, and that follow movement from the corpus to files, variations and pages."""

from __future__ import annotations

import json
import math
import re
import warnings
from collections import defaultdict
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from bundled_clips import ballet_clip
from command_line import Run
from hypothesis import given
from hypothesis import strategies as st

from motionmind.body.mirror import mirrored
from motionmind.body.motion import Insertion, Motion
from motionmind.body.plausibility import at_rate
from motionmind.corpus.corpus import Corpus
from motionmind.corpus.gather import gather
from motionmind.credits.credit import Credit, Origin, add_up
from motionmind.credits.ledger import ENGINE, GIVEN, UNSTATED, Ledger, ledger_of, lines_of
from motionmind.credits.licences import KNOWN, UNKNOWN, find_conflicts, find_licence
from motionmind.discretize.spec import make_discretization
from motionmind.errors import FormatError, MotionMindError, MotionMindWarning
from motionmind.formats import read_motion, write_motion
from motionmind.render.page import page
from motionmind.retarget.retarget import to_human23
from motionmind.tween.certificate import Source, credit_tween
from motionmind.tween.engine import Engine
from motionmind.tween.report import plain
from motionmind.tween.result import Tween, report_of
from motionmind.variation.variation import vary
from motionmind.variation.variation_json import read_variation, write_variation

names = st.text("abc", max_size=2)
credited = st.builds(
    Credit, st.just(0.0) | st.floats(0.01, 100.0), names, names, names, licence=st.sampled_from(["", "CC0-1.0"])
)


@cache
def ballet() -> Engine:
    return Engine.load("ballet")


def clip(name: str = "plies") -> Motion:
    corpus = ballet().corpus
    return corpus.motion(next(one for one in corpus.clips if one.name == name))


@cache
def tween() -> Tween:
    return ballet().tween(*map(ballet().posture, ("ballet/arabesque", "ballet/fifth")))


@cache
def alone() -> Engine:
    """An engine that knows one clip, by Ada."""
    return Engine.fit(
        [clip()],
        name="alone",
        rate=None,
        facing="stage",
        discretization=make_discretization("codebook", 15.0),
        performer="Ada",
        author="Grace",
        licence="CC-BY-4.0",
    )


def shares(found: tuple[Credit, ...]) -> dict[str, float]:
    return {f"{one.corpus}: {one.clip}": one.share for one in found}


# --- sums -------------------------------------------------------------------------------------------------------------


@pytest.mark.long
@given(st.lists(credited, max_size=8), st.randoms())
def test_shares_add_up_to_one_in_any_order(parts: list[Credit], random: object) -> None:
    found, whole = add_up(parts), math.fsum(one.share for one in parts)
    assert math.isclose(math.fsum(one.share for one in found), 1.0) if whole > 0.0 else found == ()
    assert len({replace(one, share=0.0) for one in found}) == len(found)
    for one in found:
        same = math.fsum(part.share for part in parts if replace(part, share=0.0) == replace(one, share=0.0))
        assert math.isclose(one.share * whole, same)
    random.shuffle(parts)  # type: ignore[attr-defined]
    again = add_up(parts)
    assert {replace(one, share=0.0) for one in again} == {replace(one, share=0.0) for one in found}


@given(st.lists(credited, min_size=1, max_size=8))
def test_all_sums_of_a_ledger_are_one(parts: list[Credit]) -> None:
    ledger = ledger_of(add_up(parts))
    for sums in (ledger.performers, ledger.corpora, ledger.licences):
        assert not ledger.clips or math.isclose(math.fsum(sums.values()), 1.0)


def test_shares_that_are_not_one_are_refused() -> None:
    with pytest.raises(MotionMindError, match="add up to 1, not to"):
        Insertion(np.array([0.0, 1.0]), credits=(Credit(0.5, "a"),))
    with pytest.raises(MotionMindError, match="from 0 to 1"):
        Insertion(np.array([0.0, 1.0]), credits=(Credit(1.5, "a"), Credit(-0.5, "b")))


# --- tweens -----------------------------------------------------------------------------------------------------------


def test_a_tween_wholly_from_one_clip_credits_that_clip_alone() -> None:
    motion = clip()
    found = alone().tween(motion.posture(0), motion.posture(6))
    assert found.attested == 1.0
    assert found.followed.all()
    assert found.credits == (Credit(1.0, "plies", "Ada", "alone", "", "Grace", "", "CC-BY-4.0"),)


@pytest.mark.long
@pytest.mark.parametrize("end", [1, 3, 12])
def test_nothing_else_is_credited_than_that_clip_and_the_engine(end: int) -> None:
    found = alone().tween(clip().posture(0), clip().posture(end))
    assert {(one.corpus, one.clip) for one in found.credits} <= {("alone", "plies"), ("", "")}
    assert math.isclose(math.fsum(one.share for one in found.credits), 1.0)


def test_shares_are_the_time_of_the_joints_moves() -> None:
    report = tween().report()
    seconds, spent = np.diff(report["times"]), defaultdict[str, float](float)
    for row, lasts in zip(report["sources"], seconds, strict=True):
        for source in row:
            spent[f"{source['corpus']}: {source['clip']}" if source else ": "] += lasts
    for source in report["detail"]:  # the passage counts as one more joint
        spent[f"{source['corpus']}: {source['clip']}"] += seconds.sum() / len(report["detail"])
    whole = seconds.sum() * (len(report["joints"]) + 1)
    found = shares(tween().credits)
    assert found == pytest.approx({name: lasts / whole for name, lasts in spent.items()})
    assert math.isclose(sum(found.values()), 1.0)


def test_fine_detail_counts_as_one_more_joint(cmu05: Engine) -> None:
    motions = [cmu05.corpus.recording(one) for one in cmu05.corpus.clips[:2]]
    found = cmu05.tween(motions[0].posture(0), motions[1].posture(30))
    report, spent = found.report(), defaultdict[str, float](float)
    seconds = np.diff(report["times"])
    for row, lasts in zip(report["sources"], seconds, strict=True):
        for source in filter(None, row):
            spent[f"{source['corpus']}: {source['clip']}"] += lasts
    for source in report["detail"]:
        spent[f"{source['corpus']}: {source['clip']}"] += seconds.sum() / len(report["detail"])
    assert report["detail"]
    whole = seconds.sum() * (len(report["joints"]) + 1)
    assert {name: share for name, share in shares(found.credits).items() if name != ": "} == pytest.approx(
        {name: lasts / whole for name, lasts in spent.items()}
    )


def test_joints_by_their_time_and_detail_by_its_parts() -> None:
    plies, tendus = (Source(name, posture=3, corpus="ballet") for name in ("plies", "tendus"))
    rows = [[plies, plies], [tendus, None]]  # two joints in moves of one second and of three
    found = credit_tween(ballet().corpus, rows, [plies, tendus, tendus, tendus], np.array([0.0, 1.0, 4.0]))
    seconds = {"ballet: plies": 2.0 + 1.0, "ballet: tendus": 3.0 + 3.0, ": ": 3.0}
    assert shares(found) == pytest.approx({name: lasts / 12.0 for name, lasts in seconds.items()})


def test_a_tween_that_stays_where_it_is_credits_nobody() -> None:
    posture = clip().posture(0)
    assert ballet().tween(posture, posture).credits == ()


def test_the_report_has_the_ledger() -> None:
    report = report_of(tween())
    assert report.credits == ledger_of(tween().credits)
    assert plain(report)["credits"]["licences"] == pytest.approx(ledger_of(tween().credits).licences)


# --- files ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".json", ".glb"])
def test_credits_travel_in_files(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"tween{suffix}"
    write_motion(path, tween().motion)
    found = read_motion(path).credits
    assert [replace(one, share=0.0) for one in found] == [replace(one, share=0.0) for one in tween().credits]
    assert shares(found) == pytest.approx(shares(tween().credits))


def test_credits_stay_when_movement_is_resampled_mirrored_and_cut() -> None:
    motion = tween().motion
    for other in (motion.resample(12.0), mirrored(motion), motion.slice(3, 20)):
        found = shares(other.credits)
        found.pop(": tween", None)
        whole = sum(found.values())
        assert {name: share / whole for name, share in found.items()} == pytest.approx(shares(tween().credits))


def test_movement_without_credits_is_read_as_the_engines(tmp_path: Path) -> None:
    path = tmp_path / "tween.json"
    write_motion(path, tween().motion)
    file = json.loads(path.read_text())
    del file["insertions"][0]["credits"]
    path.write_text(json.dumps(file))
    assert read_motion(path).credits == (Credit(1.0),)


def test_given_movement_credits_itself() -> None:
    given = replace(clip(), recorded=())
    assert given.credits == (Credit(1.0, "plies"),)
    assert ledger_of(given.credits).corpora == {GIVEN: 1.0}


# --- clips of corpora -------------------------------------------------------------------------------------------------


@cache
def mixed() -> Corpus:
    """Clips of two performers, of two corpora, with fine detail."""
    hers, other = (replace(at_rate(clip(name)), recorded=()) for name in ("plies", "tendus"))
    ada = gather("ada", [hers], rate=5.0, performer="Ada", title="Bends", licence="CC-BY-4.0", source="her studio")
    return gather("both", [other], rate=5.0, performer="Eve", author="Grace", mix=[(ada, 1.0)], mirror=True)


@pytest.mark.parametrize("number", range(4))
@pytest.mark.parametrize("suffix", [".json", ".glb"])
def test_the_credit_of_a_clip_is_the_same_when_written_and_read_again(suffix: str, number: int, tmp_path: Path) -> None:
    one = mixed().clips[number]
    path = tmp_path / f"clip{suffix}"
    write_motion(path, mixed().recording(one) if number % 2 else mixed().motion(one))
    assert read_motion(path).credits == (mixed().credit_of(one),)


@pytest.mark.parametrize(
    "change",
    [
        lambda motion: motion.resample(12.0),
        mirrored,
        lambda motion: motion.slice(3, 9),
        lambda motion: motion.slice(3, 4),
        lambda motion: replace(motion, name="another"),
        lambda motion: to_human23(motion, up="z"),
        at_rate,
    ],
)
def test_a_changed_clip_is_still_its_performers(change: Callable[[Motion], Motion]) -> None:
    one = mixed().clips[0]
    assert change(mixed().motion(one)).credits == (mixed().credit_of(one),)


def test_shares_of_what_was_recorded_add_up_to_one() -> None:
    with pytest.raises(MotionMindError, match="add up to 1, not to"):
        replace(clip(), recorded=(Credit(0.5, "a"),))


def test_a_variation_of_a_corpuss_clip_names_its_performer_corpus_and_licence(tmp_path: Path) -> None:
    one = next(one for one in mixed().clips if one.corpus)
    variation = vary(mixed().motion(one), nudge=2.0)
    write_variation(tmp_path / "variation.json", variation)
    again = read_variation(tmp_path / "variation.json")
    assert again.piece.motion.credits == (mixed().credit_of(one),)
    for name in ("variation.json", "movement.json", "movement.glb"):
        path = tmp_path / name
        if not path.exists():
            write_motion(path, again.motion())
        ledger = ledger_of(read_motion(path).credits)
        assert (ledger.performers, ledger.corpora, ledger.licences) == ({"Ada": 1.0}, {"ada": 1.0}, {"CC-BY-4.0": 1.0})


# --- variations -------------------------------------------------------------------------------------------------------


@pytest.mark.long
def test_a_variation_credits_the_piece_and_each_insertion_by_time(tmp_path: Path) -> None:
    variation = vary(clip("adagio"), ballet(), depart=0.3, length=30, alternatives=1)
    motion = variation.motion()
    assert motion.insertions
    spent = defaultdict[str, float](float)
    for one in motion.insertions:
        for name, share in shares(one.credits).items():
            spent[name] += share * float(one.times[-1] - one.times[0])
    lasts = float(motion.times[-1] - motion.times[0])
    spent["ballet: adagio"] += lasts - sum(spent.values())
    assert shares(motion.credits) == pytest.approx({name: share / lasts for name, share in spent.items() if share})
    report = variation.report()
    assert report["credits"]["corpora"] == pytest.approx(ledger_of(motion.credits).corpora)
    candidates = [one for seam in report["seams"] for one in seam["candidates"]]
    assert all(math.isclose(sum(one["share"] for one in candidate["credits"]), 1.0) for candidate in candidates)
    write_variation(tmp_path / "variation.json", variation)
    assert shares(read_variation(tmp_path / "variation.json").motion().credits) == pytest.approx(shares(motion.credits))


# --- corpora ----------------------------------------------------------------------------------------------------------


def test_mixed_corpora_know_where_their_clips_come_from(tmp_path: Path) -> None:
    ada = gather("ada", [clip()], rate=None, performer="Ada", title="Bends", licence="CC-BY-4.0", source="her studio")
    eve = gather("eve", [clip("tendus")], rate=None, performer={"tendus": "Eve"}, author="Grace", mix=[(ada, 1.0)])
    both = gather("both", [clip("degages")], rate=None, author="Hedy", mix=[(eve, 1.0)], facing="stage")
    assert both.origins == (Origin("eve", author="Grace"), Origin("ada", "Bends", "", "her studio", "CC-BY-4.0"))
    performers = {one.name: both.credit_of(one).performer for one in both.clips}
    assert performers == {"plies": "Ada", "tendus": "Eve", "degages": "Hedy"}
    Engine.learn(both, make_discretization("codebook", 20.0)).save(tmp_path / "both")
    again = Engine.load(str(tmp_path / "both")).corpus
    assert again.origins == both.origins
    assert [again.credit_of(one) for one in again.clips] == [both.credit_of(one) for one in both.clips]
    older = replace(both, origins=())
    assert {older.credit_of(one).corpus for one in older.clips} == {"ada", "eve", "both"}
    assert {older.credit_of(one).licence for one in older.clips} == {""}


def test_parts_of_a_cut_recording_keep_their_performer() -> None:
    motion = clip("tendus")
    rotations = motion.rotations.copy()
    rotations[10:, 5] = rotations[10:, 5][:, [3, 2, 1, 0]]  # a jump that nothing undoes
    broken = replace(motion, rotations=rotations)
    found = gather("broken", [broken], rate=None, performer={"tendus": "Eve"})
    assert {one.performer for one in found.clips} == {"Eve"}


def test_mixing_what_forbids_derivatives_says_so() -> None:
    fixed = gather("fixed", [clip()], rate=None, licence="CC BY-ND 4.0")
    with pytest.warns(MotionMindWarning, match="fixed forbids derivatives"):
        gather("mixed", [clip("tendus")], rate=None, mix=[(fixed, 1.0)])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        gather("own", [clip()], rate=None, licence="CC BY-ND 4.0")
        free = gather("free", [clip()], rate=None, licence="CC-BY-4.0")
        gather("mixed", [clip("tendus")], rate=None, mix=[(free, 1.0)], licence="CC0-1.0")


# --- licences ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("CC0-1.0", "CC0"),
        ("cc0", "CC0"),
        ("CC BY 4.0", "CC-BY"),
        ("CC-BY-3.0", "CC-BY"),
        ("CC-BY-SA-4.0", "CC-BY-SA"),
        ("cc by-nc 4.0 (LICENSE in the folder)", "CC-BY-NC"),
        ("CC_BY_NC_SA_4.0", "CC-BY-NC-SA"),
        ("CC-BY-ND-4.0", "CC-BY-ND"),
        ("CC-BY-NC-ND-4.0", "CC-BY-NC-ND"),
        ("MIT", "MIT"),
        ("MIT License", "MIT"),
        ("LicenseRef-research-only", "LicenseRef-research-only"),
        ("for research only", "LicenseRef-research-only"),
        ("CC-BY-4.0 OR MIT", ""),
        ("permitted", ""),
        ("free for all uses", ""),
        ("", ""),
    ],
)
def test_licences_are_known_by_their_usual_names(text: str, name: str) -> None:
    assert find_licence(text).name == name


# What Creative Commons' chart says cannot be combined, of licences that allow derivatives.
_APART = {
    frozenset({"CC-BY-SA", "CC-BY-NC"}),
    frozenset({"CC-BY-SA", "CC-BY-NC-SA"}),
    frozenset({"CC-BY-SA", "LicenseRef-research-only"}),
    frozenset({"CC-BY-NC-SA", "LicenseRef-research-only"}),
}


@pytest.mark.parametrize(("one", "other"), [*combinations(KNOWN, 2)])
def test_incompatible_licences_are_named_either_way_round(one: str, other: str) -> None:
    found, back = find_conflicts({"a": one, "b": other}), find_conflicts({"b": other, "a": one})
    forbidding = [name for name in (one, other) if name.endswith("ND")]
    assert sum("forbids derivatives" in sentence for sentence in found) == len(forbidding)
    assert any("cannot be combined" in sentence for sentence in found) == (frozenset({one, other}) in _APART)
    assert len(found) == len(back)


def test_what_is_not_known_is_nobodys_conflict() -> None:
    assert find_conflicts({"a": "CC-BY-SA-4.0", "b": "", "c": "mine"}) == []
    assert UNKNOWN.terms.startswith("not known")


def test_a_ledger_as_text_names_all_licences() -> None:
    parts = (
        Credit(0.5, "a", "Ada", "one", licence="CC-BY-SA-4.0"),
        Credit(0.3, "b", "", "two", licence="CC-BY-NC-4.0"),
    )
    text = "\n".join(lines_of(ledger_of((*parts, Credit(0.2)))))
    assert text.startswith("beware\n")
    for words in ("CC-BY-SA-4.0: name the authors", "CC-BY-NC-4.0", UNSTATED, ENGINE, "cannot be combined"):
        assert words in text
    assert [*lines_of(Ledger())] == []
    assert "\x1b" not in "\n".join(lines_of(ledger_of((Credit(1.0, "a\x1b[31m", "b\x1b", "c\x1b", licence="d\x1b"),))))


# --- the command line and the page ------------------------------------------------------------------------------------


@pytest.mark.long
def test_the_command_says_the_same_of_movement_and_of_its_report(run: Run, tmp_path: Path) -> None:
    write_motion(tmp_path / "tween.glb", tween().motion)
    (tmp_path / "report.json").write_text(json.dumps(tween().report()))
    movement, report = (run("credits", tmp_path / name).out for name in ("tween.glb", "report.json"))
    assert movement == report
    assert re.search(r"^   ?\d+%  ballet: plies, The MotionMind authors$", movement, re.MULTILINE)
    assert run("credits", tmp_path / "report.json", "--json").json["corpora"]["ballet"] > 0.5


def test_a_clip_of_a_corpus_is_the_corpus_s_in_any_file(run: Run, tmp_path: Path) -> None:
    said = run("credits", "ballet/adagio").out
    assert "100%  ballet: adagio, The MotionMind authors" in said
    assert "CC0-1.0" in said
    for name in ("adagio.json", "adagio.glb"):
        assert run("convert", "ballet/adagio", tmp_path / name).code == 0
        assert run("credits", tmp_path / name).out == said


def test_a_posture_of_a_corpus_is_the_corpus_s(run: Run, tmp_path: Path) -> None:
    assert "100%  ballet: arabesque, The MotionMind authors" in run("credits", "ballet/arabesque").out
    for name in ("ballet/arabesque", "ballet/adagio@3"):
        for words in (("convert", name, tmp_path / "a.json"), ("posture", name, "-o", tmp_path / "a.json")):
            assert run(*words).code == 0
            assert run("credits", tmp_path / "a.json").out == run("credits", name).out


def test_given_movement_keeps_its_name_under_another(run: Run, tmp_path: Path) -> None:
    write_motion(tmp_path / "walk.json", replace(ballet_clip("plies"), name="walk", recorded=()))
    assert run("convert", tmp_path / "walk.json", tmp_path / "other.glb").code == 0
    assert "100%  walk, which was given" in run("credits", tmp_path / "other.glb").out


def test_a_format_without_credits_is_told(run: Run, tmp_path: Path) -> None:
    write_motion(tmp_path / "walk.json", replace(ballet_clip("plies"), name="walk", recorded=()))
    assert run("convert", tmp_path / "walk.json", tmp_path / "walk.bvh").code == 0
    ran = run("credits", tmp_path / "walk.bvh")
    assert "walk.bvh: .bvh files hold no credits; for movement from the engine, give its .json" in ran.err
    assert "credits;" not in run("credits", tmp_path / "walk.json").err


def test_bad_input_is_one_line(run: Run, tmp_path: Path) -> None:
    (tmp_path / "old.json").write_text("{}")
    (tmp_path / "bad.json").write_text('{"credits": 3}')
    (tmp_path / "cut.json").write_text('{"credits": ')
    for name, words in (("old", "nor a report with credits"), ("bad", "credits"), ("cut", "neither"), ("no", "no")):
        ran = run("credits", tmp_path / f"{name}.json")
        assert ran.code == 2
        assert words in ran.err
        assert ran.err.count("\n") == 1


@pytest.mark.long
def test_exports_of_what_forbids_derivatives_say_so(run: Run, tmp_path: Path) -> None:
    for number, name in enumerate(("plies", "tendus")):
        write_motion(tmp_path / f"clip{number}.json", clip(name))
    files = [tmp_path / f"clip{number}.json" for number in range(2)]
    built = run("corpus", "build", "fixed", *files, "--licence", "CC-BY-NC-ND-4.0", "--performer", "Ada")
    assert built.code == 0, built.err
    ran = run("tween", f"{files[0]}@0", f"{files[0]}@6", "--corpus", "fixed", "-o", tmp_path / "out.json")
    assert ran.code == 0, ran.err
    assert "fixed forbids derivatives (CC-BY-NC-ND-4.0)" in ran.err
    again = run("convert", tmp_path / "out.json", tmp_path / "out.glb")
    assert "fixed forbids derivatives" in again.err
    assert "Ada" in run("credits", tmp_path / "out.glb").out
    mixed = run("corpus", "build", "mixed", "--mix", "fixed", "--mix", "ballet")
    assert "fixed forbids derivatives" in mixed.err
    info = run("corpus", "info", "mixed").out
    assert "CC-BY-NC-ND-4.0" in info
    assert "performers Ada, The MotionMind authors" in info


def test_the_page_shows_the_credits() -> None:
    html = page(tween().motion)
    data = json.loads(re.search(r'id="data">(.*?)</script>', html, re.DOTALL)[1])  # type: ignore[index]
    assert list(data["credits"]) == ["performers", "licences", "corpora", "clips"]
    assert any("ballet: plies" in line for line in data["credits"]["clips"])
    assert '"credits":{}' in page(replace(clip(), recorded=()))
    assert "ballet: plies, The MotionMind authors" in page(clip())


def test_a_damaged_ledger_is_a_format_error(tmp_path: Path) -> None:
    from motionmind.credits.ledger import read_ledger

    (tmp_path / "bad.json").write_text('{"credits": {"clips": 1}}')
    with pytest.raises(FormatError):
        read_ledger(tmp_path / "bad.json")
