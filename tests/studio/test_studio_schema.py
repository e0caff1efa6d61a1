"""The schema of the API: it has every route and no other, and says of each what it answers."""

from __future__ import annotations

import re

import msgspec
import pytest
from starlette.routing import Route
from studio_server import Answer, Served, check_answer

from motionmind.studio import app
from motionmind.studio.schema import CALLS, document
from motionmind.studio.token import Keys


def test_the_schema_has_every_route_and_no_other(studio_server: Served) -> None:
    found = set()
    for route in app.routes_of(studio_server.studio, Keys(), 80):
        assert isinstance(route, Route)
        path = re.sub(r":\w+\}", "}", route.path)
        if path.startswith(("/api/", "/health")):
            found |= {(method, path) for method in (route.methods or set()) - {"HEAD"}}
    assert found == {(call.method, call.path) for call in CALLS}
    assert len(CALLS) == len(found)


def test_the_document_resolves(studio_server: Served) -> None:
    told = studio_server.get("/api/schema")
    assert told == msgspec.json.decode(msgspec.json.encode(document()))
    text = msgspec.json.encode(told).decode()
    names = set(re.findall(r'"\$ref":"#/components/schemas/([\w.]+)"', text))
    assert names == set(told["components"]["schemas"])
    assert {"ProjectView", "Edited", "Failure"} <= names


@pytest.mark.parametrize(
    "body", [b'{"ready": true, "more": 1}', b"{}", b'{"ready": false}', b'{"ready": "true"}', b"not JSON"]
)
def test_an_answer_that_is_another_fails(body: bytes) -> None:
    with pytest.raises(msgspec.DecodeError):
        check_answer("GET", "/health", Answer(200, {"content-type": "application/json"}, body))
    with pytest.raises(AssertionError, match="is not in the schema"):
        check_answer("GET", "/api/unknown", Answer(200, {"content-type": "application/json"}, body))


def test_the_whole_way_from_a_to_b_answers_as_the_schema_says(studio_server: Served) -> None:
    studio_server.get("/api/gallery")
    begun = studio_server.post("/api/between", {"a": {"key": "ballet/arabesque"}, "b": {"key": "ballet/fifth"}})
    job = studio_server.wait_for(begun["job"])
    assert job["state"] == "done"
    studio_server.get(f"/api/between/{begun['job']}/1")
    state = studio_server.post("/api/between/accept", {"job": begun["job"], "alternative": 1, "window": "w1"})
    assert [seam["state"] for seam in state["piece"]["seams"]] == ["inserted"]
    for form in ("project", "bvh", "glb", "html", "json"):
        assert studio_server.send("GET", f"/api/export/{form}").status == 200
    studio_server.get("/api/vary/map")
    studio_server.insert("c1", "ballet/adagio", 0, 60)
    studio_server.post("/api/vary", {"depart": 0.3})
    opened = studio_server.post("/api/pose/open", {"key": "ballet/fifth"})
    pose = {"key": "ballet/fifth", "rotations": opened["rotations"], "root": opened["root"]}
    studio_server.post("/api/pose/tell", {"pose": pose})
    studio_server.post("/api/pose/change", {"pose": pose, "to": "whole"})
    studio_server.post("/api/pose/keep", {"pose": pose, "name": "mine"})
    studio_server.post("/api/pose/score", {"pose": pose, "name": "mine"})
    studio_server.get("/api/corpora")
    studio_server.get("/api/corpora/ballet")
    studio_server.get("/api/imports")
    for method in ("DELETE", "POST"):
        assert studio_server.send(method, "/api/seams").status == 200
