"""Paths over the floor: text and SVG."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from motionmind.errors import FormatError
from motionmind.formats.floor_path import N_CURVE_POINTS, read_floor_path


def read(text: str, name: str = "p.svg") -> list[tuple[float, float]]:
    Path(name).write_text(text)
    return read_floor_path(name)


def svg(data: str) -> str:
    return f'<?xml version="1.0"?>\n<svg xmlns="http://www.w3.org/2000/svg"><g><path d="{data}" fill="none"/></g></svg>'


@pytest.fixture(autouse=True)
def _in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("text", ["x,z\n1,2\n3,-4.5\n", "1 2\n3\t-4.5", "# a way\n\n1;2\n3, -4.5 # there\n"])
def test_text_has_a_point_in_each_line(text: str) -> None:
    assert read(text, "p.csv") == [(1.0, 2.0), (3.0, -4.5)]


@pytest.mark.parametrize("data", ["M1 2 3 4H5v1Z", "m1,2 2,2h2V5z", "M1 2L3 4 5 4 5 5Z"])
def test_lines_of_svg(data: str) -> None:
    assert read(svg(data)) == [(1.0, 2.0), (3.0, 4.0), (5.0, 4.0), (5.0, 5.0), (1.0, 2.0)]


def test_numbers_of_svg_need_no_blanks() -> None:
    assert read(svg("M.5-.5l1e0.5")) == [(0.5, -0.5), (1.5, 0.0)]


def test_curves_are_those_of_bezier() -> None:
    share = np.linspace(0.0, 1.0, N_CURVE_POINTS + 1)[1:, None]
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [3.0, 2.0]])
    cubic = sum(
        factor * (1 - share) ** (3 - k) * share**k * corners[k] for k, factor in enumerate((1.0, 3.0, 3.0, 1.0))
    )
    np.testing.assert_allclose(read(svg("M0 0C1 0 1 2 3 2"))[1:], cubic, atol=1e-12)
    np.testing.assert_allclose(read(svg("M0 0c1 0 1 2 3 2"))[1:], cubic, atol=1e-12)
    quadratic = 2.0 * (1 - share) * share * corners[1] + share**2 * corners[2]
    np.testing.assert_allclose(read(svg("M0 0q1 0 1 2"))[1:], quadratic, atol=1e-12)


def test_a_polyline_is_a_path() -> None:
    assert read('<svg><polyline points="0,0 1,0.5 2,2"/></svg>') == [(0.0, 0.0), (1.0, 0.5), (2.0, 2.0)]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (svg("M0 0A1 1 0 0 0 2 2"), "command A: only M, L, H, V, C, Q and Z are read"),
        (svg("M0 0L1"), "command L needs 2 numbers"),
        (svg("M0 0C1 1 2 2L3 3"), "command C needs 6 numbers"),
        (svg("L0 0"), "must be one path that begins with M and goes on without another"),
        (svg("M0 0L1 1M2 2"), "must be one path that begins with M and goes on without another"),
        (svg("1 2"), "'1' where a command was expected"),
        (svg("M0 0Z1 1"), "'1' where a command was expected"),
        (svg("M0 0L1e999 1"), "'1e999' where a number was expected"),
        (svg("M0 0 &amp;"), "'&amp;' where a command or a number was expected"),
        (svg(""), "has no point of a path"),
        ("<svg/>", r"must hold one <path> or <polyline>, not 0 shapes \(no shape\)"),
        ("<svg><circle/><path d='M0 0'/></svg>", r"not 2 shapes \(<circle>, <path>\)"),
        ("<svg><path/></svg>", "<path> has no points"),
        (
            "<svg><g transform='scale(2)'><path d='M0 0'/></g></svg>",
            "has a transform: apply it to the path's own points",
        ),
    ],
)
def test_other_svg_is_refused_in_one_line(text: str, told: str) -> None:
    with pytest.raises(FormatError, match=told):
        read(text)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "has no point of a path: give x and z in each line, metres"),
        ("1 2\n3", ":2: 1 values where x and z were expected"),
        ("1 2\n3 nan", ":2: 'nan' where a number was expected"),
        ("0 0\n" * 10_001, "has more than 10000 points"),
    ],
)
def test_other_text_is_refused_in_one_line(text: str, told: str) -> None:
    with pytest.raises(FormatError, match=told):
        read(text, "p.txt")
