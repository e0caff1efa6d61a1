"""The command that repairs recordings."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from bundled_clips import ballet_clip
from command_line import Run
from damages import noisy, raised, recording, sliding, spiked
from plain_bvh import PlainBvh, write_plain
from plain_gltf import PlainGltf
from program_rigs import disguise, rig_names, spread

from motionmind.body.motion import Motion
from motionmind.formats import read_motion, write_motion
from motionmind.geometry import rotations as rot


def damaged(degrees: float = 0.5) -> Motion:
    return raised(noisy(spiked(sliding(recording(30.0)), "left_knee", 80), degrees), 0.07)


def rigged(path: str = "clip.bvh") -> PlainBvh:
    """A damaged recording on another rig, with its own channels."""
    motion = disguise(damaged(), rig_names("Mixamo"), spread())
    return PlainBvh(write_plain(Path(path), motion, order=lambda joint: ("ZYX", "XYZ")[joint % 2], newline="\r\n"))


def test_a_cleaned_file_keeps_its_rig_and_reports_bounds(run: Run) -> None:
    source = rigged()
    ran = run("clean", "clip.bvh", "-o", "out.bvh", "--report", "report.json", "--picture", "changes.svg")
    assert ran.code == 0, ran.err
    found = PlainBvh("out.bvh")
    assert found.hierarchy == source.hierarchy
    assert found.channels == source.channels
    assert len(found.values) == len(source.values)
    report = json.loads(Path("report.json").read_text())
    before, after = read_motion("clip.bvh"), read_motion("out.bvh")
    far = 1000.0 * rot.norm(after.positions() - before.positions()).max(axis=0)
    turned = np.degrees(rot.angle(before.rotations, after.rotations)).max(axis=0)
    for joint, mm, degrees in zip(report["joints"], far, turned, strict=True):
        assert mm <= joint["mm"] + 1e-6
        assert degrees <= joint["degrees"] + 1e-6
    assert [step["step"] for step in report["steps"]] == ["gaps", "flips", "filter", "feet", "floor"]
    for line in ("filter ", "feet ", "floor     was", "result    no joint is off by more than", "written   out.bvh"):
        assert line in ran.out
    assert "<svg" in Path("changes.svg").read_text()


@pytest.mark.parametrize("step", ["gaps", "flips", "filter", "feet", "floor"])
def test_a_step_can_be_left_out(step: str, run: Run) -> None:
    rigged()
    ran = run("clean", "clip.bvh", "-o", "out.bvh", "--without", step, "--report", "-")
    assert ran.code == 0, ran.err
    assert step not in {one["step"] for one in ran.json["steps"]}
    assert len(ran.json["steps"]) == 4


def test_without_faults_it_says_so_and_changes_no_word(run: Run) -> None:
    write_motion("clip.bvh", recording(30.0))
    ran = run("clean", "clip.bvh", "-o", "out.bvh", "--without", "feet", "--without", "floor")
    assert "nothing to repair" in ran.out
    assert PlainBvh("out.bvh").text.splitlines()[-40:] == PlainBvh("clip.bvh").text.splitlines()[-40:]


@pytest.mark.parametrize("name", ["out.json", "out.glb", "out.npz", "out.vrma"])
def test_other_formats_are_written(name: str, run: Run) -> None:
    write_motion("clip.json", damaged())
    ran = run("clean", "clip.json", "-o", name)
    assert ran.code == 0, ran.err
    assert len(read_motion(name)) == len(damaged())


def test_a_glb_keeps_its_character(run: Run) -> None:
    write_motion("clip.glb", damaged())
    assert run("clean", "clip.glb", "-o", "out.glb").code == 0
    assert [node["name"] for node in PlainGltf("out.glb").nodes] == [
        node["name"] for node in PlainGltf("clip.glb").nodes
    ]


def test_a_corpus_fills_a_named_gap(run: Run) -> None:
    rigged()
    ran = run("clean", "clip.bvh", "-o", "out.bvh", "--fill", "50..80", "--corpus", "ballet", "--without", "feet")
    assert ran.code == 0, ran.err
    assert "1 filled from ballet" in ran.out


@pytest.mark.parametrize(
    ("arguments", "fault"),
    [
        (("clip.bvh", "-o", "clip.bvh"), "it is read from"),
        (("clip.bvh", "-o", "out.txt"), "the name must end in one of .json, .bvh"),
        (("clip.bvh", "-o", "out.bvh", "--picture", "p.pdf"), "must end in one of .svg, .png"),
        (("clip.bvh", "-o", "out.bvh", "--report", "out.bvh"), "it would be written twice"),
        (("clip.bvh", "-o", "out.bvh", "--fill", "50..80"), "only a corpus can fill them"),
        (("clip.bvh", "-o", "out.bvh", "--fill", "170..900"), "a gap lies between frames 1 and 178"),
        (("clip.bvh", "-o", "out.bvh", "--without", "knees"), "'knees' is not one of"),
        (("clip.bvh", "-o", "out.bvh", "--corpus", "nowhere"), "nowhere"),
        (("missing.bvh", "-o", "out.bvh"), "missing.bvh"),
        (("keys.json", "-o", "out.bvh"), "cleaning is for recordings"),
    ],
)
def test_what_cannot_be_done_is_one_line_and_no_file(arguments: tuple[str, ...], fault: str, run: Run) -> None:
    write_motion("clip.bvh", recording(30.0))
    write_motion("keys.json", ballet_clip("adagio"))
    ran = run("clean", *arguments)
    assert ran.code == 2
    assert fault in ran.err
    assert len([line for line in ran.err.splitlines() if line.startswith("error:")]) == 1
    assert {path.name for path in Path().iterdir()} <= {"clip.bvh", "keys.json", "home"}
