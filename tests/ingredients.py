"""The ingredients of a written problem, summed along a tween's path and compared with its report."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Mapping

import numpy as np
import pytest
from toys import costs_by_function

from motionmind.tween.result import Tween

ROUNDING = 1e-5  # nats; what a joint pays for one ingredient of a move is the sum of up to three costs, rounded to 1e-6
PARTS = ("moves", "allowed", "transition", "bridge", "wait", "network", "guide")

Costs = Mapping[tuple[str, str, int], float]  # by ingredient, joint and move


def assert_reported(tween: Tween, text: str | None = None) -> Costs:
    """That all of the path's cost is made of what the report says it is, joint by joint and move by move.

    Args:
        tween: the tween.
        text: the problem; None for the tween's.
    """
    found, report = paid(tween, tween.problem() if text is None else text), tween.report()
    costs = report["costs"]
    cells = [(t, j, joint) for t in range(tween.moves) for j, joint in enumerate(tween.joints)]
    for t, j, joint in cells:
        of_move = [found[kind, joint, t] for kind in ("transition", "bridge", "wait")]
        assert sum(of_move) == pytest.approx(costs["moves"][t][j], abs=ROUNDING), (joint, t)
        assert np.count_nonzero(of_move) <= 1, (joint, t)
        assert found["allowed", joint, t] == 0.0, (joint, t)
        assert found["network", joint, t] == pytest.approx(costs["coordination"][t][j], abs=ROUNDING), (joint, t)
        assert found["guide", joint, t] == pytest.approx(costs["guide"][t][j], abs=ROUNDING), (joint, t)
    for kind in ("bridge", "wait"):
        listed = {(one["joint"], one["move"]): one["price"] for one in report[f"{kind}s"] if one["price"]}
        theirs = {(joint, t): found[kind, joint, t] for t, _, joint in cells if found[kind, joint, t]}
        assert theirs == pytest.approx(listed, abs=ROUNDING)
    assert found["moves", "", 0] == pytest.approx(costs["per_move"] * tween.moves)
    assert sum(found.values()) == pytest.approx(tween.cost, abs=1e-3)
    return found


def paid(tween: Tween, text: str) -> Costs:
    """What the tween's path pays in a written problem: a function is named after the variable that is arrived in."""
    out: dict[tuple[str, str, int], float] = defaultdict(float)
    for name, cost in costs_by_function(text, tween.path, tween.joints).items():
        part, _, variable = name.partition("_")
        assert part in PARTS
        joint, _, t = variable.removesuffix("_child").removesuffix("_parent").rpartition("_")
        out[part, joint, int(t) - 1 if t else 0] += cost
    return out


def altered(text: str, part: str) -> str:
    """A written problem in which every cost of one ingredient is a hundredth of a nat more."""
    network = json.loads(text)
    for name, function in network["functions"].items():
        if name.split("_")[0] == part:
            step = 3 if len(function["scope"]) == 2 else 1
            costs = function["costs"]
            costs[step - 1 :: step] = [cost + 0.01 for cost in costs[step - 1 :: step]]
    return json.dumps(network)
