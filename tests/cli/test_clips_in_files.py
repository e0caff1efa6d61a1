"""Commands that name clips of glTF files: 'hero.glb#Dance'."""

from __future__ import annotations

import json
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bundled_clips import ballet_clip
from command_line import Run
from gltf_files import with_clips
from plain_gltf import PlainGltf

from motionmind.body.motion import Motion
from motionmind.cli.files import clip_names
from motionmind.clip_names import read_names
from motionmind.corpus import store
from motionmind.formats import read_motion, write_motion
from motionmind.geometry import rotations as rot
from motionmind.tween.engine import Engine

DANCE = ballet_clip("adagio").resample(30.0)
# Clips of different lengths, and some of names that files, shells and sheets take badly.
CLIPS = {
    "Idle": (0, 40),
    "Hip Hop": (40, 90),
    "a/b": (90, 150),
    "a b": (150, 200),
    "": (200, 260),
    "Hip Hop ": (10, 60),
}
NAMES = ["Idle", "Hip Hop", "a/b", "a b", "5", "Hip Hop "]


def part(start: int, stop: int) -> Motion:
    cut = DANCE.slice(start, stop)
    return replace(cut, times=cut.times - cut.times[0], keyframed=False)


@pytest.fixture
def hero(run: Run) -> Path:
    """A character with several clips, in the folder of the command."""
    return with_clips(Path("hero.glb"), [(name, part(*frames)) for name, frames in CLIPS.items()]).write()


def close(found: Motion, wanted: Motion) -> None:
    assert len(found) == len(wanted)
    assert rot.angle(found.rotations, wanted.rotations).max() < 1e-3


def test_postures_lists_all_clips_as_commands_take_them(run: Run, hero: Path) -> None:
    listed = run("postures", hero, "--json").json
    assert [one["name"] for one in listed["clips"]] == [f"hero.glb#{name}" for name in NAMES]
    assert [one["postures"] for one in listed["clips"]] == [stop - start for start, stop in CLIPS.values()]
    for one in listed["clips"]:
        assert run("posture", f"{one['name']}@{one['postures'] - 1}", "-o", "p.json").code == 0
        assert run("posture", f"{one['name']}@{one['postures']}", "-o", "p.json").code == 2
    shown = run("postures", hero)
    assert (shown.code, shown.err) == (0, "")
    for name in (*NAMES, "Idle@39"):
        assert f"'hero.glb#{name}'" in shown.out
    close(read_motion("hero.glb#Hip Hop"), part(40, 90))


def test_sheet_draws_each_clip_or_the_named_one(run: Run, hero: Path) -> None:
    ran = run("sheet", hero, "-o", "sheets", "--postures", 2)
    assert (ran.code, ran.err) == (0, "")
    assert len(list(Path("sheets").iterdir())) == len(NAMES)
    assert run("sheet", "hero.glb#Hip Hop", "-o", "one.png", "--postures", 2).out.startswith(
        "one.png: 2 postures of 50"
    )
    assert run("sheet", hero, "--clip", "5", "-o", "two.png", "--postures", 2).out.startswith(
        "two.png: 2 postures of 60"
    )
    several = run("sheet", hero, "-o", "all.png")
    assert (several.code, len(several.err.splitlines())) == (2, 1)
    assert "holds 6 clips" in several.err
    assert not Path("all.png").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("convert", "hero.glb#Hop", "a.json"), "hero.glb: no clip 'Hop'; "),
        (("convert", "hero.glb#", "a.json"), "hero.glb: no clip ''; there are Idle, Hip Hop"),
        (("convert", "none.glb#Idle", "a.json"), "none.glb: cannot be read"),
        (("convert", "hero.bvh#Idle", "a.json"), "hero.bvh: cannot be read"),
        (("convert", "hero.glb#Idle@last", "a.json"), "hero.glb: no clip 'Idle@last'"),
        (("posture", "hero.glb#Idle", "-o", "a.json"), "say which, from hero.glb#Idle@0 to hero.glb#Idle@39"),
        (("render", "hero.glb#Idle", "--clip", "5", "-o", "a.png"), "already names a clip; leave out --clip"),
        (("sheet", "hero.glb", "--to", "39", "--from", "38", "-o", "hero.glb"), "must end in one of .png"),
        (("postures", "hero.glb#Idle"), "give hero.glb alone"),
    ],
)
def test_what_is_wrong_is_told_in_one_line(run: Run, hero: Path, words: tuple[str, ...], said: str) -> None:
    before = hero.read_bytes()
    ran = run(*words)
    assert (ran.code, ran.out, len(ran.err.splitlines())) == (2, "", 1)
    assert said in ran.err
    assert not Path("a.json").exists()
    assert hero.read_bytes() == before


def test_without_a_name_the_first_is_taken_with_a_note(run: Run, hero: Path) -> None:
    ran = run("convert", hero, "a.json")
    assert (ran.code, len(ran.err.splitlines())) == (0, 1)
    assert "note: hero.glb: the first animation that moves is read, not Hip Hop, a/b" in ran.err
    assert "as 'hero.glb#Hip Hop'" in ran.err
    close(read_motion("a.json"), part(0, 40))
    one = with_clips(Path("one.glb"), [("Idle", part(0, 40))]).write()
    assert run("convert", one, "b.json").err == ""
    close(read_motion("b.json"), part(0, 40))


def test_a_file_with_the_whole_name_has_priority(run: Run, hero: Path) -> None:
    write_motion("other.json", part(0, 20))
    Path("other.json").rename("hero.glb#Idle.json")
    assert run("convert", "hero.glb#Idle.json", "a.json").code == 0
    assert len(read_motion("a.json")) == 20


@pytest.mark.long
def test_a_corpus_takes_every_clip_with_its_name(run: Run, hero: Path) -> None:
    pose = with_clips(Path("posed.glb"), [("Walk", part(0, 60)), ("T", part(0, 2))])
    for sampler in pose.json["animations"][1]["samplers"]:
        for key in ("input", "output"):
            pose.json["accessors"][sampler[key]]["count"] = 1
    pose.write()
    write_motion("alone.bvh", part(0, 60))
    built = run("corpus", "build", "mine", hero, "posed.glb", "alone.bvh", "--mirror", "--performer", "Ada")
    assert built.code == 0
    assert "posed.glb#T: holds one posture, and no move to learn from; left out" in built.err
    assert "is read, not" not in built.err
    clips = Engine.load("mine").corpus.clips
    names = [*(f"hero#{name}" for name in NAMES), "posed#Walk", "alone"]
    assert [one.name for one in clips if not one.mirrored] == names
    assert [one.name for one in clips if one.mirrored] == names
    assert run("posture", "mine/hero#a/b@1", "-o", "p.json").code == 0
    assert run("tween", "mine/hero#Idle@0", "mine/hero#Idle@4", "-o", "t.json", "--report", "r.json").code == 0
    credited = json.loads(Path("r.json").read_text("utf-8"))["credits"]["clips"]
    assert "hero#Idle" in {one["clip"] for one in credited}
    assert {one["clip"] for one in credited if one["corpus"]} <= set(names)
    assert "hero#Idle" in run("credits", "t.json").out
    some = run("corpus", "build", "some", "hero.glb#Hip Hop", "hero.glb#5", "posed.glb#Walk")
    assert (some.code, some.err.count("left out")) == (0, 0)
    assert [one.name for one in Engine.load("some").corpus.clips] == ["hero#Hip Hop", "hero#5", "posed#Walk"]
    missing = run("corpus", "build", "none", "hero.glb#Hop")
    assert (missing.code, "hero.glb: no clip 'Hop'" in missing.err) == (2, True)


def test_clips_of_files_with_one_stem_are_told_apart() -> None:
    files = [Path("a/x.glb#Walk"), Path("a/x.glb#Run"), Path("b/x.glb#Run"), Path("a.b.glb#v1.2"), Path("y.bvh")]
    found = clip_names(files)
    assert list(found.values()) == ["x#Walk", "a/x#Run", "b/x#Run", "a.b#v1.2", "y"]


@pytest.mark.long
def test_a_tween_between_clips_is_written_on_their_rig(run: Run, hero: Path) -> None:
    """It begins and ends in the named clips, not in the first, and the rig keeps these clips."""
    ran = run(
        *("tween", "hero.glb#Hip Hop@5~", "hero.glb#a/b@20", "--corpus", "ballet", "--moves", "2..6"),
        *("-o", "out.glb", "--report", "r.json"),
    )
    assert (ran.code, "is read, not" in ran.err) == (0, False)
    made = read_motion("out.glb#tween")
    starts, stops = part(40, 90), part(90, 150)
    assert rot.angle(made.rotations[0, 1:], starts.rotations[5, 1:]).max() < 2e-3
    assert rot.angle(made.rotations[-1, 1:], stops.rotations[20, 1:]).max() < 2e-3
    animations = PlainGltf("out.glb").json["animations"]
    assert [one["name"] for one in animations] == ["tween", *CLIPS]
    close(read_motion("out.glb#a/b"), stops)
    assert not read_motion("out.glb#a/b").insertions
    assert {one["clip"] for one in run("credits", "out.glb", "--json").json["clips"]}
    assert run("credits", "hero.glb#a/b", "--json").json["clips"][0]["clip"] == "hero#a/b"


def test_movement_is_measured_drawn_and_varied_by_its_clips_name(run: Run, hero: Path) -> None:
    assert run("measure", "hero.glb#Hip Hop", "--corpus", "ballet").code == 0
    assert run("render", "hero.glb#Hip Hop", "-o", "a.html").out.startswith("a.html: 50 frames")
    assert run("render", "hero.glb#Hip Hop@3", "-o", "a.png").code == 0
    assert run("vary", "hero.glb#Hip Hop", "-o", "v.json").code == 0
    assert np.isfinite(read_motion("v.json").rotations).all()


def test_help_shows_quotes(run: Run) -> None:
    for words in (("postures",), ("sheet",), ("render",), ("convert",), ("posture",), ("tween",), ("corpus", "build")):
        assert "'hero.glb#Dance" in run(*words, "--help").out


def test_names_in_a_file_that_is_no_gltf_are_none(tmp_path: Path) -> None:
    for content in (b"", b"glTF", b"glTF" + bytes(30), b"[]", b'{"animations": 3}', b"\xff" * 50, b"[" * 100_000):
        (tmp_path / "a.glb").write_bytes(content)
        assert read_names(tmp_path / "a.glb") == ()
    assert read_names(tmp_path / "none.glb") == read_names(tmp_path) == ()


def test_a_manifest_names_clips(run: Run, hero: Path) -> None:
    """A corpus that people write is learned again after a change of the file."""
    folder = Path("written")
    folder.mkdir()
    hero.rename(folder / "hero.glb")
    manifest = {
        "format": store.FORMAT,
        "version": store.VERSIONS[store.FORMAT],
        **{"name": "written", "title": "Mine", "author": "us", "source": "here", "licence": "CC0-1.0"},
        **{"facing": "free", "rate": 5.0, "discretization": {"kind": "codebook", "tolerance": 15}},
        "clips": [{"name": "hop", "file": "hero.glb#Hip Hop", "about": "quick"}],
    }
    (folder / "manifest.json").write_text(json.dumps(manifest), "utf-8")
    assert Engine.load(folder).info()["postures"] == 9
    with_clips(folder / "hero.glb", [("Idle", part(0, 40)), ("Hip Hop", part(40, 130))]).write()
    assert Engine.load(folder).info()["postures"] == 15


@pytest.mark.parametrize(
    ("word", "lengths"), [("hero.glb", [40, 50, 60, 50, 60, 50]), ("hero.glb#Hip Hop", [50]), ("hero.glb#a/b", [60])]
)
def test_a_project_begins_with_all_clips_or_the_named_one(word: str, lengths: list[int], run: Run, hero: Path) -> None:
    pytest.importorskip("starlette")
    from motionmind.cli.studio import _project

    with closing(_project(Path(word), "ballet", None)) as project:
        assert project.path == Path("hero.motionmind")
        assert [one.last - one.first + 1 for one in project.state.blocks] == lengths


# --- bodies of one BVH file -------------------------------------------------------------------------------------------


@pytest.fixture
def duo(tmp_path: Path) -> Path:
    """A file with two dancers, each below a ROOT, and each in a file alone beside it."""
    return together(tmp_path / "duo.bvh", {"first": part(0, 60), "second": part(60, 120)})


def together(path: Path, motions: dict[str, Motion]) -> Path:
    """Write motions as the bodies of a BVH file, and each to a file of its own beside it."""
    texts = []
    for name, motion in motions.items():
        alone = path.with_name(f"{name}.bvh")
        write_motion(alone, motion)
        texts.append(alone.read_text().split("MOTION\n"))
    hierarchies = "".join(hierarchy.removeprefix("HIERARCHY\n") for hierarchy, _ in texts)
    rows = [frames.strip().split("\n") for _, frames in texts]
    values = [f"{one} {other}" for one, other in zip(*(row[2:] for row in rows), strict=True)]
    path.write_text("\n".join([f"HIERARCHY\n{hierarchies}MOTION", *rows[0][:2], *values, ""]))
    return path


def test_bodies_of_a_bvh_file_are_named_like_clips(tmp_path: Path, duo: Path, run: Run) -> None:
    ran = run("convert", "duo.bvh", "out.json")
    assert (ran.code, ran.err.count("\n")) == (2, 1)
    assert "it has 2 bodies, 'pelvis', 'pelvis (2)': choose one, as 'duo.bvh#pelvis'" in ran.err
    for name, alone in (("pelvis", "first"), ("pelvis (2)", "second"), ("2", "second")):
        assert run("convert", f"duo.bvh#{name}", "out.json").code == 0
        assert run("convert", f"{alone}.bvh", "alone.json").code == 0
        found, wanted = read_motion(tmp_path / "out.json"), read_motion(tmp_path / "alone.json")
        assert np.array_equal(found.rotations, wanted.rotations)
        assert np.array_equal(found.root, wanted.root)
    assert run("corpus", "build", "mine", "duo.bvh").code == 0
    manifest = Engine.load("mine", tmp_path / "home").corpus
    assert [clip.name for clip in manifest.clips] == ["duo#pelvis", "duo#pelvis (2)"]


def test_a_movement_of_one_of_two_bodies_is_written_on_its_own_rig(tmp_path: Path, duo: Path, run: Run) -> None:
    ends = "duo.bvh#pelvis (2)@3", "duo.bvh#pelvis (2)@20"
    assert run("tween", *ends, "--corpus", "ballet", "-o", "out.bvh", "--moves", "3").code == 0
    assert run("loop", "duo.bvh#2", "-o", "loop.bvh").code == 0
    hierarchy = (tmp_path / "second.bvh").read_text().split("MOTION")[0]
    for name in ("out.bvh", "loop.bvh"):
        assert (tmp_path / name).read_text().split("MOTION")[0] == hierarchy
    made, recorded = read_motion(tmp_path / "out.bvh"), read_motion("duo.bvh#2")
    assert np.allclose(rot.angle(made.rotations[0], recorded.rotations[3]), 0.0, atol=1e-4)
    assert np.allclose(rot.angle(made.rotations[-1], recorded.rotations[20]), 0.0, atol=1e-4)


def test_postures_lists_the_bodies_of_a_bvh_file(duo: Path, run: Run) -> None:
    listed = run("postures", "duo.bvh", "--json").json
    assert [one["name"] for one in listed["clips"]] == ["duo.bvh#pelvis", "duo.bvh#pelvis (2)"]
    assert [one["postures"] for one in listed["clips"]] == [60, 60]
    assert not listed["postures"]
    for one, alone in zip(listed["clips"], ("first", "second"), strict=True):
        assert f"  '{one['name']}'" in run("postures", "duo.bvh").out
        for word, name in ((one["name"], "a.json"), (f"{alone}.bvh", "b.json")):
            assert run("posture", f"{word}@59", "-o", name).code == 0
        assert np.array_equal(read_motion("a.json").rotations, read_motion("b.json").rotations)
    assert [one["name"] for one in run("postures", "first.bvh", "--json").json["clips"]] == ["first.bvh"]


def test_postures_of_single_frames_in_a_bvh_file_are_drawn_if_of_one_body(tmp_path: Path, run: Run) -> None:
    dancer, other = part(0, 1), part(60, 61)
    together(tmp_path / "one.bvh", {"first": dancer, "second": other})
    assert run("postures", "one.bvh", "--json").json["postures"] == ["one.bvh#pelvis", "one.bvh#pelvis (2)"]
    assert run("postures", "one.bvh", "-o", "one.png").code == 0
    insect = Engine.load("walk-hexapod").corpus
    together(tmp_path / "two.bvh", {"first": dancer, "second": insect.motion(insect.clips[0]).slice(0, 1)})
    ran = run("postures", "two.bvh", "-o", "two.png")
    assert (ran.code, ran.out) == (2, "")
    assert "two.bvh: its postures are of different bodies; `motionmind sheet` draws each" in ran.err
    assert not Path("two.png").exists()


# --- clips as rigs ----------------------------------------------------------------------------------------------------

RIGGED = (
    ("tween", "ballet/fifth", "ballet/arabesque", "--corpus", "ballet", "--moves", 3, "-o"),
    ("convert", "ballet/jump"),
    ("loop", "ballet/tendus", "-o"),
)


@pytest.mark.parametrize("words", RIGGED, ids=lambda words: words[0])
def test_a_rig_is_that_of_a_clip(words: tuple[object, ...], run: Run, hero: Path, duo: Path) -> None:
    character = PlainGltf(hero)
    for name in ("hero.glb#Hip Hop", "hero.glb#a/b", "hero.glb#2"):
        ran = run(*words, "out.glb", "--rig", name)
        assert ran.code == 0, ran.err
        assert "hero.glb" not in ran.err  # no note on the clip that is taken
        assert [node["name"] for node in PlainGltf("out.glb").nodes] == [node["name"] for node in character.nodes]
    for body, alone in (("pelvis", "first"), ("pelvis (2)", "second")):
        assert run(*words, "out.bvh", "--rig", f"duo.bvh#{body}").code == 0
        hierarchy = Path(f"{alone}.bvh").read_text().split("MOTION")[0]
        assert Path("out.bvh").read_text().split("MOTION")[0] == hierarchy


@pytest.mark.parametrize("words", RIGGED, ids=lambda words: words[0])
@pytest.mark.parametrize(
    ("out", "rig", "said"),
    [
        ("out.glb", "hero.glb#Hop", "hero.glb: no clip 'Hop'"),
        ("out.glb", "hero.glb#", "hero.glb: no clip ''"),
        ("out.glb", "nowhere.glb#Idle", "'nowhere.glb' does not exist"),
        ("out.glb", "folder.glb#Idle", "'folder.glb' is a directory"),
        ("hero.glb", "hero.glb#Idle", "hero.glb: cannot be written: it is read from"),
        ("out.bvh", "duo.bvh#Hips", "duo.bvh: no body 'Hips'"),
        ("out.bvh", "duo.bvh", "choose one, as 'duo.bvh#pelvis'"),
        ("out.json", "hero.glb#Idle", "--rig applies to .bvh and .glb files"),
    ],
)
def test_clips_that_are_no_rigs_are_refused_in_one_line(
    words: tuple[object, ...], out: str, rig: str, said: str, run: Run, hero: Path, duo: Path
) -> None:
    Path("folder.glb").mkdir()
    before = hero.read_bytes()
    ran = run(*words, out, "--rig", rig)
    assert (ran.code, ran.out, ran.err.count("error: ")) == (2, "", 1)
    assert said in ran.err.splitlines()[-1]
    assert hero.read_bytes() == before
    assert not Path(out).exists() or out == "hero.glb"


def test_a_rig_s_clip_of_the_output_s_kind_has_its_unit(run: Run, duo: Path) -> None:
    ran = run("convert", "ballet/jump", "out.bvh", "--rig", "duo.bvh#pelvis", "--out-unit", "m")
    assert (ran.code, ran.err) == (2, "error: --out-unit m: out.bvh gets the unit of duo.bvh#pelvis\n")
