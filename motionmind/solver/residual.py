"""The residuals that a solve reports; light to import, because reports hold them."""

from __future__ import annotations

import msgspec


class Residual(msgspec.Struct, frozen=True):
    """The largest residual of a term of the solve.

    Attributes:
        term: name of the term, a class of `motionmind.solver.terms`.
        most: the residual, in `unit`.
        unit: its unit.
        at: seconds from the start.
    """

    term: str
    most: float
    unit: str
    at: float
