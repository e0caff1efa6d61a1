"""Movement over MMCP, asked for and read by the protocol's own client, and checked by its own schemas."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from motionmcp import backbone, client, schemas
from served import ask, keyframe, of_ballet, on_rig, root_of, rotations_of, serving, wire

from motionmind.body.human import human23
from motionmind.body.motion import Posture
from motionmind.formats import read_motion
from motionmind.geometry import rotations as rot
from motionmind.serve.mmcp import app
from motionmind.tween.engine import Engine

A, B, C = of_ballet("arabesque"), of_ballet("fifth", (0.4, 0.95, 0.3)), of_ballet("adagio@23", (0.6, 0.93, 0.1))
EXACT = 1e-4


def generate(url: str, request: Any) -> tuple[Any, list[Any]]:
    """The document that answers, and the samples in it; the request is valid by the protocol's schema."""
    schemas.GenerateRequest.model_validate(request)
    document = client.generate(url, request)
    return document, client.parse_gltf_samples(document)


def assert_at(sample: Any, frame: int, posture: Posture) -> None:
    """Fail unless a sample is at a posture in a frame."""
    names = posture.skeleton.names
    turned = rotations_of(sample, names)[frame]
    np.testing.assert_allclose(turned, rot.to_matrix(posture.rotations), atol=EXACT)
    np.testing.assert_allclose(root_of(sample, names[0])[frame], posture.root, atol=EXACT)


def certificates(document: Any) -> list[Any]:
    return [one["extras"]["motionmind"] for one in document["animations"]]


def test_the_client_finds_the_model_and_the_schema_accepts_it(url: str) -> None:
    assert client.probe_server(url).status == "online"
    model = client.pick_model(client.get_capabilities(url, use_cache=False), "ballet")
    spec = backbone.ModelSpec.model_validate(model)
    assert spec.canonical_skeleton.model_dump()["joints"] == [
        one | {"display_name": None, "rest_translation": tuple(one["rest_translation"]), "rest_rotation": (0, 0, 0, 1)}
        for one in wire(human23(), spec.canonical_skeleton.root.rest_translation)["joints"]
    ]
    lowest = human23().rest[:23, 1].min() + spec.canonical_skeleton.root.rest_translation[1]
    assert abs(lowest) < 1e-9  # it stands on the floor


@pytest.mark.long
def test_poses_are_exact_and_each_stretch_has_its_certificate(url: str) -> None:
    asked = {0: A, 40: B, 90: C}
    document, (sample,) = generate(url, ask([keyframe(*one) for one in asked.items()], 91))
    assert sample["fps"] == 30.0
    assert sample["num_frames"] == 91
    for frame, posture in asked.items():
        assert_at(sample, frame, posture)
    (certificate,) = certificates(document)
    assert certificate["corpus"] == "ballet"
    assert [(one["first_frame"], one["last_frame"]) for one in certificate["stretches"]] == [(0, 40), (40, 90)]
    for one in certificate["stretches"]:
        assert one["status"] == "optimal"
        assert one["lower_bound"] <= one["cost"] <= one["lower_bound"] + 1e-6
        assert one["moves"] > 0


@pytest.mark.long
def test_movement_goes_on_through_a_pose(url: str) -> None:
    _, (sample,) = generate(url, ask([keyframe(0, A), keyframe(50, B), keyframe(90, C)], 91))
    velocity = 30.0 * np.diff(root_of(sample, "pelvis")[48:53], axis=0)
    change = velocity[2] - velocity[1]
    assert np.linalg.norm(change[[0, 2]]) < 0.25
    assert abs(change[1]) < 0.45  # a foot lands there, on a straight leg
    turned = rot.from_matrix(rotations_of(sample, human23().names)[48:53].astype(np.float64))
    turning = 30.0 * rot.log(rot.inv_mul(turned[:-1], turned[1:]))
    assert np.linalg.norm(turning[2] - turning[1], axis=-1).max() < 2.5


def test_the_same_request_has_the_same_answer(url: str) -> None:
    request = ask([keyframe(0, A), keyframe(60, B)], 61, options={"seed": 7})
    assert client.generate(url, request) == client.generate(url, request)


@pytest.mark.long
def test_samples_differ_and_so_do_seeds(url: str) -> None:
    constraints = [keyframe(0, A), keyframe(60, B)]
    document, best = generate(url, ask(constraints, 61, options={"num_samples": 3}))
    _, (seeded,) = generate(url, ask(constraints, 61, options={"seed": 7}))
    found = [rotations_of(sample, human23().names) for sample in (*best, seeded)]
    for number, one in enumerate(found):
        assert_at([*best, seeded][number], 60, B)
        for other in found[:number]:
            assert np.abs(one - other).max() > 0.1
    costs = [one["stretches"][0]["cost"] for one in certificates(document)]
    assert costs[0] == min(costs)


@pytest.mark.long
def test_waypoints_are_passed_and_faced(url: str) -> None:
    frames, places = [0, 20, 40, 60, 80], [[0.0, 0.0], [0.2, 0.1], [0.4, 0.3], [0.5, 0.6], [0.6, 0.9]]
    path = {"type": "root_path", "frames": frames, "positions_xz": places, "heading_radians": [0, 0.1, 0.3, 0.5, 0.6]}
    poses = [keyframe(0, A, root=False), keyframe(80, B, root=False)]
    document, (sample,) = generate(url, ask([*poses, path], 81))
    np.testing.assert_allclose(root_of(sample, "pelvis")[frames][:, [0, 2]], places, atol=EXACT)
    turned = rot.heading(rot.from_matrix(rotations_of(sample, ["pelvis"])[frames[1:4], 0].astype(np.float64)))
    np.testing.assert_allclose(turned, [0.1, 0.3, 0.5], atol=EXACT)
    assert len(certificates(document)[0]["stretches"]) == 4


@pytest.mark.long
def test_waypoints_of_a_dense_path_are_all_passed(url: str) -> None:
    frames = list(range(0, 81, 5))
    places = [[0.01 * frame, 0.1 * np.sin(0.05 * frame)] for frame in frames]
    path = {"type": "root_path", "frames": frames, "positions_xz": places}
    poses = [keyframe(0, A, root=False), keyframe(80, B, root=False)]
    _, (sample,) = generate(url, ask([*poses, path], 81))
    np.testing.assert_allclose(root_of(sample, "pelvis")[frames][:, [0, 2]], places, atol=EXACT)


def test_pins_are_reached_and_poses_stay(url: str) -> None:
    skeleton = human23()
    at = skeleton.positions(A.rotations, A.root)[skeleton.index("left_wrist")]
    pins = {"type": "effector_target", "joint": "left_wrist", "frames": [30, 35], "positions": [list(at), list(at)]}
    document, (sample,) = generate(url, ask([keyframe(0, A), keyframe(60, A), pins], 61))
    for frame in (30, 35):
        rotations = rot.from_matrix(rotations_of(sample, skeleton.names)[frame].astype(np.float64))
        reached = skeleton.positions(rotations, root_of(sample, "pelvis")[frame].astype(np.float64))
        np.testing.assert_allclose(reached[skeleton.index("left_wrist")], at, atol=EXACT)
    for frame in (0, 60):
        assert_at(sample, frame, A)
    assert document["extensions"]["MMCP_motion"]["notes"] == []


def test_a_pin_out_of_reach_is_told(url: str) -> None:
    pins = {"type": "effector_target", "joint": "left_wrist", "frames": [30], "positions": [[9.0, 1.0, 0.0]]}
    document, _ = generate(url, ask([keyframe(0, A), keyframe(60, B), pins], 61))
    assert any("left_wrist" in note["message"] for note in document["extensions"]["MMCP_motion"]["notes"])


def test_part_of_a_pose_is_filled_from_the_corpus(url: str) -> None:
    part = keyframe(0, A)
    given = ["left_hip", "left_knee", "right_hip"]
    part["joint_rotations"] = {name: part["joint_rotations"][name] for name in given}
    document, (sample,) = generate(url, ask([part, keyframe(60, B)], 61))
    asked = rot.to_matrix(A.rotations[[human23().index(name) for name in given]])
    np.testing.assert_allclose(rotations_of(sample, given)[0], asked, atol=EXACT)
    assert "20 joints" in document["extensions"]["MMCP_motion"]["notes"][0]["message"]


def test_a_pose_of_one_arm_leaves_the_rest_to_the_movement(url: str) -> None:
    arm = [name for name in human23().names if name.startswith("left_") and name[5:] in ("shoulder", "elbow", "wrist")]
    part = keyframe(24, C, root=False)
    part["joint_rotations"] = {name: part["joint_rotations"][name] for name in arm}
    ends = [keyframe(0, A), keyframe(80, B)]
    document, (sample,) = generate(url, ask([*ends, part], 81))
    _, (without,) = generate(url, ask(ends, 81))
    asked = rot.to_matrix(C.rotations[[human23().index(name) for name in arm]])
    np.testing.assert_allclose(rotations_of(sample, arm)[24], asked, atol=EXACT)
    others = [name for name in human23().names if name not in arm]
    np.testing.assert_allclose(rotations_of(sample, others)[24], rotations_of(without, others)[24], atol=EXACT)
    assert document["extensions"]["MMCP_motion"]["notes"] == []
    assert len(certificates(document)[0]["stretches"]) == 2


def test_a_waypoint_that_a_pose_rules_out_is_told(url: str) -> None:
    path = {"type": "root_path", "frames": [0, 60, 65], "positions_xz": [[5.0, 0.0], [0.4, 0.3], [9.0, 9.0]]}
    document, (sample,) = generate(url, ask([keyframe(0, A), keyframe(60, B), path], 66))
    assert_at(sample, 0, A)
    said = [note["message"] for note in document["extensions"]["MMCP_motion"]["notes"]]
    assert [line.split(":")[0] for line in said if "waypoint" in line] == ["frame 0", "frame 65"]


def test_the_rest_of_a_pose_is_at_rest_where_that_is_asked(url: str) -> None:
    part = keyframe(60, B) | {"fill_mode": "rest", "joint_rotations": {"left_hip": [0.0, 0.0, 0.1, 1.0]}}
    _, (sample,) = generate(url, ask([keyframe(0, A), part], 61))
    others = [name for name in human23().names if name != "left_hip"]
    np.testing.assert_allclose(rotations_of(sample, others)[60], np.tile(np.eye(3), (22, 1, 1)), atol=EXACT)


def test_before_the_first_pose_and_after_the_last_the_body_is_still(url: str) -> None:
    _, (sample,) = generate(url, ask([keyframe(10, A), keyframe(50, B)], 61))
    for frame in (0, 5, 10):
        assert_at(sample, frame, A)
    for frame in (50, 60):
        assert_at(sample, frame, B)


def test_prompts_are_told_to_be_ignored(url: str) -> None:
    request = ask([keyframe(0, A), keyframe(60, B)], 61)
    del request["duration_frames"]
    request["segments"] = [
        {"type": "text", "prompt": "a leap", "duration_frames": 30},
        {"type": "unconditioned", "duration_frames": 31},
    ]
    document, _ = generate(url, request)
    assert [note["code"] for note in document["extensions"]["MMCP_motion"]["notes"]].count("prompt_ignored") == 1


@pytest.mark.parametrize("fps", [24.0, 60.0])
def test_frames_are_those_of_the_request(fps: float, url: str) -> None:
    _, (sample,) = generate(url, ask([keyframe(0, A), keyframe(50, B)], 51, timing={"fps": fps}))
    assert sample["fps"] == fps
    assert_at(sample, 50, B)


@pytest.mark.long
def test_a_foreign_rig_gets_movement_of_its_own(url: str) -> None:
    a, b = on_rig(A), on_rig(B)
    document, (sample,) = generate(url, ask([keyframe(0, a), keyframe(45, b)], 46, a.skeleton))
    assert sample["joint_names"] == list(a.skeleton.names)
    assert_at(sample, 0, a)
    assert_at(sample, 45, b)
    # The movement is that of human23: it is the same in degrees, whatever the rig.
    own, (mine,) = generate(url, ask([keyframe(0, A), keyframe(45, B)], 46))
    assert certificates(document)[0]["stretches"][0]["cost"] == pytest.approx(
        certificates(own)[0]["stretches"][0]["cost"], abs=1e-3
    )
    thumb = rotations_of(sample, ["mixamorig:LeftHandThumb1"])
    np.testing.assert_allclose(thumb, np.broadcast_to(thumb[:1], thumb.shape), atol=1e-6)
    elbow, theirs = rotations_of(sample, ["mixamorig:LeftForeArm"]), rotations_of(mine, ["left_elbow"])
    bends = [np.arccos(np.clip((np.trace(m[:, 0], axis1=1, axis2=2) - 1.0) / 2.0, -1.0, 1.0)) for m in (elbow, theirs)]
    assert np.abs(bends[0] - bends[1]).max() < np.radians(3.0)


def test_a_joint_that_the_corpus_lacks_goes_evenly_from_pose_to_pose(url: str) -> None:
    a, b = on_rig(A), on_rig(B)
    thumb = a.skeleton.names.index("mixamorig:LeftHandThumb1")
    turned = b.rotations.copy()
    turned[thumb] = rot.mul(turned[thumb], rot.from_axis_angle([1.0, 0.0, 0.0], 1.2))
    b = Posture(b.skeleton, turned, b.root)
    _, (sample,) = generate(url, ask([keyframe(0, a), keyframe(30, b)], 31, a.skeleton))
    found = rot.from_matrix(rotations_of(sample, ["mixamorig:LeftHandThumb1"])[:, 0].astype(np.float64))
    np.testing.assert_allclose(rot.angle(found[:-1], found[1:]), 1.2 / 30.0, atol=1e-3)


def test_a_batch_has_an_answer_for_each(url: str) -> None:
    import urllib.request

    good = ask([keyframe(0, A), keyframe(30, B)], 31)
    body = json.dumps({"protocol_version": "1.0", "requests": [good, good | {"model": "opera"}]}).encode()
    with urllib.request.urlopen(urllib.request.Request(f"{url}/generate", body)) as answer:
        first, second = json.loads(answer.read())["results"]
    assert certificates(first["gltf"])[0]["corpus"] == "ballet"
    assert second["error"]["code"] == "unknown_model"


def test_the_answer_is_gltf_that_this_program_reads_too(url: str, tmp_path: Any) -> None:
    document, _ = generate(url, ask([keyframe(0, A), keyframe(30, B)], 31))
    (tmp_path / "motion.gltf").write_text(json.dumps(document))
    motion = read_motion(tmp_path / "motion.gltf")
    assert motion.skeleton.names == human23().names
    np.testing.assert_allclose(np.abs(np.sum(motion.rotations[30] * B.rotations, axis=-1)), 1.0, atol=1e-6)


def test_an_insect_is_served_on_its_own_joints_alone() -> None:
    engine = Engine.load("walk-hexapod")
    clip = engine.corpus.motion(engine.corpus.clips[0])
    a, b = clip.posture(0), clip.posture(3)
    with serving(app(engine)) as url:
        model = client.pick_model(client.get_capabilities(url))
        assert not model["supports_retargeting"]
        request = ask([keyframe(0, a), keyframe(40, b)], 41, a.skeleton) | {"model": "walk-hexapod"}
        _, (sample,) = generate(url, request)
        with pytest.raises(client.MmcpError) as error:
            client.generate(url, ask([keyframe(0, A), keyframe(40, B)], 41) | {"model": "walk-hexapod"})
    for frame, posture in ((0, a), (40, b)):
        assert_at(sample, frame, posture)
    assert error.value.code == "retargeting_unsupported"


NAN = float("nan")
ENDS = [keyframe(0, A), keyframe(60, B)]
LONG = wire(human23())
LONG["joints"] += [LONG["joints"][1] | {"name": f"extra {number}", "parent": "pelvis"} for number in range(100)]
BAD = {
    "no pose": ({"constraints": [], "segments": [{"type": "text", "prompt": "x", "duration_frames": 9}]}, "invalid"),
    "a frame outside": ({"duration_frames": 20}, "frame_out_of_range"),
    "frames without end": ({"duration_frames": 10**9, "timing": {"fps": 1e9}}, "invalid_options"),
    "a number without end": ({"duration_frames": 10**400}, "invalid_request"),
    "a rig of nobody": (
        {
            "skeleton": {
                "joints": [{"name": "x", "parent": None, "rest_translation": [0, 0, 0], "rest_rotation": [0, 0, 0, 1]}]
            },
            "constraints": [{"type": "pose_keyframe", "frame": 0, "joint_rotations": {"x": [0, 0, 0, 1]}}],
        },
        "invalid_skeleton",
    ),
    "a rotation that is none": (
        {
            "constraints": [
                keyframe(0, A),
                {"type": "pose_keyframe", "frame": 9, "joint_rotations": {"pelvis": [0] * 4}},
            ]
        },
        "invalid_request",
    ),
    "no number": (
        {"constraints": [keyframe(0, A), keyframe(9, B) | {"root_position": [NAN, 0.0, 0.0]}]},
        "invalid_request",
    ),
    "poses that disagree": ({"constraints": [keyframe(0, A), keyframe(0, B), keyframe(60, B)]}, "invalid_request"),
    "an option that there is not": ({"options": {"model_options": {"mood": 1}}}, "invalid_options"),
    "a path in place of a model": ({"model": "../../etc/passwd"}, "unknown_model"),
    "another protocol": ({"protocol_version": "2.0"}, "version_unsupported"),
    "a joint that cannot be held": ({"options": {"model_options": {"hold": ["left_ankle"]}}}, "invalid_request"),
    "two waypoints in a frame": (
        {"constraints": [*ENDS, {"type": "root_path", "frames": [5], "positions_xz": [[0, 0]]}] * 2},
        "invalid_request",
    ),
    "two pins in a frame": (
        {
            "constraints": [
                *ENDS,
                {"type": "effector_target", "joint": "pelvis", "frames": [5, 5], "positions": [[0, 0, 0]] * 2},
            ]
        },
        "invalid_request",
    ),
    "more than an answer holds": (
        {"duration_frames": 3600, "timing": {"fps": 120.0}, "skeleton": LONG, "options": {"num_samples": 8}},
        "invalid_request",
    ),
    "a rest that is turned": (
        {"skeleton": {"joints": [one | {"rest_rotation": [1.0, 0.0, 0.0, 0.0]} for one in wire(human23())["joints"]]}},
        "invalid_skeleton",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_what_cannot_be_done_is_a_clear_error(case: str, url: str) -> None:
    change, code = BAD[case]
    request = ask([keyframe(0, A), keyframe(60, B)], 61) | change
    if "segments" in change:
        del request["duration_frames"]
    with pytest.raises(client.MmcpError) as error:
        client.generate(url, request)
    assert error.value.code.startswith(code)
    assert 400 <= error.value.details["status"] < 500
    assert "Traceback" not in str(error.value) + json.dumps(error.value.details)
