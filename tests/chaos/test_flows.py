from __future__ import annotations

import json
import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from motionmind.chaos.flows import FLOWS, Flow, find_flow
from motionmind.chaos.trajectories import _compiled, largest_exponent, trajectory
from motionmind.errors import MotionMindError

# Sprott, "Chaos and Time-Series Analysis" (2003), appendix A; the third from Wolf et al., Physica D 16:285 (1985),
# table 1: 2.16 bits a unit of time.
EXPONENTS = [
    (find_flow("lorenz", sigma=10.0, rho=28.0, beta=8.0 / 3.0), 0.9056),
    (find_flow("rossler"), 0.0714),
    (find_flow("lorenz", rho=45.92), 2.16 * np.log(2.0)),
    (find_flow("chua"), 0.3271),
    (find_flow("halvorsen"), 0.7899),
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
        return trajectory(flow, start, count=2, every=20 * parts, step=step, transient=0)[1]

    fine = end(128)
    errors = [np.abs(end(parts) - fine).max() for parts in (4, 8, 16)]
    for coarse, halved in pairwise(errors):
        assert 12.0 < coarse / halved < 20.0


def test_points_are_so_many_steps_apart_and_begin_after_the_transient() -> None:
    flow = FLOWS["rossler"]
    every_step = trajectory(flow, count=60, every=1, transient=500)
    assert np.array_equal(every_step[::7], trajectory(flow, count=9, every=7, transient=500))
    assert np.array_equal(every_step[20:], trajectory(flow, count=40, every=1, transient=520))
    assert np.array_equal(every_step[20:], trajectory(flow, every_step[20], count=40, every=1, transient=0))


def _lorenz(x: np.ndarray) -> np.ndarray:
    return np.array([10.0 * (x[1] - x[0]), x[0] * (28.0 - x[2]) - x[1], x[0] * x[1] - 8.0 / 3.0 * x[2]])


def _uncompiled(value: float) -> float:
    """The value, by a way that numba does not know."""
    return float(json.loads(json.dumps(float(value))))


def _slow(x: np.ndarray) -> list[float]:
    return [_uncompiled(rate) for rate in _lorenz(x)]


def _with_parameters(x: np.ndarray, sigma: float, rho: float, beta: float) -> tuple[float, float, float]:
    return sigma * (x[1] - x[0]), x[0] * (rho - x[2]) - x[1], x[0] * x[1] - beta * x[2]


@pytest.mark.long
def test_any_function_is_a_flow_compiled_or_not() -> None:
    given = {"sigma": 10.0, "rho": 28.0, "beta": 8.0 / 3.0}
    known = find_flow("lorenz", **given)
    points = trajectory(known, count=50, transient=200)
    for flow in (
        Flow("array", _lorenz, known.start, known.step),
        Flow("list", _slow, known.start, known.step),
        Flow("tuple", _with_parameters, known.start, known.step, parameters=given),
    ):
        assert np.allclose(trajectory(flow, count=50, transient=200), points, rtol=1e-6)
    assert [_compiled(field, 0) is None for field in (_lorenz, _slow)] == [False, True]
    assert Flow("array", _lorenz, known.start, known.step).dimensions == ("x1", "x2", "x3")


@pytest.mark.long
@pytest.mark.parametrize(
    ("flow", "start"),
    [
        (find_flow("lorenz", rho=0.5), None),  # one fixed point, the origin
        (find_flow("lorenz", rho=10.0), None),  # two
        (find_flow("rossler", c=2.5), None),  # a cycle
        (find_flow("duffing", drive=0.2), None),
        (find_flow("thomas", b=0.3), None),
        (find_flow("thomas", b=1.1), None),
        (find_flow("lorenz"), (0.0, 0.0, 0.0)),  # on an unstable fixed point, and on the way to it
        (find_flow("lorenz"), (0.0, 0.0, 5.0)),
        (Flow("spring", lambda x: (x[1], -x[0]), (1.0, 0.0), 0.05), None),
        (Flow("shear", lambda x: (x[1], 0.0), (0.0, 1.0), 1e-3), None),
    ],
    ids=lambda x: x.label if isinstance(x, Flow) else str(x),
)
def test_a_flow_that_settles_is_refused_with_its_exponent(flow: Flow, start: tuple[float, ...] | None) -> None:
    with pytest.raises(MotionMindError, match=r"is not chaotic from .* an exponent of|settles from .* to rest at"):
        trajectory(flow, start, count=20)


def test_a_cycle_has_an_exponent_of_nought_and_a_fixed_point_its_eigenvalue() -> None:
    assert largest_exponent(find_flow("rossler", c=2.5), steps=200_000) == pytest.approx(0.0, abs=1e-3)
    # At the origin, with rho < 1: the larger root of (sigma + l) (1 + l) = sigma rho.
    sigma, rho = 16.0, 0.5
    slowest = 0.5 * (-(sigma + 1.0) + np.sqrt((sigma + 1.0) ** 2 - 4.0 * sigma * (1.0 - rho)))
    assert largest_exponent(find_flow("lorenz", rho=rho), steps=200_000) == pytest.approx(slowest, rel=1e-3)


@pytest.mark.parametrize(
    ("flow", "start", "step"),
    [
        (FLOWS["rossler"], (100.0, 100.0, 100.0), None),
        (FLOWS["lorenz"], None, 0.2),
        (Flow("explosion", lambda x: (x[0] * x[0],), (1.0,), 0.01), None, None),
    ],
    ids=["out of the basin", "too long a step", "no attractor"],
)
def test_a_flow_that_diverges_says_after_how_many_steps(
    flow: Flow, start: tuple[float, ...] | None, step: float | None
) -> None:
    with pytest.raises(MotionMindError, match=rf"{flow.name}.* diverges from \(.*\): within \d+ steps"):
        trajectory(flow, start, count=100, step=step)


def test_a_field_that_is_not_compiled_diverges_and_fails_in_the_same_words() -> None:
    def plain(x: np.ndarray) -> list[float]:
        return [_uncompiled(x[0]) * x[0]]

    def failing(x: np.ndarray) -> list[float]:
        return [math.exp(_uncompiled(x[0]))]

    for field, message in ((plain, "diverges from"), (failing, "its field fails after")):
        with pytest.raises(MotionMindError, match=message):
            trajectory(Flow("explosion", field, (1.0,), 0.01, transient=0), count=100)


def test_a_start_far_out_is_no_standing_still() -> None:
    flow = FLOWS["lorenz"]
    assert len(trajectory(flow, (2e3, 2e3, 2e3), count=5, step=1e-4, transient=400_000)) == 5


def test_tiny_steps_make_no_flow_seem_settled() -> None:
    flow = FLOWS["thomas"]
    assert len(trajectory(flow, count=5, step=flow.step / 1000.0)) == 5


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"count": 0}, "count must be 1 or more, not 0"),
        ({"count": 1, "every": 0}, "every must be 1 or more, not 0"),
        ({"count": 1, "step": 0.0}, "must be a positive number, not 0.0"),
        ({"count": 1, "step": np.nan}, "must be a positive number, not nan"),
        ({"count": 1, "transient": -1}, "0 or more, not -1"),
        ({"count": 1, "transient": 10.5}, "a whole number of steps, 0 or more, not 10.5"),
        ({"count": 1, "step": "x"}, "one for its step, not None and 'x'"),
        ({"count": 1, "start": "x"}, "takes 3 numbers to start at"),
        ({"count": 1, "start": (1.0, 2.0)}, "starts at 3 finite numbers"),
        ({"count": 1, "start": (1.0, np.inf, 0.0)}, "starts at 3 finite numbers"),
    ],
)
def test_what_is_out_of_range_is_refused(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(MotionMindError, match=message):
        trajectory(FLOWS["lorenz"], **arguments)  # type: ignore[arg-type]


def test_unknown_names_are_told_what_there_is() -> None:
    with pytest.raises(MotionMindError, match="no flow 'moon'; there are chua, duffing"):
        find_flow("moon")
    with pytest.raises(MotionMindError, match="lorenz has no parameter 'r'; it has sigma, rho, beta"):
        find_flow("lorenz", r=28.0)
    with pytest.raises(MotionMindError, match="parameter rho must be a finite number"):
        find_flow("lorenz", rho=np.inf)


@pytest.mark.parametrize(
    ("field", "message"),
    [
        (lambda x: (x[0], x[3], x[1]), "its field fails at"),
        (lambda x: (x[0], x[1]), r"gives an array \[2\] at a point \[3\]"),
        (lambda x, a: (a, a, a), "its field fails at"),
        (lambda x: (1 / (float(x[0]) - 1.0), x[1], x[2]), "its field fails at"),
    ],
)
def test_a_field_that_does_not_fit_is_refused_before_it_is_compiled(field: object, message: str) -> None:
    with pytest.raises(MotionMindError, match=message):
        trajectory(Flow("odd", field, (1.0, 1.0, 1.0), 0.01), count=2)  # type: ignore[arg-type]


def test_a_flow_needs_a_start_and_as_many_names() -> None:
    with pytest.raises(MotionMindError, match="start needs one coordinate"):
        Flow("none", _lorenz, (), 0.01)
    with pytest.raises(MotionMindError, match="start has 3 coordinates, dimensions has 2 names"):
        Flow("two", _lorenz, (1.0, 1.0, 1.0), 0.01, dimensions=("x", "y"))


@pytest.mark.parametrize(("name", "start"), [("lorenz", (0.0, 0.0, 5.0)), ("duffing", (0.5, 0.0, 0.0, 0.0))])
def test_a_saddle_that_neighbours_leave_is_a_fixed_point_all_the_same(name: str, start: tuple[float, ...]) -> None:
    with pytest.raises(MotionMindError, match=rf"{name}.* settles from .*: it comes to rest at"):
        trajectory(FLOWS[name], start, count=5, transient=0)
