"""Draw the aligned steps of two kata as arrows."""

from __future__ import annotations

import math
from html import escape

from experiments.charts import SERIES
from experiments.harness import Row
from experiments.kata.steps import N_SECTORS
from motionmind.render.markup import hexadecimal

COLOURS = tuple(map(hexadecimal, SERIES[:2]))  # of the left foot and the right one
WIDTH, MARGIN = 800, 24  # pixels
PITCH, ARROW = 33, 11  # pixels from step to step, and half the length of an arrow


def draw(pairs: list[Row]) -> str:
    """Draw an alignment as SVG; the front is up."""
    words = f"Directions of the steps, {pairs[0]['one']} above {pairs[0]['other']}; grey: 45 degrees apart, red: more"
    lines = [_text(MARGIN, 20, words, "")]
    for k, row in enumerate(pairs):
        lines += _aligned(k, row, MARGIN + 18 + PITCH * k, 60.0)
    height = 150
    legend = [_text(MARGIN + 90 * n, height - 14, f"{name} foot", f"fill='{COLOURS[n]}'") for n, name in _FEET]
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" '
            'font-family="sans-serif" font-size="11" fill="#222">',
            f'<rect width="{WIDTH}" height="{height}" fill="#fff"/>',
            *lines,
            *legend,
            "</svg>\n",
        ]
    )


_FEET = ((0, "left"), (1, "right"))


def _aligned(k: int, row: Row, x: float, y: float) -> list[str]:
    """Draw a pair of steps: the first kata's above the second's."""
    out = [_text(x, y - 16, str(k + 1), "text-anchor='middle' fill='#666'")]
    if row["direction"] != "" and row["direction"] > 0.0:
        colour = "#bbb" if row["direction"] <= 45.0 else "#d22"
        out.append(f'<rect x="{x - 14:.0f}" y="{y - 12:.0f}" width="28" height="62" fill="none" stroke="{colour}"/>')
    for whose, centre in (("one", y + 4), ("other", y + 34)):
        if row[f"foot_{whose}"] == "":
            out.append(_text(x, centre + 4, "none", "text-anchor='middle' fill='#d22' font-size='9'"))
            continue
        to = 2.0 * math.pi * row[f"to_{whose}"] / N_SECTORS
        across, up = -math.sin(to) * ARROW, math.cos(to) * ARROW
        colour, (tip, top) = COLOURS[row[f"foot_{whose}"]], (x + across, centre - up)
        out.append(
            f'<path d="M{x - across:.1f} {centre + up:.1f}L{tip:.1f} {top:.1f}" stroke="{colour}" stroke-width="2"/>'
        )
        out.append(f'<circle cx="{tip:.1f}" cy="{top:.1f}" r="3" fill="{colour}"/>')
    return out


def _text(x: float, y: float, words: str, style: str) -> str:
    return f"<text x='{x:.1f}' y='{y:.1f}' {style}>{escape(words)}</text>"
