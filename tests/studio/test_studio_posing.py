"""The pose editor's routes, as the page uses them."""

from __future__ import annotations

from statistics import median
from time import process_time
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from studio_server import Served

KEY = "ballet/arabesque"
SECONDS = 0.03  # in which a drag is answered; three times as many where tests share a machine


def _pose(told: dict[str, Any]) -> dict[str, Any]:
    return {"key": KEY, "rotations": told["rotations"], "root": told["root"]}


@pytest.fixture
def opened(studio_server: Served) -> dict[str, Any]:
    told = studio_server.post("/api/pose/open", {"key": KEY})
    assert isinstance(told, dict)
    return told


def test_an_opened_posture_has_handles_angles_and_what_is_known(opened: dict[str, Any]) -> None:
    assert {"pelvis", "left_wrist", "right_ankle", "left_knee", "atlantal"} <= {h["joint"] for h in opened["handles"]}
    assert len(opened["known"]) == len(opened["joints"]) == 23
    assert set(opened["known"]) == {"seen"}
    assert opened["standing"] == ["left_toes"] or opened["standing"] == ["right_toes"]
    assert all(turn["least"] - 1e-6 <= turn["degrees"] <= turn["most"] + 1e-6 for turn in opened["turns"])


def test_a_drag_is_answered_while_it_goes_on(studio_server: Served, opened: dict[str, Any]) -> None:
    pose, took = _pose(opened), []
    start = pose
    for step in range(12):
        asked = {"pose": pose, "start": start, "joint": "left_wrist", "standing": opened["standing"]}
        began = process_time()  # of the server, too, which is in this process
        told = studio_server.post("/api/pose/drag", asked | {"place": [0.3, 1.2 + 0.02 * step, 0.4]})
        took.append(process_time() - began)
        pose = _pose(told)
        assert len(told["known"]) == 23
    assert median(took) < 3 * SECONDS


def test_postures_change_and_are_kept(studio_server: Served, opened: dict[str, Any]) -> None:
    client = studio_server
    turned = client.post(
        "/api/pose/turn", {"pose": _pose(opened), "joint": "left_shoulder", "angle": "flexion", "degrees": -50.0}
    )
    assert "unseen" in turned["known"]
    for to in ("known", "whole", "mirror", "floor"):
        told = client.post("/api/pose/change", {"pose": _pose(turned), "to": to})
        assert len(told["rotations"]) == 4 * 23
        if to in ("known", "whole"):
            assert "unseen" not in told["known"]
    key = client.post("/api/pose/keep", {"pose": _pose(turned), "name": "bow"})["key"]
    assert client.get(f"/api/movements/{key}")["name"] == "bow"
    client.edit(edit="posture", name="bow", posture=key)
    assert [posture["name"] for posture in client.project()["postures"]] == ["bow"]
    assert client.post("/api/pose/open", {"key": "own/bow"})["known"] == turned["known"]
    lines = client.post("/api/pose/score", {"pose": _pose(turned), "name": "bow"})["lines"]
    assert "posture bow = bow left" in lines


@pytest.mark.parametrize(
    ("path", "body", "words"),
    [
        ("open", {"key": KEY, "frame": 7}, "no frame 7"),
        ("open", {"key": "ballet/nothing"}, "nothing"),
        ("open", {"key": KEY, "more": 1}, "invalid request"),
        ("turn", {"joint": "tail", "angle": "flexion", "degrees": 1.0}, "no joint 'tail'"),
        ("turn", {"joint": "left_knee", "angle": "twist", "degrees": 1.0}, "no angle twist"),
        ("drag", {"start": None, "joint": "pelvis", "place": [0, 0, 0], "standing": []}, "invalid request"),
    ],
)
def test_what_makes_no_sense_gets_one_line(
    studio_server: Served, opened: dict[str, Any], path: str, body: dict[str, Any], words: str
) -> None:
    if path != "open":
        body = {"pose": _pose(opened)} | body
    answer = studio_server.send("POST", f"/api/pose/{path}", body)
    assert answer.status == 400
    assert words in answer.value["error"]
    assert "\n" not in answer.value["error"]


def test_numbers_that_are_no_posture_are_refused(studio_server: Served, opened: dict[str, Any]) -> None:
    pose = _pose(opened)
    for rotations in (pose["rotations"][4:], [0.0] * 92, [0.7] * 92):
        answer = studio_server.send(
            "POST", "/api/pose/change", {"pose": pose | {"rotations": rotations}, "to": "floor"}
        )
        assert answer.status == 400
