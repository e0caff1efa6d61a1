from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

# The same examples on every run and every machine, and no failure because a machine was slow.
settings.register_profile(
    "motionmind",
    derandomize=True,
    deadline=None,
    print_blob=False,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)
settings.load_profile("motionmind")

SHARED_DATA = Path(__file__).parents[1].parent / "shared" / "data"


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of recorded movement that lies beside the checkout; it may not be part of it."""
    if not SHARED_DATA.is_dir():
        pytest.skip(f"recorded movement is not here: no folder {SHARED_DATA}")
    return SHARED_DATA
