"""The orders that `vary` can give a piece, and the arguments that each refuses; imports no NumPy."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, get_args

from motionmind.errors import MotionMindError

ControlName = Literal["shuffle", "chunks", "quadrants", "dabby"]
By = Literal["attractor", ControlName]
ORDERS: tuple[By, ...] = get_args(By)
RANDOM: tuple[By, ...] = ("shuffle", "chunks", "quadrants")
# Without a limit, insertions take 52 to 75 % of the time (macarena, medley, cmu-05 in its own corpus and in ballet).
DEFAULT_INSERTED_SHARE = 0.3
MAX_EVERY = 64  # beats from one on which a stretch may start to the next

_UNTRACED = dict.fromkeys(
    ("flow", "nudge", "depart", "start", "skip", "step", "transient", "inserted", "stretch"), "follows no trajectory"
)
_ONCE = {"length": "goes through the piece once"}
# By order, the arguments of `vary` that it refuses, each with the reason.
REFUSED: Mapping[By, Mapping[str, str]] = {
    "attractor": {},
    "shuffle": _UNTRACED | _ONCE,
    "chunks": {"inserted": "comes in random order"} | _ONCE,
    "quadrants": _UNTRACED | _ONCE,
    "dabby": dict.fromkeys(("inserted", "stretch"), "has one order for each trajectory"),
}


def check_taken(by: By, arguments: Mapping[str, object]) -> None:
    """Raise MotionMindError if an order refuses one of the given arguments of `vary`; None counts as not given."""
    for name, reason in REFUSED[by].items():
        if arguments[name] is not None:
            raise MotionMindError(f"{name} is not for {by}, which {reason}")
