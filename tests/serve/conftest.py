from __future__ import annotations

from collections.abc import Iterator

import pytest

from motionmind.tween.engine import Engine

pytest.importorskip("motionmcp.server", reason="the extra mmcp is not installed")


@pytest.fixture(scope="session")
def url() -> Iterator[str]:
    """The address of a server of the corpus ballet."""
    from served import serving

    from motionmind.serve.mmcp import app

    with serving(app(Engine.load("ballet"))) as address:
        yield address
