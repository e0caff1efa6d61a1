"""A joint graph as a picture: its states as circles, its transitions as arrows, laid out so that it can be read."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from io import BytesIO
from math import ceil, hypot, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from motionmind._typing import Floats
from motionmind.corpus.corpus import FACING
from motionmind.errors import MotionMindError
from motionmind.files import FilePath, write_atomically
from motionmind.geometry import rotations as rot
from motionmind.plots.canvas import (
    LETTER,
    Colour,
    Point,
    font,
    hexadecimal,
    mixed,
    plain,
)
from motionmind.render.ground import PAPER

if TYPE_CHECKING:
    import networkx as nx


GRAPHS = (".svg", ".png", ".graphml", ".gexf")  # how the files end that `write_graph` writes

_STEP = 90.0  # pixels between states that a usual transition joins
_APART = 14.0  # pixels between circles at least, and so many more for each letter of a usual name
_APART_A_LETTER = 1.6
_ON_RING = 64.0  # pixels between states of the facing
_SMALL, _LARGE = 5.0, 20.0  # radii of the least and of the most visited state
_BEND = 0.14  # how far an arrow bends to its left, by its length, so that both ways can be told apart
_MARGIN, _HEAD = 40.0, 56.0  # pixels around the picture, and for the words above it
_LETTERS = 11  # height of a name in pixels
_TITLE = 17
_FINE = 3  # samples to a pixel of a PNG, along each side
_NODE: Colour = (58, 104, 160)
_STAY: Colour = (214, 158, 66)
_ARROW: Colour = (40, 46, 60)
_WORDS: Colour = (34, 30, 34)
_PALE: Colour = (110, 106, 104)


@dataclass(frozen=True)
class Circle:
    """A state: where it is and how large, pixels; how likely it stays; its name, and where that begins, if it has room;
    and what is to be said of it."""

    at: Point
    radius: float
    stays: float
    name: str
    words_at: Point | None
    title: str


@dataclass(frozen=True)
class Arrow:
    """A transition: a quadratic curve by its three points, its head, and how wide and how dark it is."""

    curve: tuple[Point, Point, Point]
    head: tuple[Point, Point, Point]
    width: float
    opacity: float
    title: str


@dataclass(frozen=True)
class GraphLayout:
    """All that is in a picture of a joint graph."""

    width: int
    height: int
    heading: str
    legend: str
    circles: tuple[Circle, ...]
    arrows: tuple[Arrow, ...]


def write_graph(path: FilePath, graph: nx.DiGraph) -> None:
    """Write a joint graph, as `Engine.joint_graph` makes it: .svg and .png are pictures; .graphml and .gexf are for
    programs, with all states.

    Raises:
        MotionMindError: the suffix is none of these, or the file cannot be written.
    """
    suffix = re.sub(r".*(?=\.)", "", str(path)).lower()
    if suffix not in GRAPHS:
        raise MotionMindError(f"{path}: a graph is written as one of {', '.join(GRAPHS)}")
    if suffix in (".svg", ".png"):
        drawing = draw(graph)
        write_atomically(path, svg(drawing).encode() if suffix == ".svg" else png(drawing))
        return
    import networkx as nx

    data = BytesIO()
    (nx.write_graphml if suffix == ".graphml" else nx.write_gexf)(_flat(graph), data)
    write_atomically(path, data.getvalue())


def draw(graph: nx.DiGraph) -> GraphLayout:
    """Lay a joint graph out. States that no transition joins to another are left out, and counted in the heading."""
    shown = [state for state in graph if any(other != state for other in (*graph.succ[state], *graph.pred[state]))]
    visits = np.array([graph.nodes[state]["visits"] for state in shown])
    radii = _SMALL + (_LARGE - _SMALL) * np.sqrt(visits / visits.max()) if shown else np.zeros(0)
    names = _names(graph, shown)
    letters = float(np.mean([len(name) for name in names])) if names else 0.0
    places = _apart(_layout(graph, shown), radii, _APART + _APART_A_LETTER * letters)
    low = (places - radii[:, None]).min(axis=0) if shown else np.zeros(2)
    places = places - low + (_MARGIN, _MARGIN + _HEAD)
    radius, place = dict(zip(shown, radii, strict=True)), dict(zip(shown, places, strict=True))
    heading, legend = _words(graph, len(graph) - len(shown))
    words_at = _beside(places, radii, names)
    circles = tuple(
        Circle(_point(place[state]), float(radius[state]), _chance(graph, state, state), name, at, _told(graph, state))
        for state, name, at in zip(shown, names, words_at, strict=True)
    )
    pairs = sorted(((a, b) for a, b in graph.edges if a != b), key=lambda pair: _chance(graph, *pair))
    arrows = tuple(_arrow(graph, a, b, place, radius) for a, b in pairs)
    ends = [(*circle.at, circle.radius) for circle in circles]
    right = max([x + r for x, _, r in ends] + [at[0] + _long(n) for n, at in zip(names, words_at, strict=True) if at]
                + [LETTER * _TITLE * len(heading), _long(legend) + _MARGIN], default=0.0)  # fmt: skip
    bottom = max([y + r for _, y, r in ends], default=_MARGIN + _HEAD)
    return GraphLayout(ceil(right + _MARGIN), ceil(bottom + _MARGIN), heading, legend, circles, arrows)


def svg(drawing: GraphLayout) -> str:
    """The picture as SVG; what is known of a state or a transition shows under the pointer."""
    text = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {drawing.width} {drawing.height}"'
        f' width="{drawing.width}" height="{drawing.height}" role="img"'
        f' font-family="system-ui,Helvetica,Arial,sans-serif" font-size="{_LETTERS}">',
        f"<title>{plain(drawing.heading)}</title>",
        f'<rect width="100%" height="100%" fill="{hexadecimal(PAPER)}"/>',
        f'<text x="{_MARGIN:g}" y="{_MARGIN:g}" font-size="{_TITLE}" fill="{hexadecimal(_WORDS)}">'
        f"{plain(drawing.heading)}</text>",
        f'<text x="{_MARGIN:g}" y="{_MARGIN + 20:g}" fill="{hexadecimal(_PALE)}">{plain(drawing.legend)}</text>',
        f'<g fill="none" stroke="{hexadecimal(_ARROW)}" stroke-linecap="round">',
    ]
    for arrow in drawing.arrows:
        (a, b), (c, d), (e, f) = arrow.curve
        head = " ".join(f"{x:.1f},{y:.1f}" for x, y in arrow.head)
        text.append(
            f'<g opacity="{arrow.opacity:.2f}"><title>{plain(arrow.title)}</title>'
            f'<path d="M{a:.1f} {b:.1f}Q{c:.1f} {d:.1f} {e:.1f} {f:.1f}" stroke-width="{arrow.width:.2f}"/>'
            f'<polygon points="{head}" fill="{hexadecimal(_ARROW)}" stroke="none"/></g>'
        )
    text.append("</g>")
    for circle in drawing.circles:
        (x, y), ring = circle.at, _ring(circle)
        text.append(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{circle.radius - 0.5 * ring:.2f}" fill="{hexadecimal(_NODE)}"'
            f' stroke="{hexadecimal(_STAY)}" stroke-width="{ring:.2f}"><title>{plain(circle.title)}</title></circle>'
        )
    text.append(f'<g fill="{hexadecimal(_WORDS)}" stroke="{hexadecimal(PAPER)}" stroke-width="3" paint-order="stroke">')
    for circle in drawing.circles:
        if circle.words_at:
            x, y = circle.words_at
            text.append(f'<text x="{x:.1f}" y="{y:.1f}" dy=".35em" pointer-events="none">{plain(circle.name)}</text>')
    return "\n".join([*text, "</g>", "</svg>"]) + "\n"


def png(drawing: GraphLayout) -> bytes:
    """The picture as PNG."""
    from PIL import Image, ImageDraw

    k = _FINE
    image = Image.new("RGB", (k * drawing.width, k * drawing.height), PAPER)
    pen = ImageDraw.Draw(image)
    for arrow in drawing.arrows:
        ink = mixed(_ARROW, arrow.opacity)
        pen.line([(k * x, k * y) for x, y in _along(arrow.curve)], ink, max(1, round(k * arrow.width)), joint="curve")
        pen.polygon([(k * x, k * y) for x, y in arrow.head], ink)
    for circle in drawing.circles:
        (x, y), ring = circle.at, _ring(circle)
        for r, ink in ((circle.radius, _STAY), (circle.radius - ring, _NODE)):
            pen.ellipse((k * (x - r), k * (y - r), k * (x + r), k * (y + r)), ink)
    words = [(circle.name, circle.words_at, _LETTERS, _WORDS) for circle in drawing.circles if circle.words_at]
    words.append((drawing.heading, (_MARGIN, _MARGIN - 0.35 * _TITLE), _TITLE, _WORDS))
    words.append((drawing.legend, (_MARGIN, _MARGIN + 20 - 0.35 * _LETTERS), _LETTERS, _PALE))
    for name, (x, y), letters, ink in words:
        pen.text((k * x, k * y), name, ink, font(k * letters), anchor="lm", stroke_width=2 * k, stroke_fill=PAPER)
    data = BytesIO()
    image.resize((drawing.width, drawing.height), Image.Resampling.BOX).save(data, "PNG", optimize=True)
    return data.getvalue()


# --- where the states lie ---------------------------------------------------------------------------------------------


def _layout(graph: nx.DiGraph, shown: Sequence[int]) -> Floats:
    """Places [N, 2] of states, pixels: those of the facing on a circle, of others each connected part on its own."""
    import networkx as nx

    count = len(shown)
    if graph.graph["joint"] == FACING:
        turns = rot.heading(_orientations(graph, shown))
        radius = max(220.0, _ON_RING * count / (2.0 * np.pi))
        # As seen from above, with the front of the stage below: a body that faces the public looks down the page.
        return radius * np.stack([np.sin(turns), np.cos(turns)], axis=1)
    joined = nx.Graph((a, b) for a, b in graph.edges if a != b)
    parts = [sorted(part) for part in sorted(nx.connected_components(joined), key=lambda part: (-len(part), min(part)))]
    row = {state: number for number, state in enumerate(shown)}
    places = np.zeros((count, 2))
    x = y = high = 0.0
    widest = 0.0
    for part in parts:
        here = _untangled(joined.subgraph(part), part, _orientations(graph, part))
        here = here - here.min(axis=0)
        across, down = here.max(axis=0)
        widest = max(widest, across)
        if x > 0.0 and x + across > widest:
            x, y, high = 0.0, y + high + _STEP, 0.0
        places[[row[state] for state in part]] = here + np.array([x, y])
        x, high = x + across + _STEP, max(high, down)
    return places


def _untangled(part: nx.Graph, states: Sequence[int], orientations: Floats) -> Floats:
    """Places [N, 2] of a connected part, pixels, such that distances on the page come as near as they can to those
    along the graph (Kamada & Kawai 1989), where a transition is the longer the farther it turns.

    So states of like orientation lie near each other, as they would by their orientations alone, and arrows cross as
    little as where all are of one length, which is half as often. It begins where classical scaling puts the states.
    """
    import networkx as nx
    from scipy.sparse.csgraph import shortest_path

    if len(states) < 3:
        return np.asarray(np.arange(len(states))[:, None] * np.array([_STEP, 0.0]))
    row = {state: number for number, state in enumerate(states)}
    a, b = np.array([(row[s], row[t]) for s, t in part.edges]).T
    angles = rot.angle(orientations[a], orientations[b])
    lengths = np.zeros((len(states), len(states)))
    lengths[a, b] = 0.5 + 0.5 * angles / max(float(np.median(angles)), 1e-6)
    far = shortest_path(lengths, directed=False)
    centred = np.eye(len(states)) - 1.0 / len(states)
    values, vectors = np.linalg.eigh(-0.5 * centred @ far**2 @ centred)
    start = vectors[:, -2:] * np.sqrt(np.maximum(values[-2:], 1e-9))
    start *= np.where(
        start[np.abs(start).argmax(axis=0), [0, 1]] < 0.0, -1.0, 1.0
    )  # a vector's sign is nobody's choice
    found = nx.kamada_kawai_layout(
        part,
        dist={s: dict(zip(states, far[row[s]], strict=True)) for s in states},
        pos=dict(zip(states, start, strict=True)),
    )
    places = np.array([found[state] for state in states])
    apart = np.linalg.norm(places[a] - places[b], axis=1)
    places *= _STEP / max(float(np.median(apart)), 1e-9)
    # The longest way lies across the page.
    across = np.linalg.svd(places - places.mean(axis=0), full_matrices=False)[2]
    return np.asarray(places @ across.T, dtype=np.float64)


def _apart(places: Floats, radii: Floats, gap: float) -> Floats:
    """The places, moved so that there is a gap between any two circles."""
    places = places.copy()
    for _ in range(200):
        between = places[:, None] - places[None]
        far = np.linalg.norm(between, axis=-1)
        lacking = np.maximum(radii[:, None] + radii[None] + gap - far, 0.0)
        np.fill_diagonal(lacking, 0.0)
        if not lacking.any():
            break
        places += ((0.5 * lacking / np.maximum(far, 1e-3))[..., None] * between).sum(axis=1)
    return places


def _beside(places: Floats, radii: Floats, names: Sequence[str]) -> list[Point | None]:
    """Where each name begins, in the middle of its height: right, left, below or above its circle, where it covers no
    circle and no other name; None where there is no room. The most visited states choose first."""
    boxes = np.concatenate([places - radii[:, None], places + radii[:, None]], axis=1)  # left, top, right, bottom
    found: list[Point | None] = [None] * len(names)
    for number in np.argsort(-radii, kind="stable"):
        (x, y), r, long, half = places[number], radii[number] + 3.0, _long(names[number]), 0.5 * _LETTERS + 1.0
        for left, middle in (
            *((x + r, y), (x - r - long, y), (x - 0.5 * long, y + r + half), (x - 0.5 * long, y - r - half)),
            *((x + 0.7 * r, y - 0.7 * r - half), (x + 0.7 * r, y + 0.7 * r + half)),
        ):
            box = np.array([left, middle - half, left + long, middle + half])
            covers = (boxes[:, :2] < box[2:]).all(axis=1) & (boxes[:, 2:] > box[:2]).all(axis=1)
            if left > 0.0 and not covers.any():
                found[number] = (float(left), float(middle))
                boxes = np.concatenate([boxes, box[None]])
                break
    return found


def _orientations(graph: nx.DiGraph, states: Sequence[int]) -> Floats:
    return np.array([graph.nodes[state]["orientation"] for state in states]).reshape(-1, 4)


# --- what is drawn ----------------------------------------------------------------------------------------------------


def _arrow(graph: nx.DiGraph, a: int, b: int, place: dict[int, Floats], radius: dict[int, float]) -> Arrow:
    """The arrow of a transition between two circles."""
    chance = _chance(graph, a, b)
    start, end = place[a], place[b]
    along = end - start
    bent = 0.5 * (start + end) + _BEND * np.array([along[1], -along[0]])
    width, size = 0.6 + 2.6 * chance, 5.0 + 4.0 * chance
    into = (end - bent) / max(hypot(*(end - bent)), 1e-9)
    tip = end - (radius[b] + 1.0) * into
    base, side = tip - size * into, 0.45 * size * np.array([into[1], -into[0]])
    away = (bent - start) / max(hypot(*(bent - start)), 1e-9)
    names = [graph.nodes[state]["label"] for state in (a, b)]
    data = graph.edges[a, b]
    return Arrow(
        (_point(start + radius[a] * away), _point(bent), _point(base)),
        (_point(tip), _point(base + side), _point(base - side)),
        width,
        0.22 + 0.68 * sqrt(chance),
        f"{names[0]} -> {names[1]}: {chance:.1%}, seen {data['count']:g} times, {data['seconds']:.2f} s",
    )


def _chance(graph: nx.DiGraph, a: int, b: int) -> float:
    """P(b next | a); 0 where there is no such transition."""
    return float(np.exp(-graph.edges[a, b]["weight"])) if graph.has_edge(a, b) else 0.0


def _names(graph: nx.DiGraph, states: Sequence[int]) -> list[str]:
    """What is written beside states: their names or numbers, or where the body faces."""
    if graph.graph["joint"] == FACING:
        return [f"{turn:.0f}°" for turn in np.degrees(rot.heading(_orientations(graph, states))).round() + 0.0]
    return [graph.nodes[state]["label"].removeprefix("state ") for state in states]


def _told(graph: nx.DiGraph, state: int) -> str:
    """What is known of a state: how often, where to, and which states of the joint's parent go with it."""
    data = graph.nodes[state]
    lines = [f"{data['label']}: {data['visits']:g} visits, stays {_chance(graph, state, state):.0%}"]
    after = sorted(
        ((_chance(graph, state, t), t) for t in graph.succ[state] if t != state), key=lambda p: (-p[0], p[1])
    )
    lines += [f"then {graph.nodes[t]['label']} {chance:.0%}" for chance, t in after[:3]]
    lines += [f"{chance:.0%} where {graph.graph['parent']} is {above}" for above, chance in data.get("given", ())]
    return "\n".join(lines)


def _words(graph: nx.DiGraph, left_out: int) -> tuple[str, str]:
    """The heading and the legend."""
    between = sum(a != b for a, b in graph.edges)
    heading = (
        f"{graph.graph['joint']} ({graph.graph['corpus']}): {len(graph)} states, {between} transitions between them"
    )
    if left_out:
        heading += f"; {left_out} that no transition joins left out"
    legend = "circle: how often; gold ring: how likely it stays; arrow: how likely it is next"
    return heading, legend


def _ring(circle: Circle) -> float:
    """How wide a state's ring is."""
    return 0.5 * circle.radius * circle.stays


def _along(curve: tuple[Point, Point, Point]) -> Iterator[Point]:
    """Points on a quadratic curve."""
    a, b, c = map(np.array, curve)
    for t in np.linspace(0.0, 1.0, 17):
        yield _point((1.0 - t) ** 2 * a + 2.0 * t * (1.0 - t) * b + t * t * c)


def _flat(graph: nx.DiGraph) -> nx.DiGraph:
    """The graph with numbers and words alone, as files for other programs have them."""
    import networkx as nx

    out = nx.DiGraph(**{key: value for key, value in graph.graph.items() if value is not None})
    for state, data in graph.nodes(data=True):
        x, y, z, w = data["orientation"]
        given = "; ".join(f"{above} {chance:.4f}" for above, chance in data.get("given", ()))
        out.add_node(state, label=data["label"], visits=data["visits"], x=x, y=y, z=z, w=w, given=given)
    for a, b, data in graph.edges(data=True):
        # Of GEXF's own attribute "weight" more means nearer: it is the probability, and the nats go by their own name.
        out.add_edge(
            a, b, weight=_chance(graph, a, b), nats=data["weight"], count=data["count"], seconds=data["seconds"]
        )
    return out


def _point(at: Any) -> Point:
    return float(at[0]), float(at[1])


def _long(name: str) -> float:
    """About how many pixels a name takes."""
    return LETTER * _LETTERS * len(name)
