"""The corrections that let a movement be a body's own, by name; light to import, for the command line names them.

- `pace`: the movement takes about as long as the corpus takes for so far a way.
- `bounce`: the body's height changes smoothly, and the standing leg bears it.
- `balance`: the weight stays over the support, as far as the corpus keeps it there.
- `flight`: a body in the air falls.
- `steps`: feet step to where they have to be next, and do not slide there.
- `limbs`: limbs do not pass through each other.
"""

from __future__ import annotations

from typing import Literal

Correction = Literal["pace", "bounce", "balance", "flight", "steps", "limbs"]
