"""The parts of the synthesis that `--without` leaves out, by name; light to import, for the command line names them.

- `pace`: the typical duration of the corpus, and bounds on speed for which the clock slows down.
- `bounce`: small vertical accelerations of the centre of mass in stance (a share of `terms.Ballistic`).
- `balance`: the centre of mass over the support, as far as the corpus keeps it there (`terms.Balance`).
- `flight`: flights, in which the centre of mass falls freely.
- `steps`: places that feet keep in stance, and between which they swing; without them feet slide.
- `limbs`: limbs that do not pass through each other (`terms.Collision`).
"""

from __future__ import annotations

from typing import Literal

Correction = Literal["pace", "bounce", "balance", "flight", "steps", "limbs"]
