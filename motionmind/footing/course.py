"""Course of a body: where it is on the floor at given times, and how it faces there."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from motionmind._typing import Floats
from motionmind.geometry import rotations as rot


class Course(NamedTuple):
    """Places and facings at K increasing times, from the first frame of a movement to the last; linear between them.

    Attributes:
        times: seconds from the first frame [K].
        places: x and z of the root [K, 2], metres.
        facings: headings of the root [K], radians, without jumps.
    """

    times: Floats
    places: Floats
    facings: Floats

    def scaled(self, by: float) -> Course:
        """Return the course of a body `by` times as large."""
        return self._replace(places=by * self.places)

    def at(self, times: Floats) -> Floats:
        """Return the places [N, 2] at some times [N], metres."""
        return np.stack([np.interp(times, self.times, axis) for axis in self.places.T], axis=1)

    def faced(self, rotations: Floats, times: Floats) -> Floats:
        """Return local rotations [N, J, 4] turned about the vertical to face as the course does at their times [N]."""
        out = rotations.copy()
        turn = np.interp(times, self.times, self.facings) - rot.heading(rotations[:, 0])
        out[:, 0] = rot.mul(rot.about_vertical(turn), rotations[:, 0])
        return out
