"""The trajectories by which a variation was made."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Course:
    """The trajectories that a variation was made by, in d dimensions.

    Attributes:
        flow: the flow's name.
        parameters: the flow's parameters, by name.
        start: the start of the piece's trajectory, before its transient [d].
        nudge: the offset, as asked for, between the starts of the two trajectories once the transient is over [d].
        skip: points of the trajectories that are left out between two postures.
        step: the step of the integration, in the flow's units of time.
        transient: steps that are dropped from the beginning of the piece's trajectory.
        exponent: the flow's largest Lyapunov exponent, nats a unit of time, accurate to some percent.
    """

    flow: str
    parameters: Mapping[str, float]
    start: tuple[float, ...]
    nudge: tuple[float, ...]
    skip: int
    step: float
    transient: int
    exponent: float

    @property
    def parting(self) -> float:
        """Nats by which neighbouring trajectories part, on average, from one posture to the next."""
        return self.exponent * self.step * (self.skip + 1)
