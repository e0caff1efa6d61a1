"""What is kept of trajectories is told apart by all that it depends on."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from motionmind._typing import Floats
from motionmind.chaos import trajectories
from motionmind.chaos.flows import FLOWS, Flow
from motionmind.chaos.trajectories import largest_exponent, trajectory

LORENZ = FLOWS["lorenz"]


def faster(x: Floats, sigma: float, rho: float, beta: float) -> tuple[float, float, float]:
    """Lorenz' field, a tenth faster."""
    return 1.1 * sigma * (x[1] - x[0]), 1.1 * (x[0] * (rho - x[2]) - x[1]), 1.1 * (x[0] * x[1] - beta * x[2])


def forget() -> None:
    for kept in trajectories._kept.values():
        kept.cache_clear()


def found(flow: Flow, **asked: Any) -> Floats:
    """A trajectory and an exponent, one after the other."""
    points = trajectory(flow, count=5, **asked)
    return np.append(points, largest_exponent(flow, steps=1000, **asked))


@pytest.mark.parametrize(
    ("flow", "asked"),
    [
        (LORENZ, {}),
        (FLOWS["rossler"], {}),
        (replace(LORENZ, field=faster), {}),
        (replace(LORENZ, parameters=dict(LORENZ.parameters) | {next(iter(LORENZ.parameters)): 17.0}), {}),
        (LORENZ, {"start": (1.0, 2.0, 3.0)}),
        (LORENZ, {"step": 0.004}),
        (LORENZ, {"transient": 500}),
        (LORENZ, {"transient": 0}),
    ],
    ids=["usual", "flow", "field", "parameter", "start", "step", "transient", "no transient"],
)
def test_what_is_kept_is_what_would_be_computed(flow: Flow, asked: dict[str, Any]) -> None:
    forget()
    computed = found(flow, **asked)
    forget()
    found(LORENZ)
    first = found(flow, **asked)
    again = found(flow, **asked)
    assert np.array_equal(first, computed)
    assert np.array_equal(again, computed)


def test_exponents_of_more_steps_are_computed_anew() -> None:
    assert largest_exponent(LORENZ, steps=1000) != largest_exponent(LORENZ, steps=2000)


def test_what_cannot_be_compiled_may_change_and_is_computed_each_time() -> None:
    class Changing:
        rate = 10.0

        def __call__(self, x: Floats, rho: float) -> tuple[float, float, float]:
            return self.rate * (x[1] - x[0]), x[0] * (rho - x[2]) - x[1], x[0] * x[1] - 8.0 / 3.0 * x[2]

    field = Changing()
    flow = Flow("changing", field, (1.0, 1.0, 20.0), 0.01, 100, {"rho": 28.0})
    before = trajectory(flow, count=3)
    field.rate = 12.0
    assert not np.array_equal(trajectory(flow, count=3)[0], before[0])
