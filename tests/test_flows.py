from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from motionmind.chaos.flows import FLOWS, Flow, flow_of
from motionmind.chaos.trajectories import largest_exponent, trajectory

# Sprott, "Chaos and Time-Series Analysis" (2003), appendix A; the third from Wolf et al., Physica D 16:285 (1985),
# table 1: 2.16 bits a unit of time.
EXPONENTS = [
    (flow_of("lorenz", sigma=10.0, rho=28.0, beta=8.0 / 3.0), 0.9056),
    (flow_of("rossler"), 0.0714),
    (flow_of("lorenz", rho=45.92), 2.16 * np.log(2.0)),
    (flow_of("chua"), 0.3271),
    (flow_of("halvorsen"), 0.7899),
]
SMOOTH = [flow for flow in FLOWS.values() if flow.name != "chua"]  # whose field has kinks


@pytest.mark.parametrize(("flow", "published"), EXPONENTS, ids=lambda x: getattr(x, "label", None))
def test_largest_exponents_are_as_published(flow: Flow, published: float) -> None:
    assert largest_exponent(flow) == pytest.approx(published, rel=0.02)


@pytest.mark.parametrize("flow", FLOWS.values(), ids=lambda flow: flow.name)
def test_trajectories_are_those_of_another_integrator(flow: Flow) -> None:
    points = trajectory(flow, count=6, every=20)
    times = np.arange(6) * 20 * flow.step

    def field(_: float, x: np.ndarray) -> np.ndarray:
        return np.array(flow.field(x, *flow.parameters.values()))

    found = solve_ivp(field, (0.0, times[-1]), points[0], "DOP853", times, rtol=1e-12, atol=1e-12, max_step=flow.step)
    assert np.abs(points - found.y.T).max() < 2e-3 * np.ptp(points)


@pytest.mark.parametrize("flow", SMOOTH, ids=lambda flow: flow.name)
def test_halving_the_step_makes_the_error_a_sixteenth(flow: Flow) -> None:
    start = trajectory(flow, count=1)[0]

    def end(parts: int) -> np.ndarray:
        step = flow.step / parts
        return trajectory(flow, start, count=2, every=40 * parts, step=step, transient=0)[1]

    fine = end(128)
    errors = [np.abs(end(parts) - fine).max() for parts in (2, 4, 8)]
    for coarse, halved in pairwise(errors):
        assert 12.0 < coarse / halved < 20.0
