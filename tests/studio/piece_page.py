"""The piece on the studio's page, as a browser has it."""

from __future__ import annotations

import time
from typing import Any


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
