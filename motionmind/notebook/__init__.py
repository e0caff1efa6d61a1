"""Movement in notebooks: cells that play it, and `Player`, a widget that Python and the page share."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from motionmind.notebook.widget import Player

__all__ = ["Player"]


def __getattr__(name: str) -> Any:
    """Import the widget on first use: it needs the extra `notebook`; cells that play movement do not."""
    if name != "Player":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from motionmind.notebook import widget

    return widget.Player
