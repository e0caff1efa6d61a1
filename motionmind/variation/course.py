"""The trajectories of a variation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Course:
    """The trajectories behind a variation, in d dimensions.

    Attributes:
        flow: the flow's name.
        parameters: the flow's parameters, by name.
        start: the start of the piece's trajectory, before its transient [d].
        nudge: the requested offset between the starts of the two trajectories after the transient [d].
        skip: points of the trajectories to skip between two postures.
        step: the step of the integration, in the flow's units of time.
        transient: steps dropped from the beginning of the piece's trajectory.
        exponent: the flow's largest Lyapunov exponent, nats per unit of time, accurate to a few percent.
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
        """Average divergence of neighbouring trajectories from one posture to the next, nats."""
        return self.exponent * self.step * (self.skip + 1)
