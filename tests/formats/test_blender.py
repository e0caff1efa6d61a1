"""Blender opens what is written: every joint of every body is where it was, in each frame of the clip.

`pip install ".[blender]"` brings Blender as a module, bpy; BLENDER_PYTHON may name another Python that has it. It is a
whole program, so it runs in a process of its own, once for all files.
"""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bundled_clips import ballet_clip
from command_line import Run
from plain_bvh import write_plain
from program_rigs import disguise, rig_names, spread

from motionmind._typing import Floats
from motionmind.body.human import human23, human44
from motionmind.body.motion import Insertion, Motion
from motionmind.body.skeleton import Skeleton
from motionmind.formats import read_motion, write_motion
from motionmind.formats._smpl import smpl_bodies
from motionmind.geometry import rotations as rot
from motionmind.notation.compose import motions
from motionmind.notation.read import read_score

PYTHON = os.environ.get("BLENDER_PYTHON") or (importlib.util.find_spec("bpy") and sys.executable)
RATE = 24  # frames a second of the scene; BVH's frames are counted, and do not depend on it

BLENDER = """
import json, sys
import bpy

def places(armature, frames):
    matrix, found = armature.matrix_world, []
    for frame in frames:
        bpy.context.scene.frame_set(frame)
        bpy.context.view_layer.update()
        found.append({bone.name: list(matrix @ bone.head) for bone in armature.pose.bones})
    return found

found = {}
for file, frames in json.loads(sys.argv[1]):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = RATE
    if file.endswith(".bvh"):
        bpy.ops.import_anim.bvh(filepath=file, global_scale=0.01, axis_forward="-Z", axis_up="Y", frame_start=1)
    else:
        bpy.ops.import_scene.gltf(filepath=file)
    (armature,) = [thing for thing in bpy.data.objects if thing.type == "ARMATURE"]
    bones, matrix = armature.data.bones, armature.matrix_world
    found[file] = {
        "name": armature.name,
        "parents": {bone.name: bone.parent.name if bone.parent else "" for bone in bones},
        "rest": {bone.name: list(matrix @ bone.head_local) for bone in bones},
        "places": places(armature, frames),
        "skinned": [thing.name for thing in bpy.data.objects for one in thing.modifiers if one.type == "ARMATURE"],
    }
print("\\n" + json.dumps(found))
""".replace("RATE", str(RATE))

AT_DEFAULTS = """
import json, sys
import bpy

found = {}
for file, options, seconds in json.loads(sys.argv[1]):
    bpy.ops.wm.read_factory_settings()
    if file.endswith(".bvh"):
        bpy.ops.import_anim.bvh(filepath=file, **options)
    else:
        bpy.ops.import_scene.gltf(filepath=file)
    armature = bpy.context.object if bpy.context.object.type == "ARMATURE" else bpy.context.object.parent
    scene, matrix = bpy.context.scene, armature.matrix_world
    rate, begins = scene.render.fps / scene.render.fps_base, 1 if file.endswith(".bvh") else 0
    places = []
    for second in seconds:
        scene.frame_set(begins + int(second * rate), subframe=second * rate % 1.0)
        bpy.context.view_layer.update()
        places.append({bone.name: list(matrix @ bone.head) for bone in armature.pose.bones})
    end = (armature.animation_data.action.frame_range[1] - begins) / rate
    found[file] = {"places": places, "end": end}
print("\\n" + json.dumps(found))
"""


def wandering(skeleton: Skeleton, frames: int, seed: int = 0) -> Motion:
    """Random postures at random places."""
    rng = np.random.default_rng(seed)
    rotations = rot.normalise(rng.normal(size=(frames, len(skeleton), 4)))
    return Motion(skeleton, rotations, rng.normal(size=(frames, 3)), np.arange(frames) / RATE, name=skeleton.name)


def odd() -> Skeleton:
    """Names with blanks and dots; a joint in its parent's place; leaves without a far end; bones of a millimetre."""
    names = ("the root", "arm.L", "arm.R", "hand of.L", "hand of.R", "wing")
    offsets = np.array([[0, 0, 0], [0.1, 0, 0], [-0.1, 0, 0], [0.001, 0, 0], [0, 0, 0], [0, 0, 0]], dtype=float)
    return Skeleton("odd", names, (-1, 0, 0, 1, 2, 0), offsets)


def clips() -> dict[str, Motion]:
    """Movement of several bodies, 24 frames a second from 0 on."""
    insects = read_score(Path(__file__).parents[2] / "corpora" / "walk-hexapod" / "insect.score")
    found = {
        "human23": wandering(human23(), 12),
        "human44": wandering(human44(), 12),
        "SMPL+H": wandering(smpl_bodies()["SMPL+H"], 5),
        "odd": wandering(odd(), 12),
        "hexapod": motions(insects, insects.clips[:1])[0].resample(RATE),
        "posture": wandering(human23(), 1),
        "ballet": ballet_clip("adagio").resample(RATE),
    }
    recording = Path(__file__).parents[2].parent / "shared" / "data" / "cmu-05" / "05_02.bvh"
    if recording.exists():
        found["CMU"] = read_motion(recording).resample(RATE)
    return found


CLIPS = clips() if PYTHON else {}


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What Blender makes of each file, by the file's name."""
    folder = tmp_path_factory.mktemp("blender")
    jobs = []
    for name, motion in CLIPS.items():
        for suffix in ("bvh", "glb"):
            file = folder / f"{name}.{suffix}"
            write_motion(file, motion)
            start = 1 if suffix == "bvh" else 0  # Blender counts the frames of BVH from 1, glTF has seconds from 0
            jobs.append((str(file), [start + frame for frame in range(len(motion))]))
    ran = subprocess.run([str(PYTHON), "-c", BLENDER, json.dumps(jobs)], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    return {Path(file).name: shown for file, shown in json.loads(ran.stdout.splitlines()[-1]).items()}


def y_up(points: list[list[float]]) -> Floats:
    """From Blender's world, whose z is up."""
    return np.array(points) @ np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])


def in_blender(names: tuple[str, ...], suffix: str) -> list[str]:
    """What Blender calls joints: its importer of BVH joins words."""
    return [name.replace(" ", "_") if suffix == "bvh" else name for name in names]


@pytest.mark.skipif(not PYTHON, reason="Blender's module bpy is not here (pip install bpy, or set BLENDER_PYTHON)")
@pytest.mark.parametrize("suffix", ["bvh", "glb"])
@pytest.mark.parametrize("name", CLIPS or ["none"])
def test_every_joint_is_where_it_was_in_every_frame(name: str, suffix: str, seen: dict[str, Any]) -> None:
    motion, found = CLIPS[name], seen[f"{name}.{suffix}"]
    skeleton, names = motion.skeleton, in_blender(motion.skeleton.names, suffix)
    above = ("" if parent < 0 else names[parent] for parent in skeleton.parents)
    assert found["parents"] == dict(zip(names, above, strict=True))
    here = skeleton.positions(motion.rotations, motion.root)
    there = y_up([[place[joint] for joint in names] for place in found["places"]])
    assert len(here) == 1 or np.ptp(here, axis=0).max() > 0.01
    np.testing.assert_allclose(there, here, atol=1e-4)
    rest = y_up([found["rest"][joint] for joint in names])
    arms = rest[1:] - rest[list(skeleton.parents[1:])]
    np.testing.assert_allclose(arms, skeleton.offsets[1:], atol=1e-5)
    if suffix == "glb":
        assert found["name"] == skeleton.name
        assert found["skinned"] == [f"{skeleton.name} body"]


@pytest.mark.skipif(not PYTHON, reason="Blender's module bpy is not here (pip install bpy, or set BLENDER_PYTHON)")
def test_at_default_settings_lengths_and_seconds_are_right(tmp_path: Path, run: Run) -> None:
    motion = ballet_clip("adagio").resample(60.0)
    write_motion(tmp_path / "in.json", motion)
    files = {
        "blender.bvh": (["--for", "blender"], {}),
        "blender.glb": (["--for", "blender"], {}),
        "unreal.glb": (["--for", "unreal"], {}),
        "boxes.bvh": ([], {"global_scale": 0.01, "update_scene_fps": True}),
    }
    seconds = (np.arange(20) * 10 / 24.0).tolist()
    jobs = []
    for name, (options, settings) in files.items():
        assert run("convert", tmp_path / "in.json", tmp_path / name, *options).code == 0
        jobs.append((str(tmp_path / name), settings, seconds))
    ran = subprocess.run(
        [str(PYTHON), "-c", AT_DEFAULTS, json.dumps(jobs)], capture_output=True, text=True, check=False
    )
    assert ran.returncode == 0, ran.stderr
    at = motion.at(np.array(seconds))
    here = motion.skeleton.positions(at.rotations, at.root)
    for file, shown in json.loads(ran.stdout.splitlines()[-1]).items():
        there = y_up([[place[joint] for joint in motion.skeleton.names] for place in shown["places"]])
        assert np.linalg.norm(there - here, axis=-1).max() < 1e-3, file
        assert shown["end"] == pytest.approx(motion.times[-1], abs=1.0 / 24.0), file


THERE_AND_BACK = """
import json, sys
import bpy

for source, target, marks in json.loads(sys.argv[1]):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = RATE
    bpy.ops.import_scene.gltf(filepath=source)
    bpy.ops.export_scene.gltf(
        filepath=target, export_extras=marks, export_format="GLB" if target.endswith("glb") else "GLTF_SEPARATE"
    )
""".replace("fps = RATE", f"fps = {RATE}")


@pytest.mark.skipif(not PYTHON, reason="Blender's module bpy is not here (pip install bpy, or set BLENDER_PYTHON)")
def test_what_blender_exports_is_read(tmp_path: Path) -> None:
    plain = ballet_clip("adagio").resample(RATE)
    motion = replace(plain, insertions=(Insertion(plain.times[[10, 20, 30]], (("left_hip", 1),)),))
    write_motion(tmp_path / "in.glb", motion)
    jobs = [
        (str(tmp_path / "in.glb"), str(tmp_path / name), marks) for name, marks in (("a.glb", True), ("b.gltf", False))
    ]
    ran = subprocess.run(
        [str(PYTHON), "-c", THERE_AND_BACK, json.dumps(jobs)], capture_output=True, text=True, check=False
    )
    assert ran.returncode == 0, ran.stderr
    for _, file, marks in jobs:
        found = read_motion(file)
        assert found.skeleton.difference(motion.skeleton) is None
        np.testing.assert_allclose(found.times, motion.times, atol=1e-6)
        assert rot.angle(found.rotations, motion.rotations).max() < 1e-5
        np.testing.assert_allclose(found.root, motion.root, atol=1e-5)
        np.testing.assert_allclose(found.skeleton.tips, motion.skeleton.tips, atol=1e-4)
        assert np.array_equal(found.bridged(), motion.bridged()) == marks


ANIMATE = """
import json, math, random, sys
import bpy
import addon_utils
from mathutils import Quaternion

folder, bvh = sys.argv[1:]

def skin(armature):
    bpy.ops.mesh.primitive_cube_add(size=0.2, location=(0, 0, 1))
    mesh = bpy.context.object
    mesh.parent = armature
    mesh.modifiers.new("armature", "ARMATURE").object = armature
    for bone in armature.data.bones:
        mesh.vertex_groups.new(name=bone.name).add(list(range(8)), 0.1, "REPLACE")

def export(name, armature):
    skin(armature)
    bpy.ops.export_scene.gltf(filepath=f"{folder}/{name}.glb")
    bpy.context.view_layer.objects.active = armature
    bpy.ops.export_anim.bvh(filepath=f"{folder}/{name}.bvh", frame_start=0, frame_end=40, root_transform_only=True)

def empty():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = RATE

empty()
addon_utils.enable("rigify")
bpy.ops.object.armature_human_metarig_add()
rig = bpy.context.object
random.seed(1)
for bone in rig.pose.bones:
    axis = [random.uniform(-1, 1) for _ in range(3)]
    bone.rotation_mode = "QUATERNION"
    for frame in range(0, 41, 2):
        bone.rotation_quaternion = Quaternion(axis, 0.35 * math.sin(0.15 * frame + len(bone.name)))
        bone.keyframe_insert("rotation_quaternion", frame=frame)
        if bone.parent is None:
            bone.location = (0.01 * frame, 0.02 * math.sin(0.2 * frame), 0)
            bone.keyframe_insert("location", frame=frame)
export("rigify", rig)
empty()
bpy.ops.import_anim.bvh(filepath=bvh, global_scale=0.01, frame_start=0)
export("mixamo", bpy.context.object)
""".replace("RATE", str(RATE))

COMPARE = """
import json, math, sys
import bpy

def load(file):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = RATE
    if file.endswith(".bvh"):
        bpy.ops.import_anim.bvh(filepath=file)
    else:
        bpy.ops.import_scene.gltf(filepath=file)
    (armature,) = [thing for thing in bpy.data.objects if thing.type == "ARMATURE"]
    return armature, armature.animation_data.action.frame_range

def pose(armature, frame):
    bpy.context.scene.frame_set(round(frame))
    bpy.context.view_layer.update()
    return {bone.name: (armature.matrix_world @ bone.matrix).copy() for bone in armature.pose.bones}

found = []
for source, frames, result in json.loads(sys.argv[1]):
    armature, (start, _) = load(source)
    wanted = [pose(armature, start + frame) for frame in frames]
    armature, ends = load(result)
    meshes = [thing.name for thing in bpy.data.objects for one in thing.modifiers if one.type == "ARMATURE"]
    degrees, metres, names = 0.0, 0.0, set()
    for bones, end in zip(wanted, ends):
        there = pose(armature, end)
        names = {bones.keys() == there.keys(), *names}
        for name, matrix in bones.items():
            angle = matrix.to_quaternion().rotation_difference(there[name].to_quaternion()).angle
            degrees = max(degrees, math.degrees(min(angle, 2 * math.pi - angle)))
            metres = max(metres, (matrix.translation - there[name].translation).length)
    found.append({"same": names == {True}, "degrees": degrees, "metres": metres, "ends": list(ends), "meshes": meshes})
print("\\n" + json.dumps(found))
""".replace("RATE", str(RATE))


@pytest.mark.skipif(not PYTHON, reason="Blender's module bpy is not here (pip install bpy, or set BLENDER_PYTHON)")
def test_rigs_that_blender_exports_come_back_with_both_ends_in_every_bone(tmp_path: Path, run: Run) -> None:
    dance = disguise(ballet_clip("adagio").resample(RATE).slice(0, 60), rig_names("Mixamo"), spread())
    write_plain(tmp_path / "dance.bvh", dance)
    made = subprocess.run(
        [str(PYTHON), "-c", ANIMATE, str(tmp_path), str(tmp_path / "dance.bvh")],
        capture_output=True,
        text=True,
        check=False,
    )
    assert made.returncode == 0, made.stderr
    jobs = []
    for name in ("rigify.glb", "rigify.bvh", "mixamo.glb", "mixamo.bvh"):
        out = f"out-{name}"
        ends = (f"{name}@4", f"{name}@30")
        ran = run("tween", *ends, "--corpus", "ballet", "--moves", "2..6", "--for", "blender", "-o", out)
        assert ran.code == 0, ran.err
        jobs.append((str(tmp_path / name), (4, 30), str(tmp_path / out)))
    ran = subprocess.run([str(PYTHON), "-c", COMPARE, json.dumps(jobs)], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    for (file, _, _), shown in zip(jobs, json.loads(ran.stdout.splitlines()[-1]), strict=True):
        assert shown["same"], file
        assert shown["degrees"] < 0.01, (file, shown)
        assert shown["metres"] < 1e-4, (file, shown)
        np.testing.assert_allclose(shown["ends"], np.round(shown["ends"]), atol=1e-3)  # keys are on whole frames
        assert bool(shown["meshes"]) == file.endswith("glb")
