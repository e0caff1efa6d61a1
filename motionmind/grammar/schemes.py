"""The schemes by which a grammar's counts become costs, by name; light to import, for the command line names them."""

from __future__ import annotations

from typing import Literal

Weights = Literal["conditional", "printed"]  # of transitions: -log P(next | state), or as the papers print it
Scheme = Literal["posture", "progression", "none"]  # of coordination: joints' states, their moves, or nothing
