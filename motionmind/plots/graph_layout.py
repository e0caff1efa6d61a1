"""The layout of a joint graph: legible places of its states and transitions on the page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, hypot, sqrt
from typing import TYPE_CHECKING

import numpy as np

from motionmind._typing import Floats
from motionmind.corpus.corpus import FACING
from motionmind.display import displayed
from motionmind.geometry import rotations as rot
from motionmind.plots.brush import Point, as_point
from motionmind.plots.marks import LETTER_WIDTH_RATIO
from motionmind.plots.scene import Labels

if TYPE_CHECKING:
    import networkx as nx

NAME_PX, HEADING_PX = 11, 17  # heights of the letters of names and of the heading
MARGIN_PX = 40.0  # around the picture

_STEP_PX = 90.0  # median distance between states that a transition joins
_HEAD_PX = 56.0  # height of the text above the graph


@dataclass(frozen=True)
class Circle:
    """A state.

    Attributes:
        at, radius: its centre and radius, pixels.
        stays: the probability that it stays.
        name: its name.
        words_at: the middle of the left edge of its name, pixels; None if there is no room for the name.
        title: the facts about it, in lines.
    """

    at: Point
    radius: float
    stays: float
    name: str
    words_at: Point | None
    title: str


@dataclass(frozen=True)
class Arrow:
    """A transition.

    Attributes:
        curve: the control points of its quadratic curve.
        head: the corners of its head.
        width: width of the curve, pixels.
        opacity: its opacity, 0 to 1.
        title: the facts about it.
    """

    curve: tuple[Point, Point, Point]
    head: tuple[Point, Point, Point]
    width: float
    opacity: float
    title: str


@dataclass(frozen=True)
class GraphLayout:
    """The picture of a joint graph.

    Attributes:
        width, height: size, pixels.
        heading, legend: the text above it.
        circles: the states.
        arrows: the transitions, the likeliest last.
    """

    width: int
    height: int
    heading: str
    legend: str
    circles: tuple[Circle, ...]
    arrows: tuple[Arrow, ...]


def lay_out(graph: nx.DiGraph) -> GraphLayout:
    """Lay out a joint graph, as from `Engine.joint_graph`.

    States without a transition to or from another are left out; the heading counts them.
    """
    shown = [state for state in graph if any(other != state for other in (*graph.succ[state], *graph.pred[state]))]
    visits = np.array([graph.nodes[state]["visits"] for state in shown])
    radii = 5.0 + (20.0 - 5.0) * np.sqrt(visits / visits.max()) if shown else np.zeros(0)  # pixels
    names = _names(graph, shown)
    letters = float(np.mean([len(name) for name in names])) if names else 0.0
    places = _separate(_place_states(graph, shown), radii, 14.0 + 1.6 * letters)  # a gap for names, pixels
    low = (places - radii[:, None]).min(axis=0) if shown else np.zeros(2)
    places = places - low + (MARGIN_PX, MARGIN_PX + _HEAD_PX)
    radius, place = dict(zip(shown, radii, strict=True)), dict(zip(shown, places, strict=True))
    heading, legend = _words(graph, len(graph) - len(shown))
    words_at = _place_names(places, radii, names)
    circles = tuple(
        Circle(
            as_point(place[state]),
            float(radius[state]),
            probability(graph, state, state),
            name,
            at,
            _facts(graph, state),
        )
        for state, name, at in zip(shown, names, words_at, strict=True)
    )
    pairs = sorted(((a, b) for a, b in graph.edges if a != b), key=lambda pair: probability(graph, *pair))
    arrows = tuple(_arrow(graph, a, b, place, radius) for a, b in pairs)
    ends = [(*circle.at, circle.radius) for circle in circles]
    rights = [x + r for x, _, r in ends] + [at[0] + _width(n) for n, at in zip(names, words_at, strict=True) if at]
    right = max(*rights, LETTER_WIDTH_RATIO * HEADING_PX * len(heading), _width(legend) + MARGIN_PX)
    bottom = max([y + r for _, y, r in ends], default=MARGIN_PX + _HEAD_PX)
    return GraphLayout(ceil(right + MARGIN_PX), ceil(bottom + MARGIN_PX), heading, legend, circles, arrows)


# --- where the states lie ---------------------------------------------------------------------------------------------


def _place_states(graph: nx.DiGraph, shown: Sequence[int]) -> Floats:
    """Place states on the page [N, 2], pixels: those of the facing on a circle, others by connected components."""
    import networkx as nx

    count = len(shown)
    if graph.graph["joint"] == FACING:
        turns = rot.heading(_orientations(graph, shown))
        radius = max(220.0, 64.0 * count / (2.0 * np.pi))  # neighbours 64 pixels apart
        # Seen from above, the audience below: a body that faces the audience faces down the page.
        return radius * np.stack([np.sin(turns), np.cos(turns)], axis=1)
    joined = nx.Graph((a, b) for a, b in graph.edges if a != b)
    parts = [sorted(part) for part in sorted(nx.connected_components(joined), key=lambda part: (-len(part), min(part)))]
    row = {state: number for number, state in enumerate(shown)}
    places = np.zeros((count, 2))
    x = y = high = 0.0
    widest = 0.0
    for part in parts:
        here = _place_component(joined.subgraph(part), part, _orientations(graph, part))
        here = here - here.min(axis=0)
        across, down = here.max(axis=0)
        widest = max(widest, across)
        if x > 0.0 and x + across > widest:
            x, y, high = 0.0, y + high + _STEP_PX, 0.0
        places[[row[state] for state in part]] = here + np.array([x, y])
        x, high = x + across + _STEP_PX, max(high, down)
    return places


def _place_component(part: nx.Graph, states: Sequence[int], orientations: Floats) -> Floats:
    """Place the states of a connected component [N, 2], pixels, by distances along the graph.

    Distances on the page approximate those along the graph (Kamada & Kawai, "An algorithm for drawing general
    undirected graphs", Information Processing Letters 31, 1989), where a transition is longer the farther it turns.
    States of similar orientation so lie near each other, as with placement by orientation alone, but with half the
    crossings, as few as with transitions of equal length. Classical multidimensional scaling gives the start.
    """
    import networkx as nx
    from scipy.sparse.csgraph import shortest_path

    if len(states) < 3:
        return np.asarray(np.arange(len(states))[:, None] * np.array([_STEP_PX, 0.0]))
    row = {state: number for number, state in enumerate(states)}
    a, b = np.array([(row[s], row[t]) for s, t in part.edges]).T
    angles = rot.angle(orientations[a], orientations[b])
    lengths = np.zeros((len(states), len(states)))
    lengths[a, b] = 0.5 + 0.5 * angles / max(float(np.median(angles)), 1e-6)
    far = shortest_path(lengths, directed=False)
    centred = np.eye(len(states)) - 1.0 / len(states)
    values, vectors = np.linalg.eigh(-0.5 * centred @ far**2 @ centred)
    start = vectors[:, -2:] * np.sqrt(np.maximum(values[-2:], 1e-9))
    # The sign of an eigenvector is arbitrary; fix it.
    start *= np.where(start[np.abs(start).argmax(axis=0), [0, 1]] < 0.0, -1.0, 1.0)
    layout = nx.kamada_kawai_layout(
        part,
        dist={s: dict(zip(states, far[row[s]], strict=True)) for s in states},
        pos=dict(zip(states, start, strict=True)),
    )
    places = np.array([layout[state] for state in states])
    apart = np.linalg.norm(places[a] - places[b], axis=1)
    places *= _STEP_PX / max(float(np.median(apart)), 1e-9)
    # The longest extent lies across the page.
    across = np.linalg.svd(places - places.mean(axis=0), full_matrices=False)[2]
    return np.asarray(places @ across.T, dtype=np.float64)


def _separate(places: Floats, radii: Floats, gap: float) -> Floats:
    """Move circles [N, 2] apart until there is a gap between any two."""
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


def _place_names(places: Floats, radii: Floats, names: Sequence[str]) -> list[Point | None]:
    """Place each name right, left, below or above its circle, covering no circle and no other name.

    Larger circles come first.

    Returns:
        For each name the middle of its left edge, pixels; None if there is no room.
    """
    labels = Labels(places, radii[:, None])
    places_of_names: list[Point | None] = [None] * len(names)
    for number in np.argsort(-radii, kind="stable"):
        (x, y), r, width, half = places[number], radii[number] + 3.0, _width(names[number]), 0.5 * NAME_PX + 1.0
        candidates = (
            *((x + r, y), (x - r - width, y), (x - 0.5 * width, y + r + half), (x - 0.5 * width, y - r - half)),
            *((x + 0.7 * r, y - 0.7 * r - half), (x + 0.7 * r, y + 0.7 * r + half)),
        )
        places_of_names[number] = labels.place([one for one in candidates if one[0] > 0.0], width, half)
    return places_of_names


def _orientations(graph: nx.DiGraph, states: Sequence[int]) -> Floats:
    return np.array([graph.nodes[state]["orientation"] for state in states]).reshape(-1, 4)


# --- circles, arrows and words ----------------------------------------------------------------------------------------


def _arrow(graph: nx.DiGraph, a: int, b: int, place: dict[int, Floats], radius: dict[int, float]) -> Arrow:
    """Draw the arrow of a transition between two circles."""
    chance = probability(graph, a, b)
    start, end = place[a], place[b]
    along = end - start
    # It bends to its left, which separates the two directions.
    bent = 0.5 * (start + end) + 0.14 * np.array([along[1], -along[0]])
    width, size = 0.6 + 2.6 * chance, 5.0 + 4.0 * chance
    into = (end - bent) / max(hypot(*(end - bent)), 1e-9)
    tip = end - (radius[b] + 1.0) * into
    base, side = tip - size * into, 0.45 * size * np.array([into[1], -into[0]])
    away = (bent - start) / max(hypot(*(bent - start)), 1e-9)
    names = [displayed(graph.nodes[state]["label"]) for state in (a, b)]
    data = graph.edges[a, b]
    return Arrow(
        (as_point(start + radius[a] * away), as_point(bent), as_point(base)),
        (as_point(tip), as_point(base + side), as_point(base - side)),
        width,
        0.22 + 0.68 * sqrt(chance),
        f"{names[0]} -> {names[1]}: {chance:.1%}, seen {data['count']:g} times, {data['seconds']:.2f} s",
    )


def probability(graph: nx.DiGraph, a: int, b: int) -> float:
    """Return P(b next | a); 0 without such a transition."""
    return float(np.exp(-graph.edges[a, b]["weight"])) if graph.has_edge(a, b) else 0.0


def _names(graph: nx.DiGraph, states: Sequence[int]) -> list[str]:
    """Return the names of states: their labels, or the direction that the body faces."""
    if graph.graph["joint"] == FACING:
        return [f"{turn:.0f}°" for turn in np.degrees(rot.heading(_orientations(graph, states))).round() + 0.0]
    return [displayed(graph.nodes[state]["label"].removeprefix("state "), 40) for state in states]


def _facts(graph: nx.DiGraph, state: int) -> str:
    """List the facts about a state: visits, successors, and the parent joint's states that occur with it."""
    data = graph.nodes[state]
    lines = [f"{displayed(data['label'])}: {data['visits']:g} visits, stays {probability(graph, state, state):.0%}"]
    after = sorted(
        ((probability(graph, state, t), t) for t in graph.succ[state] if t != state), key=lambda p: (-p[0], p[1])
    )
    lines += [f"then {displayed(graph.nodes[t]['label'])} {chance:.0%}" for chance, t in after[:3]]
    lines += [
        f"{chance:.0%} where {displayed(graph.graph['parent'])} is {displayed(above)}"
        for above, chance in data.get("given", ())
    ]
    return "\n".join(lines)


def _words(graph: nx.DiGraph, left_out: int) -> tuple[str, str]:
    """Return the heading and the legend."""
    between = sum(a != b for a, b in graph.edges)
    heading = (
        f"{displayed(graph.graph['joint'])} ({displayed(graph.graph['corpus'])}): "
        f"{len(graph)} state{'s' * (len(graph) != 1)}, {between} transition{'s' * (between != 1)} between them"
    )
    if left_out:
        heading += f"; {left_out} that no transition joins left out"
    legend = "circle: how often; gold ring: how likely it stays; arrow: how likely it is next"
    return heading, legend


def _width(name: str) -> float:
    """Estimate the width of a name, pixels."""
    return LETTER_WIDTH_RATIO * NAME_PX * len(name)
