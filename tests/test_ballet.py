"""The ballet corpus: what is committed is what `compose.py` makes, and a body could do it."""

from __future__ import annotations

import importlib.util
import json
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from motionmind import rotations as rot
from motionmind.formats import read_motion, read_posture
from motionmind.motion import Motion
from motionmind.skeleton import human23

FOLDER = Path(__file__).parent.parent / "corpora" / "ballet"
BODY = human23()
CLIPS = {entry["name"]: entry for entry in json.loads((FOLDER / "manifest.json").read_text("utf-8"))["clips"]}

# Degrees about x, y and z of the left side (the right is mirrored), the turn about the first letter taken out first
# and the other two as a rotation vector. After American Academy of Orthopaedic Surgeons, "Joint Motion" (1965), with
# the hips and ankles of dancers: turnout and plantar flexion go further than most people's.
LIMITS = {
    # Flexion is -x, turnout y, abduction z; a bent hip turns out further than a straight one, as in passe.
    "hip": ("y", (-125, 45), (-30, 78), (-20, 90)),
    "knee": ("x", (-1, 145), (-1, 1), (-1, 1)),
    "ankle": ("x", (-45, 80), (-30, 30), (-25, 25)),  # dorsiflexion under weight, in the deepest plie
    "toes": ("x", (-80, 40), (-1, 1), (-1, 1)),
    "lumbar": ("y", (-30, 45), (-15, 15), (-25, 25)),
    "thorax": ("y", (-30, 40), (-35, 35), (-25, 25)),
    "cervical": ("y", (-30, 30), (-40, 40), (-25, 25)),
    "atlantal": ("y", (-30, 30), (-45, 45), (-20, 20)),
    "clavicle": ("x", (-5, 5), (-20, 20), (-5, 35)),
    "shoulder": ("x", (-95, 75), (-125, 45), (-90, 90)),  # turning out is -x, forward -y, up z
    "elbow": ("x", (-85, 85), (-150, 1), (-1, 1)),
    "wrist": ("x", (-1, 1), (-25, 20), (-75, 70)),
    "fingers": ("x", (-1, 1), (-10, 10), (-90, 20)),
}


@pytest.fixture(scope="module")
def score() -> ModuleType:
    """`compose.py` as a module."""
    spec = importlib.util.spec_from_file_location("ballet_compose", FOLDER / "compose.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module", params=sorted(CLIPS))
def clip(request: pytest.FixtureRequest) -> Motion:
    return read_motion(FOLDER / CLIPS[request.param]["file"])


def angles(joint: str, turned: np.ndarray) -> np.ndarray:
    """Degrees [..., 3] of local rotations about x, y and z as in LIMITS."""
    axis = "xyz".index(LIMITS[joint][0])
    twist = np.angle(np.exp(2j * np.arctan2(turned[..., axis], turned[..., 3])))
    vector = rot.log(rot.mul_inv(turned, rot.from_axis_angle(np.eye(3)[axis], twist)))
    vector[..., axis] = twist
    return np.degrees(vector)


def test_files_are_what_the_script_makes(score: ModuleType, tmp_path: Path) -> None:
    score.compose(tmp_path)
    made = {path.relative_to(tmp_path): path.read_bytes() for path in tmp_path.rglob("*.json")}
    kept = {path.relative_to(FOLDER): path.read_bytes() for path in FOLDER.rglob("*.json")}
    assert made.keys() == kept.keys()
    assert [path for path in made if made[path] != kept[path]] == []


def test_size() -> None:
    lengths = {name: len(read_motion(FOLDER / entry["file"])) for name, entry in CLIPS.items()}
    assert lengths["jump"] == 7
    assert len(lengths) >= 6
    assert sum(lengths.values()) >= 240


def test_times_and_moves(clip: Motion) -> None:
    steps = np.diff(clip.times)
    assert steps.min() >= 0.1
    assert steps.max() <= 1.0
    assert np.degrees(rot.angle(clip.rotations[1:], clip.rotations[:-1])).max() < 60.0


def test_anatomical_limits(clip: Motion) -> None:
    for index, name in enumerate(BODY.names[1:], start=1):
        side, _, joint = name.rpartition("_")
        turned = clip.rotations[:, index]
        found = angles(joint, rot.mirror(turned) if side == "right" else turned)
        low, high = np.transpose(LIMITS[joint][1:])
        wrong = np.argwhere((found < low) | (found > high))
        assert len(wrong) == 0, f"{clip.name}: {name} in posture {wrong[0][0]}: {found[wrong[0][0]].round()}"


def test_feet(score: ModuleType, clip: Motion) -> None:
    """The lowest point is on the floor or as high as a jump says; standing feet are on it and stay where they are."""
    rows = score.CLIPS[clip.name][1]
    points = BODY.positions_and_tips(clip.rotations, clip.root)
    np.testing.assert_allclose(points[..., 1].min(axis=1), [row.up or 0.0 for row in rows], atol=1e-4)
    for foot, side in enumerate(("left", "right")):
        toes = BODY.index(f"{side}_toes")
        on_floor = [row.up is None and bool(score.LEGS[row.legs[foot]].floor) for row in rows]
        stands = np.array([row.up is None and score.LEGS[row.legs[foot]].floor == "stands" for row in rows])
        lowest = np.minimum(points[:, toes, 1], points[:, len(BODY) + toes, 1])
        assert lowest[on_floor].max(initial=0.0) < 0.01
        slip = np.linalg.norm(np.diff(points[:, len(BODY) + toes][:, [0, 2]], axis=0), axis=1)
        assert slip[stands[1:] & stands[:-1]].max(initial=0.0) < 0.01


def test_postures_are_named_and_met(score: ModuleType) -> None:
    names = {path.stem for path in (FOLDER / "postures").glob("*.json")}
    assert {"arabesque", "attitude", "fifth", "first", "passe", "plie", "second"} <= names
    met = np.concatenate([read_motion(FOLDER / entry["file"]).rotations for entry in CLIPS.values()])
    for name in names:
        posture = read_posture(FOLDER / "postures" / f"{name}.json")
        apart = rot.angle(met, posture.rotations).min(axis=0)
        assert apart.max() < 1e-6, f"{name}: {BODY.names[apart.argmax()]} is in no clip"


def test_sides_are_mirror_images(score: ModuleType) -> None:
    rows = score.CLIPS["adagio"][1]
    swap = [BODY.index(_opposite(name)) for name in BODY.names]
    here, there = (score.motion("", side).rotations for side in (rows, score.other_side(rows)))
    assert rot.angle(rot.mirror(here[:, swap]), there).max() < 1e-6


def _opposite(name: str) -> str:
    side, _, joint = name.partition("_")
    return {"left": f"right_{joint}", "right": f"left_{joint}"}.get(side, name)
