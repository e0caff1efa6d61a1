"""Joint graphs as pictures and as files for other programs."""

from __future__ import annotations

from dataclasses import replace
from io import BytesIO
from itertools import combinations, pairwise
from pathlib import Path
from xml.etree import ElementTree

import networkx as nx
import numpy as np
import pytest
from bundled_clips import ballet_clip
from command_line import Run
from PIL import Image

from motionmind.errors import MotionMindError
from motionmind.formats import write_motion
from motionmind.plots.canvas import png, svg
from motionmind.plots.graph_layout import GraphLayout, lay_out
from motionmind.plots.joint_graph import GRAPHS, graph_plate, write_graph
from motionmind.tween.engine import Engine

SVG = "{http://www.w3.org/2000/svg}"
GRAPHS_OF = [
    *(("ballet", "left_hip"), ("ballet", "left_shoulder"), ("ballet", "pelvis"), ("walk-hexapod", "left_fore_coxa")),
    ("walk-hexapod", "facing"),
]


def graph_of(corpus: str, joint: str) -> nx.DiGraph:
    return Engine.load(corpus).joint_graph(joint)


def toy(edges: list[tuple[int, int]], states: int, joint: str = "knee") -> nx.DiGraph:
    """A graph of states in a row, 10 degrees apart."""
    graph = nx.DiGraph(corpus="toys", joint=joint, parent=None)
    for state in range(states):
        half = np.radians(5.0 * state)
        turn = (0.0, float(np.sin(half)), 0.0, float(np.cos(half)))
        graph.add_node(state, orientation=turn, visits=1.0 + state, label=f"state {state}")
    for a, b in edges:
        graph.add_edge(a, b, weight=float(np.log(sum(a == other for other, _ in edges))), count=2.0, seconds=0.2)
    return graph


def assert_readable(drawing: GraphLayout) -> None:
    """Everything is in the picture, no circle touches another, no name covers a circle or another name."""
    boxes = []
    for circle in drawing.circles:
        (x, y), r = circle.at, circle.radius
        assert r <= x <= drawing.width - r
        assert r <= y <= drawing.height - r
        if circle.words_at:
            left, middle = circle.words_at
            boxes.append((left, middle - 5.0, left + 5.9 * len(circle.name), middle + 5.0))
            assert 0.0 < left < boxes[-1][2] < drawing.width
    for one, other in combinations(drawing.circles, 2):
        assert np.hypot(*np.subtract(one.at, other.at)) > one.radius + other.radius
    for one, other in combinations(boxes, 2):
        assert one[2] <= other[0] or other[2] <= one[0] or one[3] <= other[1] or other[3] <= one[1]
    for left, top, right, bottom in boxes:
        for circle in drawing.circles:
            (x, y), r = circle.at, circle.radius
            assert np.hypot(x - np.clip(x, left, right), y - np.clip(y, top, bottom)) > r - 1e-6


@pytest.mark.parametrize(("corpus", "joint"), GRAPHS_OF)
def test_the_picture_has_every_state_and_transition_and_can_be_read(corpus: str, joint: str) -> None:
    graph = graph_of(corpus, joint)
    drawing = lay_out(graph)
    assert_readable(drawing)
    assert len(drawing.circles) == len(graph)
    assert len(drawing.arrows) == sum(a != b for a, b in graph.edges)
    named = sum(circle.words_at is not None for circle in drawing.circles)
    assert named > 0.7 * len(graph)
    root = ElementTree.fromstring(svg(graph_plate(graph)))
    assert len(root.findall(f".//{SVG}circle")) == len(graph)
    assert len(root.findall(f".//{SVG}polygon")) == len(drawing.arrows)
    assert len(root.findall(f".//{SVG}text")) == named + 2
    image = Image.open(BytesIO(png(graph_plate(graph))))
    assert image.size == (drawing.width, drawing.height)
    for circle in drawing.circles:
        assert image.getpixel((round(circle.at[0]), round(circle.at[1]))) == (58, 104, 160)


def test_arrows_join_the_circles_that_they_are_between_and_tell_how_likely_they_are() -> None:
    graph = graph_of("ballet", "left_shoulder")
    drawing = lay_out(graph)
    circles = dict(zip(graph, drawing.circles, strict=True))
    told = {arrow.title: arrow for arrow in drawing.arrows}
    for a, b, data in graph.edges(data=True):
        chance = np.exp(-data["weight"])
        if a == b:
            assert circles[a].stays == pytest.approx(chance)
            continue
        title = next(title for title in told if title.startswith(f"{circles[a].name} -> {circles[b].name}: "))
        assert f": {chance:.1%}, seen {data['count']:g} times" in title
        for point, circle in ((told[title].curve[0], circles[a]), (told[title].head[0], circles[b])):
            assert np.hypot(*np.subtract(point, circle.at)) == pytest.approx(circle.radius, abs=1.5)
    by_chance = sorted(drawing.arrows, key=lambda arrow: float(arrow.title.split(": ")[1].split("%")[0]))
    for name in ("width", "opacity"):
        values = [getattr(arrow, name) for arrow in by_chance]
        assert all(b >= a - 0.01 for a, b in pairwise(values))
        assert values[-1] > 1.2 * values[0]


def test_likely_states_are_larger_and_near_orientations_lie_nearer() -> None:
    graph = graph_of("ballet", "left_hip")
    drawing, visits = lay_out(graph), [data["visits"] for _, data in graph.nodes(data=True)]
    radii = [circle.radius for circle in drawing.circles]
    assert np.argsort(visits, kind="stable").tolist() == np.argsort(radii, kind="stable").tolist()
    q = np.array([data["orientation"] for _, data in graph.nodes(data=True)])
    places = np.array([circle.at for circle in drawing.circles])
    angles = np.arccos(np.clip(np.abs(q @ q.T), 0.0, 1.0))[np.triu_indices(len(q), 1)]
    apart = np.linalg.norm(places[:, None] - places[None], axis=-1)[np.triu_indices(len(q), 1)]
    assert np.corrcoef(angles, apart)[0, 1] > 0.6


def test_what_no_transition_joins_is_left_out_and_counted() -> None:
    drawing = lay_out(toy([(0, 1), (1, 2), (2, 0), (4, 4)], 6))
    assert [circle.name for circle in drawing.circles] == ["0", "1", "2"]
    assert drawing.heading == ("knee (toys): 6 states, 3 transitions between them; 3 that no transition joins left out")
    assert lay_out(toy([(0, 1)], 2)).heading.endswith("them")


@pytest.mark.parametrize("edges", [[], [(0, 0)], [(0, 1)], [(0, 1), (1, 0), (2, 3)], [(0, 1), (2, 3), (4, 5), (5, 4)]])
def test_small_graphs_and_parts_that_hang_on_nothing_have_their_places(edges: list[tuple[int, int]]) -> None:
    graph = toy(edges, 6)
    drawing = lay_out(graph)
    assert_readable(drawing)
    assert len(drawing.circles) == len({state for a, b in edges if a != b for state in (a, b)})
    ElementTree.fromstring(svg(graph_plate(graph)))
    assert Image.open(BytesIO(png(graph_plate(graph)))).size == (drawing.width, drawing.height)


def test_states_of_one_orientation_do_not_lie_on_each_other() -> None:
    graph = toy([(a, b) for a in range(5) for b in range(5)], 5)
    for state in graph:
        graph.nodes[state]["orientation"] = (0.0, 0.0, 0.0, 1.0)
    assert_readable(lay_out(graph))


def test_the_facing_goes_round() -> None:
    graph = graph_of("walk-hexapod", "facing")
    drawing = lay_out(graph)
    places = np.array([circle.at for circle in drawing.circles])
    centre = places.mean(axis=0)
    assert np.ptp(np.linalg.norm(places - centre, axis=1)) < 1.0
    steps = np.diff(np.unwrap(np.arctan2(*(places - centre).T)))
    np.testing.assert_allclose(steps, 2.0 * np.pi / len(graph), atol=1e-3)
    front = next(circle for circle in drawing.circles if circle.name == "0°")
    assert front.at[1] == max(circle.at[1] for circle in drawing.circles)


def test_states_tell_which_of_their_parents_states_they_go_with() -> None:
    engine = Engine.load("ballet")
    for joint in ("left_knee", "pelvis"):
        chain = engine.space.index(joint)
        parent = int(engine.corpus.chain_parents[chain])
        graph = engine.joint_graph(joint)
        if parent < 0:
            assert {data["given"] for _, data in graph.nodes(data=True)} == {()}
            continue
        cpd = engine.network().get_cpds(joint).get_values()
        for state, data in graph.nodes(data=True):
            seen = {int(p) for p in engine.states[engine.states[:, chain] == state, parent]}
            best = sorted((cpd[state, p] for p in seen), reverse=True)[:3]
            assert [chance for _, chance in data["given"]] == pytest.approx(best)
            names = {engine.space.label(parent, p) for p in seen}
            assert {name for name, _ in data["given"]} <= names
        name, chance = graph.nodes[0]["given"][0]
        assert f"{chance:.0%} where left_hip is {name}" in lay_out(graph).circles[0].title


def test_other_programs_read_all_of_it(tmp_path: Path) -> None:
    graph = graph_of("ballet", "left_knee")
    write_graph(tmp_path / "a.graphml", graph)
    write_graph(tmp_path / "a.gexf", graph)
    for found in (nx.read_graphml(tmp_path / "a.graphml", node_type=int), nx.read_gexf(tmp_path / "a.gexf", int)):
        assert set(found.edges) == set(graph.edges)
        for a, b, data in graph.edges(data=True):
            assert found.edges[a, b]["count"] == data["count"]
            assert found.edges[a, b]["nats"] == data["weight"]
            assert found.edges[a, b]["weight"] == pytest.approx(np.exp(-data["weight"]))
        for state, data in graph.nodes(data=True):
            assert tuple(found.nodes[state][axis] for axis in "xyzw") == data["orientation"]
            assert found.nodes[state]["label"] == data["label"]


@pytest.mark.parametrize("suffix", GRAPHS)
def test_the_command_writes_the_same_bytes_again(suffix: str, run: Run) -> None:
    for name in ("one", "two"):
        ran = run("graph", "--corpus", "walk-hexapod", "--joint", "left_fore_coxa", "-o", f"{name}{suffix}")
        assert (ran.code, ran.err) == (0, "")
        assert ran.out.startswith(f"{name}{suffix}: left_fore_coxa, 9 states, ")
    assert Path(f"one{suffix}").read_bytes() == Path(f"two{suffix}").read_bytes()


def test_one_state_is_one(run: Run) -> None:
    motion = ballet_clip("jump")
    write_motion("still.json", replace(motion, rotations=np.repeat(motion.rotations[:1], len(motion), axis=0)))
    assert run("corpus", "build", "still", "still.json").code == 0
    ran = run("graph", "--corpus", "still", "--joint", "left_hip", "-o", "hip.svg")
    assert ran.out == "hip.svg: left_hip, 1 state, 1 transition; 1 isolated state\n"


def test_what_cannot_be_drawn_is_refused_in_a_line(run: Run, tmp_path: Path) -> None:
    for words, fault in (
        (("--corpus", "ballet", "--joint", "wing", "-o", "a.svg"), "no joint 'wing'"),
        (("--corpus", "ballet", "--joint", "facing", "-o", "a.svg"), "no joint 'facing'"),
        (("--corpus", "gone", "--joint", "left_hip", "-o", "a.svg"), "no corpus 'gone'"),
        (("--corpus", "ballet", "--joint", "left_hip", "-o", "a.pdf"), "must end in one of .svg, .png, .graphml"),
    ):
        ran = run("graph", *words)
        assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
        assert fault in ran.err
    with pytest.raises(MotionMindError, match=r"a graph is written as one of \.svg"):
        write_graph(tmp_path / "a.txt", toy([(0, 1)], 2))


def test_names_that_xml_cannot_hold_are_written_as_it_can() -> None:
    graph = toy([(0, 1), (1, 0)], 2)
    graph.nodes[0]["label"] = 'a<b & "c"\x01'
    ElementTree.fromstring(svg(graph_plate(graph)))
