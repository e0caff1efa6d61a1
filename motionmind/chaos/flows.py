"""Chaotic flows dx/dt = f(x): a registry, and the type for any other.

A step is a sixtieth to a hundredth of a turn around the attractor, so every 11th point gives six to ten points a turn.
The flow `chua` is Chua's circuit, whose attractor is the double scroll.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from motionmind import plugins
from motionmind._typing import Floats
from motionmind.arguments import (
    as_floats,
    check_function,
    check_integer,
    check_items,
    check_mapping,
    check_real,
    check_text,
    described,
)
from motionmind.errors import MotionMindError, suggestion

Field = Callable[..., Any]

_GROUP: plugins.Group = "motionmind.flows"


@dataclass(frozen=True, eq=False)
class Flow:
    """A flow dx/dt = field(x, *parameters) in d dimensions, with defaults for its integration.

    Attributes:
        name: its name.
        field: a function from a point [d] and each parameter to the rate of change, a tuple or array [d]. Numba
            compiles it if it can; otherwise it runs as it is, about a hundred times slower. It should not raise
            exceptions: they do not leave compiled code.
        start: a point in the attractor's basin [d].
        step: the step of the integration, in the flow's units of time.
        transient: steps from a start until the trajectory counts as being on the attractor.
        parameters: parameters by name, in the order in which the field takes them.
        dimensions: names of the coordinates [d]; by default x1, x2 and so on.
        about: the equations and their source.

    >>> from motionmind.chaos import find_flow
    >>> find_flow("lorenz").dimensions
    ('x', 'y', 'z')
    """

    name: str
    field: Field
    start: tuple[float, ...]
    step: float
    transient: int = 10_000
    parameters: Mapping[str, float] = field(default_factory=dict)
    dimensions: tuple[str, ...] = ()
    about: str = ""

    def __post_init__(self) -> None:
        check_text("name", self.name)
        check_function("field", self.field)
        check_real("step", self.step)
        check_integer("transient", self.transient)
        check_mapping("parameters", self.parameters)
        check_items("dimensions", self.dimensions, "names", str)
        check_text("about", self.about)
        start = tuple(map(float, as_floats("start", self.start).ravel()))
        for name, value in self.parameters.items():
            check_real(f"parameter {name}", value)
        parameters = {name: float(value) for name, value in self.parameters.items()}
        if not start:
            raise MotionMindError(f"flow {self.name}: start needs one coordinate or more")
        dimensions = self.dimensions or tuple(f"x{i + 1}" for i in range(len(start)))
        if len(dimensions) != len(start):
            raise MotionMindError(
                f"flow {self.name}: start has {len(start)} coordinates, dimensions has {len(dimensions)} names"
            )
        for name, value in parameters.items():
            if not np.isfinite(value):
                raise MotionMindError(f"flow {self.name}: parameter {name} must be a finite number, not {value}")
        object.__setattr__(self, "start", start)
        object.__setattr__(self, "parameters", MappingProxyType(parameters))
        object.__setattr__(self, "dimensions", dimensions)

    @property
    def label(self) -> str:
        """The name and the parameters, such as "lorenz (sigma 16, rho 45, beta 4)"."""
        values = ", ".join(f"{name} {value:g}" for name, value in self.parameters.items())
        return f"{self.name} ({values})" if values else self.name


def find_flow(name: str, **parameters: float) -> Flow:
    """Return the registered flow of this name.

    Args:
        name: lorenz, rossler, chua, duffing, halvorsen, thomas, or one that an installed package adds (an entry point
            in `motionmind.flows`).
        parameters: values for some of its parameters, which `find_flow(name).parameters` lists; the others keep their
            defaults.

    Raises:
        MotionMindError: there is no flow or no parameter of that name, or a value is not a finite number.

    >>> from motionmind.chaos import find_flow
    >>> find_flow("lorenz", rho=28.0).parameters["rho"]
    28.0
    """
    check_text("name", name)
    flow = FLOWS.get(name) or _added(name)
    if flow is None:
        raise MotionMindError(f"no flow {name!r}{suggestion(name, sorted({*FLOWS, *plugins.added(_GROUP)}))}")
    for given in parameters:
        if given not in flow.parameters:
            raise MotionMindError(f"{name} has no parameter {given!r}{suggestion(given, flow.parameters, 'it has')}")
    return replace(flow, parameters={**flow.parameters, **parameters})


def _added(name: str) -> Flow | None:
    """Return the flow that an installed package adds under a name; None if there is none."""
    flow = plugins.load(_GROUP, name)
    if flow is not None and (not isinstance(flow, Flow) or flow.name != name):
        raise plugins.unfit(_GROUP, name, f"a Flow of that name, not {described(flow)}")
    return flow


# --- the registry -----------------------------------------------------------------------------------------------------


def _lorenz(x: Floats, sigma: float, rho: float, beta: float) -> tuple[float, ...]:
    return sigma * (x[1] - x[0]), x[0] * (rho - x[2]) - x[1], x[0] * x[1] - beta * x[2]


def _rossler(x: Floats, a: float, b: float, c: float) -> tuple[float, ...]:
    return -x[1] - x[2], x[0] + a * x[1], b + x[2] * (x[0] - c)


def _chua(x: Floats, alpha: float, beta: float, inner: float, outer: float) -> tuple[float, ...]:
    diode = outer * x[0] + 0.5 * (inner - outer) * (abs(x[0] + 1.0) - abs(x[0] - 1.0))
    return alpha * (x[1] - x[0] - diode), x[0] - x[1] + x[2], -beta * x[1]


def _duffing(x: Floats, damping: float, drive: float, frequency: float) -> tuple[float, ...]:
    # The last two coordinates converge to the unit circle and go round it at a constant rate.
    fade = 1.0 - x[2] * x[2] - x[3] * x[3]
    return (
        x[1],
        x[0] - x[0] * x[0] * x[0] - damping * x[1] + drive * x[2],
        fade * x[2] - frequency * x[3],
        fade * x[3] + frequency * x[2],
    )


def _halvorsen(x: Floats, a: float) -> tuple[float, ...]:
    return (
        -a * x[0] - 4.0 * x[1] - 4.0 * x[2] - x[1] * x[1],
        -a * x[1] - 4.0 * x[2] - 4.0 * x[0] - x[2] * x[2],
        -a * x[2] - 4.0 * x[0] - 4.0 * x[1] - x[0] * x[0],
    )


def _thomas(x: Floats, b: float) -> tuple[float, ...]:
    return np.sin(x[1]) - b * x[0], np.sin(x[2]) - b * x[1], np.sin(x[0]) - b * x[2]


_XYZ = ("x", "y", "z")
_REGISTRY = (
    Flow(
        "lorenz",
        _lorenz,
        start=(1.0, 1.0, 20.0),
        step=0.007,
        parameters={"sigma": 16.0, "rho": 45.0, "beta": 4.0},
        dimensions=_XYZ,
        about="x' = sigma (y - x), y' = x (rho - z) - y, z' = x y - beta z; Lorenz, J. Atmos. Sci. 20:130 (1963), with "
        "sigma 10, rho 28, beta 8/3; the parameters here: Bradley, Capps, Luftig and Stuart, Open AI Journal 4 (2010)",
    ),
    Flow(
        "rossler",
        _rossler,
        start=(1.0, 1.0, 0.0),
        step=0.05,
        parameters={"a": 0.2, "b": 0.2, "c": 5.7},
        dimensions=_XYZ,
        about="x' = -y - z, y' = x + a y, z' = b + z (x - c); Roessler, Phys. Lett. A 57:397 (1976)",
    ),
    Flow(
        "chua",
        _chua,
        start=(0.1, 0.1, 0.1),
        step=0.02,
        parameters={"alpha": 9.0, "beta": 100.0 / 7.0, "inner": -8.0 / 7.0, "outer": -5.0 / 7.0},
        dimensions=_XYZ,
        about="x' = alpha (y - x - f(x)), y' = x - y + z, z' = -beta y, where f has the slope `inner` up to |x| = 1 "
        "and `outer` beyond: Chua's circuit, with the double scroll; Matsumoto, Chua and Komuro, IEEE Trans. CAS "
        "32:797 (1985)",
    ),
    Flow(
        "duffing",
        _duffing,
        start=(0.5, 0.0, 1.0, 0.0),
        step=0.06,
        parameters={"damping": 0.25, "drive": 0.4, "frequency": 1.0},
        dimensions=("x", "v", "cos", "sin"),
        about="x'' = x - x^3 - damping x' + drive cos(frequency t); Holmes, Phil. Trans. R. Soc. A 292:419 (1979). The "
        "phase is a point on a circle, c' = c (1 - c^2 - s^2) - frequency s, s' = s (1 - c^2 - s^2) + frequency c, so "
        "that equal phases are near each other; Doedel et al., AUTO-07P (2007)",
    ),
    Flow(
        "halvorsen",
        _halvorsen,
        start=(-5.0, 0.0, 0.0),
        step=0.01,
        parameters={"a": 1.27},
        dimensions=_XYZ,
        about="x' = -a x - 4 y - 4 z - y^2, and so on around x, y, z; Sprott (2003), after Arne Dehli Halvorsen",
    ),
    Flow(
        "thomas",
        _thomas,
        start=(0.1, 0.0, 0.0),
        step=0.1,
        parameters={"b": 0.18},
        dimensions=_XYZ,
        about="x' = sin y - b x, and so on around x, y, z; Thomas, Int. J. Bifurcation and Chaos 9:1889 (1999)",
    ),
)
FLOWS: Mapping[str, Flow] = MappingProxyType({flow.name: flow for flow in _REGISTRY})
