"""Blender imports what is served: every joint is where it should be, in each frame."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from motionmcp import client
from served import ask, keyframe, of_ballet, on_rig, root_of, rotations_of

from motionmind.geometry import rotations as rot

PYTHON = os.environ.get("BLENDER_PYTHON") or (importlib.util.find_spec("bpy") and sys.executable)
BLENDER = """
import json, sys
import bpy

found = {}
for file, frames in json.loads(sys.argv[1]):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = 30
    bpy.ops.import_scene.gltf(filepath=file)
    (armature,) = [thing for thing in bpy.data.objects if thing.type == "ARMATURE"]
    found[file] = []
    for frame in range(frames):
        bpy.context.scene.frame_set(frame)
        bpy.context.view_layer.update()
        places = {bone.name: list(armature.matrix_world @ bone.head) for bone in armature.pose.bones}
        found[file].append(places)
print("\\n" + json.dumps(found))
"""


@pytest.mark.skipif(not PYTHON, reason="Blender's module bpy is not here (pip install bpy, or set BLENDER_PYTHON)")
def test_blender_shows_what_was_asked_for(url: str, tmp_path: Path) -> None:
    a, b = of_ballet("arabesque"), of_ballet("fifth", (0.3, 0.95, 0.2))
    cases: dict[str, Any] = {"human23": (a, b), "rig": (on_rig(a), on_rig(b))}
    jobs, samples = [], {}
    for name, (start, end) in cases.items():
        document = client.generate(url, ask([keyframe(0, start), keyframe(30, end)], 31, start.skeleton))
        samples[name] = client.parse_gltf(document)
        (tmp_path / f"{name}.gltf").write_text(json.dumps(document))
        jobs.append((str(tmp_path / f"{name}.gltf"), 31))
    ran = subprocess.run([str(PYTHON), "-c", BLENDER, json.dumps(jobs)], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    shown = json.loads(ran.stdout.splitlines()[-1])
    for name, (start, end) in cases.items():
        skeleton, sample = start.skeleton, samples[name]
        rotations = rot.from_matrix(rotations_of(sample, skeleton.names).astype(np.float64))
        wanted = skeleton.positions(rotations, root_of(sample, skeleton.names[0]).astype(np.float64))
        places = [[place[joint] for joint in skeleton.names] for place in shown[str(tmp_path / f"{name}.gltf")]]
        there = np.array(places) @ np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
        np.testing.assert_allclose(there, wanted, atol=1e-4)
        for frame, posture in ((0, start), (30, end)):
            np.testing.assert_allclose(
                there[frame], skeleton.positions(posture.rotations, posture.root), atol=1e-4, err_msg=name
            )
