"""Movement in notebooks: what plays in a cell, and `Player`, a widget that Python and the page share."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from motionmind.notebook.widget import Player

__all__ = ["Player"]


def __getattr__(name: str) -> Any:
    """Import the widget when it is used: it needs the extra `notebook`, and what plays in a cell does not."""
    if name != "Player":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from motionmind.notebook import widget

    return widget.Player
