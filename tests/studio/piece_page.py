"""The piece on the studio's page, as a browser has it; and what tests of the page wait for."""

from __future__ import annotations

import time
from typing import Any

LONG = 120_000  # milliseconds: whoever searches first compiles


def until(page: Any, expression: str, arg: Any = None, seconds: float = 60.0) -> None:
    """Wait until an expression, or a function of an argument, is true; the page's policy forbids Playwright's way."""
    end = time.monotonic() + seconds
    while not page.evaluate(expression, arg):
        assert time.monotonic() < end, expression
        page.wait_for_timeout(30)


def wait_for_alternatives(page: Any) -> None:
    """Wait until all ways from A to B are found."""
    page.wait_for_selector("[data-testid=alternatives][data-state=found]", timeout=LONG)


def from_a_to_b(page: Any, a: str = "arabesque", b: str = "fifth") -> None:
    """Click two postures of the gallery, and wait for the ways between them."""
    for posture in (a, b):
        page.get_by_test_id(f"posture-{posture}").click()
    wait_for_alternatives(page)


def piece(page: Any) -> Any:
    return page.evaluate("studio.store.state.piece")


def blocks(page: Any) -> list[str]:
    """What stands where, the new blocks under their sources' names."""
    return [
        ("~" if one["mirrored"] else "") + f"{one['title']} {one['first']}-{one['last']}"
        for one in piece(page)["blocks"]
    ]


def wait_for(page: Any, expression: str, seconds: float = 120.0) -> None:
    """Wait until an expression of JavaScript, in which `piece` is the piece, is true; the page's policy lets no page
    evaluate one, but the debugger may."""
    wanted = f"(() => {{ const {{ piece }} = studio.store.state ?? {{}}; return Boolean(piece && ({expression})); }})()"
    end = time.monotonic() + seconds
    while not page.evaluate(wanted):
        assert time.monotonic() < end, (expression, blocks(page), [seam["state"] for seam in piece(page)["seams"]])
        page.wait_for_timeout(30)
