"""Names of the schemes that turn a grammar's counts into costs; light to import, for the command line."""

from __future__ import annotations

from typing import Literal

Weights = Literal["conditional", "printed"]  # of transitions: -log P(next | state), or as the papers print it
Scheme = Literal["posture", "progression", "none"]  # of coordination: joints' states, their moves, or nothing
