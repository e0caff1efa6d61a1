"""The orders in which `vary` puts a piece, and the arguments that each does not take; nothing here imports numpy."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, get_args

from motionmind.errors import MotionMindError

ControlName = Literal["shuffle", "chunks", "quadrants", "dabby"]
By = Literal["attractor", ControlName]
ORDERS: tuple[By, ...] = get_args(By)
RANDOM: tuple[By, ...] = ("shuffle", "chunks", "quadrants")

_UNTRACED = dict.fromkeys(
    ("flow", "nudge", "depart", "start", "skip", "step", "transient", "inserted", "stretch"), "follows no trajectory"
)
_ONCE = {"length": "goes through the piece once"}
# By order, the arguments of `vary` that it does not take, each with the reason.
REFUSED: Mapping[By, Mapping[str, str]] = {
    "attractor": {},
    "shuffle": _UNTRACED | _ONCE,
    "chunks": {"inserted": "comes in random order"} | _ONCE,
    "quadrants": _UNTRACED | _ONCE,
    "dabby": dict.fromkeys(("inserted", "stretch"), "has one order for each trajectory"),
}


def check_taken(by: By, arguments: Mapping[str, object]) -> None:
    """Raise MotionMindError if an order does not take one of the arguments of `vary` that are given, not None."""
    for name, reason in REFUSED[by].items():
        if arguments[name] is not None:
            raise MotionMindError(f"{name} is not for {by}, which {reason}")
