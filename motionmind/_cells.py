"""The one place where a body knows of pictures: by the name of a module, imported when a notebook shows something.

`_repr_html_` belongs to the classes that notebooks show, which lie below all that draws: see docs/design/notebooks.md.
"""

from __future__ import annotations

from importlib import import_module

_DRAWN_BY = "motionmind.notebook.cell"


def html_of(thing: object) -> str:
    """Return the HTML that plays a thing in a cell of a notebook: see `motionmind.notebook.cell`."""
    html: str = import_module(_DRAWN_BY).html_of(thing)
    return html
