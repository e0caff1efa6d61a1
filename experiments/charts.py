"""Charts as SVG: panels side by side, with lines and dots on two axes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape

from motionmind.render.markup import hexadecimal

SERIES = (  # one colour a series
    (31, 111, 139),
    (192, 86, 42),
    (91, 140, 58),
    (125, 79, 158),
    (176, 138, 30),
    (68, 68, 68),
    (208, 85, 143),
    (46, 156, 143),
)
WIDTH, HEIGHT = 330, 250  # of a panel, pixels
LEFT, RIGHT, TOP, BOTTOM = 52, 12, 30, 42  # its margins, pixels


@dataclass
class Panel:
    """One pair of axes and the series on them.

    Attributes:
        title, x, y: titles of the panel and its axes.
        series: points (x, y) by name; those that are not finite are left out.
        log: whether the x axis is logarithmic.
        joined: whether lines join the points of a series.
        numbered: whether the x axis has numbers.
    """

    title: str
    x: str
    y: str
    series: dict[str, Sequence[tuple[float, float]]] = field(default_factory=dict)
    log: bool = False
    joined: bool = True
    numbered: bool = True


def svg(panels: Sequence[Panel], columns: int = 3) -> str:
    """Draw panels in rows of `columns`, with one legend below them."""
    names = list(dict.fromkeys(name for panel in panels for name in panel.series))
    colour = {name: hexadecimal(SERIES[i % len(SERIES)]) for i, name in enumerate(names)}
    columns = min(columns, len(panels))
    rows = math.ceil(len(panels) / columns)
    legend, x, y = [], 12.0, rows * HEIGHT + 18  # pixels
    for name in names:
        length = 26 + 6.6 * len(name)
        if x + length > columns * WIDTH:
            x, y = 12.0, y + 18
        legend.append(f'<circle cx="{x + 4:.0f}" cy="{y - 4}" r="4" fill="{colour[name]}"/>')
        legend.append(f'<text x="{x + 13:.0f}" y="{y}">{escape(name)}</text>')
        x += length
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {columns * WIDTH} {y + 12}" '
        'font-family="sans-serif" font-size="11" fill="#222">',
        f'<rect width="{columns * WIDTH}" height="{y + 12}" fill="#fff"/>',
    ]
    for number, panel in enumerate(panels):
        at = number % columns * WIDTH, number // columns * HEIGHT
        parts += [f'<g transform="translate({at[0]} {at[1]})">', *_panel(panel, colour), "</g>"]
    return "\n".join([*parts, *legend, "</svg>\n"])


def _panel(panel: Panel, colour: dict[str, str]) -> list[str]:
    """Draw one panel at the origin, in the colours of the series."""
    points = [p for series in panel.series.values() for p in series if all(map(math.isfinite, p))] or [(1.0, 0.0)]
    xs = [math.log10(x) if panel.log else x for x, _ in points]
    ys = [y for _, y in points]
    x_ticks, y_ticks = _ticks(min(xs), max(xs)), _ticks(min(ys), max(ys))
    if panel.log:
        x_ticks = _apart(sorted(set(xs)))
    x0, x1 = min(xs[0], *x_ticks, *xs), max(*x_ticks, *xs)
    y0, y1 = y_ticks[0], y_ticks[-1]

    def at(x: float, y: float) -> tuple[float, float]:
        across = (x - x0) / (x1 - x0) if x1 > x0 else 0.5
        up = (y - y0) / (y1 - y0) if y1 > y0 else 0.5
        return LEFT + across * (WIDTH - LEFT - RIGHT), HEIGHT - BOTTOM - up * (HEIGHT - TOP - BOTTOM)

    x_places = [(tick, at(tick, y0)[0]) for tick in (x_ticks if panel.numbered else ())]
    out = _axes(panel, x_places, [(tick, at(x0, tick)[1]) for tick in y_ticks])
    for name, series in panel.series.items():
        kept = [(math.log10(x) if panel.log else x, y) for x, y in series if math.isfinite(x) and math.isfinite(y)]
        places = [at(*point) for point in kept]
        if panel.joined and len(places) > 1:
            line = " ".join(f"{x:.1f},{y:.1f}" for x, y in places)
            out.append(f'<polyline points="{line}" fill="none" stroke="{colour[name]}" stroke-width="1.8"/>')
        out += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{colour[name]}"/>' for x, y in places]
    return out


def _axes(panel: Panel, x_ticks: Sequence[tuple[float, float]], y_ticks: Sequence[tuple[float, float]]) -> list[str]:
    """Draw the titles and the ticks of a panel; of each tick the number and its place, pixels."""
    out = [f'<text x="{LEFT}" y="18" font-weight="bold">{escape(panel.title)}</text>']
    for tick, y in y_ticks:
        out.append(f'<path d="M{LEFT} {y:.1f}H{WIDTH - RIGHT}" stroke="#e4e4e4"/>')
        out.append(f'<text x="{LEFT - 5}" y="{y + 4:.1f}" text-anchor="end">{_number(tick)}</text>')
    for tick, x in x_ticks:
        shown = 10.0**tick if panel.log else tick
        out.append(f'<text x="{x:.1f}" y="{HEIGHT - BOTTOM + 15}" text-anchor="middle">{_number(shown)}</text>')
    middle = (LEFT + WIDTH - RIGHT) / 2
    out.append(f'<text x="{middle}" y="{HEIGHT - 10}" text-anchor="middle" fill="#666">{escape(panel.x)}</text>')
    out.append(
        f'<text transform="translate(11 {HEIGHT / 2 - 8}) rotate(-90)" text-anchor="middle" fill="#666">'
        f"{escape(panel.y)}</text>"
    )
    return out


def _number(value: float) -> str:
    """Write a number in four digits, or all digits of a larger one."""
    return f"{value:,.0f}" if 1e4 <= abs(value) < 1e9 else f"{value:.4g}"


def _ticks(low: float, high: float) -> list[float]:
    """Choose about five round numbers from `low` or below to `high` or above."""
    if high - low < 1e-12:
        half = 0.05 * abs(low) or 0.5
        low, high = low - half, high + half
    rough = (high - low) / 5.0
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(power * factor for factor in (1.0, 2.0, 2.5, 5.0, 10.0) if power * factor >= rough * 0.999)
    first, last = math.floor(low / step + 1e-9), math.ceil(high / step - 1e-9)
    return [k * step for k in range(first, last + 1)]


def _apart(values: list[float]) -> list[float]:
    """Choose, of increasing values, those with room to be written side by side.

    On a logarithmic axis the values themselves say more than powers of ten.
    """
    room = 30.0 / (WIDTH - LEFT - RIGHT) * (values[-1] - values[0])
    kept = values[:1]
    for value in values[1:]:
        if value - kept[-1] >= room:
            kept.append(value)
    return kept
