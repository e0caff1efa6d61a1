"""A joint graph as a picture, with states as circles and transitions as arrows, or as a file for other programs."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from typing import TYPE_CHECKING

import numpy as np

from motionmind.arguments import check_path, check_type
from motionmind.body.palette import Colour
from motionmind.errors import MotionMindError
from motionmind.files import FilePath, write_atomically
from motionmind.plots.brush import Brush, Point, mixed
from motionmind.plots.canvas import Plate
from motionmind.plots.graph_layout import HEADING_PX, MARGIN_PX, NAME_PX, Arrow, Circle, lay_out, probability
from motionmind.plots.marks import Group
from motionmind.render.lettering import FONT_FAMILY
from motionmind.render.markup import hexadecimal, xml_text
from motionmind.render.palette import INK, PAPER, PLOT

if TYPE_CHECKING:
    import networkx as nx

    from motionmind.tween.engine import Engine

GRAPHS = (".svg", ".png", ".graphml", ".gexf")  # suffixes that `draw_joint_graph` writes

_PNG_HALO_PX = 2.0  # width of the paper around text


def draw_joint_graph(path: FilePath, engine: Engine, joint: str) -> nx.DiGraph:
    """Write what an engine's corpus teaches of a joint: its states, and how likely each follows another.

    `.svg` and `.png` are pictures: larger circles are visited more often, darker arrows are likelier, and states that
    no transition joins to another are left out. `.graphml` and `.gexf` are for other programs, with all states.

    Args:
        path: the file.
        engine: the engine.
        joint: the joint's name; or "facing", if the corpus has that as a joint chain of its own.

    Returns:
        The graph, as from `Engine.joint_graph`.

    Raises:
        MotionMindError: the suffix is unknown, the corpus has no such joint, or the file cannot be written.

    >>> from motionmind import Engine
    >>> from motionmind.plots import draw_joint_graph
    >>> graph = draw_joint_graph("hip.svg", Engine.load("ballet"), "left_hip")
    >>> graph.graph["joint"]
    'left_hip'
    """
    # Imported here: numba is slow to import, and drawing an existing graph does not need it.
    from motionmind.tween.engine import Engine

    check_path("path", path)
    check_type("engine", engine, Engine)
    graph = engine.joint_graph(joint)
    write_graph(path, graph)
    return graph


def write_graph(path: FilePath, graph: nx.DiGraph) -> None:
    """Write a joint graph as `draw_joint_graph` does.

    Args:
        path: the file.
        graph: the graph, as from `Engine.joint_graph`.

    Raises:
        MotionMindError: the suffix is unknown, or the file cannot be written.
    """
    suffix = re.sub(r".*(?=\.)", "", str(path)).lower()
    if suffix not in GRAPHS:
        raise MotionMindError(f"{path}: a graph is written as one of {', '.join(GRAPHS)}")
    if suffix in (".svg", ".png"):
        write_atomically(path, graph_plate(graph).encode(suffix))
        return
    import networkx as nx

    data = BytesIO()
    (nx.write_graphml if suffix == ".graphml" else nx.write_gexf)(_to_export(graph), data)
    write_atomically(path, data.getvalue())


def graph_plate(graph: nx.DiGraph) -> Plate:
    """Draw a joint graph, as from `Engine.joint_graph`."""
    layout = lay_out(graph)
    names = [_Name(circle.words_at, circle.name) for circle in layout.circles if circle.words_at]
    return Plate(
        layout.width,
        layout.height,
        layout.heading,
        (
            Group(
                f'fill="none" stroke="{hexadecimal(PLOT.transition)}" stroke-linecap="round"',
                tuple(_Transition(arrow) for arrow in layout.arrows),
            ),
            *(_State(circle) for circle in layout.circles),
            Group(
                f'fill="{hexadecimal(INK)}" stroke="{hexadecimal(PAPER)}" stroke-width="3" paint-order="stroke"',
                tuple(names),
            ),
        ),
        headings=(
            _Heading((MARGIN_PX, MARGIN_PX), layout.heading, HEADING_PX, INK),
            _Heading((MARGIN_PX, MARGIN_PX + 20), layout.legend, NAME_PX, PLOT.pale),
        ),
        style=f'{FONT_FAMILY} font-size="{NAME_PX}"',
    )


@dataclass(frozen=True)
class _Transition:
    """The mark of a transition."""

    arrow: Arrow

    def svg(self) -> Iterator[str]:
        arrow = self.arrow
        (a, b), (c, d), (e, f) = arrow.curve
        head = " ".join(f"{x:.1f},{y:.1f}" for x, y in arrow.head)
        yield (
            f'<g opacity="{arrow.opacity:.2f}"><title>{xml_text(arrow.title)}</title>'
            f'<path d="M{a:.1f} {b:.1f}Q{c:.1f} {d:.1f} {e:.1f} {f:.1f}" stroke-width="{arrow.width:.2f}"/>'
            f'<polygon points="{head}" fill="{hexadecimal(PLOT.transition)}" stroke="none"/></g>'
        )

    def paint(self, brush: Brush) -> None:
        ink = mixed(PLOT.transition, self.arrow.opacity)
        a, b, c = map(np.array, self.arrow.curve)
        shares = np.linspace(0.0, 1.0, 17)
        points = np.array([(1.0 - t) ** 2 * a + 2.0 * t * (1.0 - t) * b + t * t * c for t in shares])
        brush.line(points, ink, self.arrow.width)
        brush.polygon(np.array(self.arrow.head), ink)


@dataclass(frozen=True)
class _State:
    """The mark of a state: a disc, and a ring that is wider the likelier it stays."""

    circle: Circle

    @property
    def ring(self) -> float:
        """Width of the ring, pixels."""
        return 0.5 * self.circle.radius * self.circle.stays

    def svg(self) -> Iterator[str]:
        (x, y), ring = self.circle.at, self.ring
        radius, fill, stroke = self.circle.radius - 0.5 * ring, hexadecimal(PLOT.state), hexadecimal(PLOT.stays)
        yield (
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:.2f}" fill="{fill}" stroke="{stroke}"'
            f' stroke-width="{ring:.2f}"><title>{xml_text(self.circle.title)}</title></circle>'
        )

    def paint(self, brush: Brush) -> None:
        brush.disc(self.circle.at, self.circle.radius, PLOT.state, PLOT.stays, self.ring)


@dataclass(frozen=True)
class _Name:
    """The name of a state, the middle of its left edge at `at`, in the colours of its group."""

    at: Point
    text: str

    def svg(self) -> Iterator[str]:
        x, y = self.at
        yield f'<text x="{x:.1f}" y="{y:.1f}" dy=".35em" pointer-events="none">{xml_text(self.text)}</text>'

    def paint(self, brush: Brush) -> None:
        brush.text(self.at, self.text, NAME_PX, INK, _PNG_HALO_PX)


@dataclass(frozen=True)
class _Heading:
    """Text above the graph, the left end of its baseline at `at`."""

    at: Point
    text: str
    size: int
    ink: Colour

    def svg(self) -> Iterator[str]:
        x, y = self.at
        size = f' font-size="{self.size}"' if self.size != NAME_PX else ""
        yield f'<text x="{x:g}" y="{y:g}"{size} fill="{hexadecimal(self.ink)}">{xml_text(self.text)}</text>'

    def paint(self, brush: Brush) -> None:
        x, y = self.at
        brush.text((x, y - 0.35 * self.size), self.text, self.size, self.ink, _PNG_HALO_PX)


def _to_export(graph: nx.DiGraph) -> nx.DiGraph:
    """Reduce a joint graph to numbers and strings, the types that files for other programs hold."""
    import networkx as nx

    out = nx.DiGraph(**{key: value for key, value in graph.graph.items() if value is not None})
    for state, data in graph.nodes(data=True):
        x, y, z, w = data["orientation"]
        given = "; ".join(f"{above} {chance:.4f}" for above, chance in data.get("given", ()))
        out.add_node(state, label=data["label"], visits=data["visits"], x=x, y=y, z=z, w=w, given=given)
    for a, b, data in graph.edges(data=True):
        # In GEXF a greater "weight" means nearer, so it is the probability; the nats have a name of their own.
        out.add_edge(
            a, b, weight=probability(graph, a, b), nats=data["weight"], count=data["count"], seconds=data["seconds"]
        )
    return out
