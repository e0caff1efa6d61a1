from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec

import pytest

from motionmind.tween.engine import Engine

_IS_HERE = find_spec("motionmcp") is not None and find_spec("uvicorn") is not None
collect_ignore = [] if _IS_HERE else ["test_guard.py", "test_mmcp.py", "test_served_in_blender.py"]  # the extra mmcp


@pytest.fixture(scope="session")
def url() -> Iterator[str]:
    """The address of a server of the corpus ballet."""
    from served import serving

    from motionmind.serve.mmcp import app

    with serving(app(Engine.load("ballet"))) as address:
        yield address
