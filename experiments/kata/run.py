"""Kata: do the steps of a recorded Heian Shodan, transcribed, agree with the composed one?"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from experiments.harness import Row, Setting, markdown
from experiments.kata.drawing import draw
from experiments.kata.steps import N_SECTORS, Aligned, Step, aligned_supports, best_alignment, danced, sector_of
from experiments.material import recorded
from motionmind._typing import Ints

RECORDED, COMPOSED = "cmu-135/135_06", "karate/heian-shodan"
OTHERS = ("taikyoku-shodan", "heian-nidan", "heian-sandan")
EMPI = ("cmu-135/135_02", "cmu-135/135_03")
N_SHUFFLES = 500
ALIKE_DEG = 45.0  # between directions, or facings, of steps that are alike
WORDS = ("ahead", "ahead left", "left", "back left", "back", "back right", "right", "ahead right")
FEET = ("left", "right")


def jobs(setting: Setting) -> list[dict[str, Any]]:
    if setting.quick:
        return [{"data": None, "one": COMPOSED, "other": "karate/taikyoku-shodan", "mirror": None, "shuffles": 5}]
    if not recorded(setting.data, "cmu-135"):
        return []
    pairs = [(RECORDED, COMPOSED, None), ("transcribed/heian-shodan", COMPOSED, None), (RECORDED, COMPOSED, True)]
    pairs += [(RECORDED, f"karate/{clip}", None) for clip in OTHERS]
    pairs += [(clip, COMPOSED, None) for clip in EMPI]
    data = str(setting.data)
    return [
        {"data": data, "one": one, "other": other, "mirror": mirror, "shuffles": N_SHUFFLES}
        for one, other, mirror in pairs
    ]


def work(data: str | None, one: str, other: str, mirror: bool | None, shuffles: int) -> list[Row]:
    """Align two kata's steps, and the first's with the second's in random orders; a row for each pair of steps.

    `mirror` says whether the second is mirrored; None chooses.
    """
    a, b = danced(data, one), danced(data, other)
    sides = (False, True) if mirror is None else (mirror,)
    aligned = best_alignment(a, b, sides)
    rng = np.random.default_rng(0)
    random = [
        sum(_agrees(row) for row in _paired(best_alignment(a, b.in_order(rng.permutation(len(b.steps))), sides)))
        for _ in range(shuffles)
    ]
    known = {
        "one": one,
        "other": other,
        "mirror": mirror,
        "turned": 360.0 / N_SECTORS * aligned.sectors,
        "mirrored": aligned.mirrored,
        "cost": aligned.cost,
        "random": float(np.mean(random)),
        "random_95": float(np.percentile(random, 95.0)),
        **_compared(*aligned_supports(aligned)),
    }
    return [known | row for row in _paired(aligned)]


def _paired(aligned: Aligned) -> list[Row]:
    """Return both steps of each pair, and by how many degrees directions and facings differ; "" if unpaired."""
    out = []
    for i, j in aligned.pairs:
        a, b = None if i is None else aligned.one.steps[i], None if j is None else aligned.other.steps[j]
        row = _reported("one", a) | _reported("other", b) | {"direction": "", "facing": ""}
        if a and b:
            apart = 360.0 / N_SECTORS * (sector_of(np.array(a.to)) - sector_of(np.array(b.to)))
            row |= {"direction": _wrapped(float(apart)), "facing": _wrapped(a.facing - b.facing)}
        out.append(row)
    return out


def _wrapped(degrees: float) -> float:
    return abs((degrees + 180.0) % 360.0 - 180.0)


def _agrees(row: Row) -> bool:
    """Return whether both steps of a row are alike: the same foot, and directions and facings within 45 degrees."""
    return bool(row["direction"] != "" and max(row["direction"], row["facing"]) <= ALIKE_DEG)


def _compared(a: Ints, b: Ints) -> Row:
    """Compare two kata's supports [T]: how far they agree, also beyond chance (kappa), and how often no foot bears."""
    agree = float(np.mean(a == b))
    shares = [np.bincount(each, minlength=4) / len(each) for each in (a, b)]
    chance = float(shares[0] @ shares[1])
    return {
        "agree": agree,
        "kappa": (agree - chance) / (1.0 - chance),
        "opposite": float(np.mean(((a == 1) & (b == 2)) | ((a == 2) & (b == 1)))),
        "none_one": float(shares[0][0]),
        "none_other": float(shares[1][0]),
    }


def _reported(whose: str, step: Step | None) -> Row:
    """Return the foot, and the sectors of its direction and of the facing: nothing by which a performance is copied."""
    if step is None:
        return {f"{key}_{whose}": "" for key in ("foot", "to", "facing")}
    to, facing = (int(sector_of(np.array(degrees))) for degrees in (step.to, step.facing))
    return {f"foot_{whose}": step.foot, f"to_{whose}": to, f"facing_{whose}": facing}


# --- report -----------------------------------------------------------------------------------------------------------


def chart(rows: list[Row]) -> str:
    return draw(_pairs(rows)[0])


def _pairs(rows: list[Row]) -> list[list[Row]]:
    """Group the rows by pairs of kata."""
    keys = list(dict.fromkeys((row["one"], row["other"], row["mirror"]) for row in rows))
    return [[row for row in rows if (row["one"], row["other"], row["mirror"]) == key] for key in keys]


def tell(rows: list[Row]) -> str:
    columns: dict[str, Callable[[Row], object]] = {
        "kata": lambda r: r["one"],
        "beside": lambda r: r["other"],
        "turned by": lambda r: f"{r['turned']:.0f}" + ", mirrored" * r["mirrored"],
        "steps": lambda r: f"{r['ones']} / {r['others']}",
        "only in one": lambda r: f"{r['ones'] - r['paired']} / {r['others'] - r['paired']}",
        "same foot": lambda r: r["paired"],
        "and direction": lambda r: r["same"],
        "direction within 45°": lambda r: r["near"],
        "and facing: alike": lambda r: r["alike"],
        "alike if shuffled: mean, 95 %": lambda r: f"{r['random']:.1f}, {r['random_95']:.0f}",
        "cost": lambda r: f"{r['cost']:.1f}",
        "support agrees, %": lambda r: f"{100.0 * r['agree']:.0f}",
        "kappa": lambda r: f"{r['kappa']:.2f}",
        "left in one, right in the other, %": lambda r: f"{100.0 * r['opposite']:.0f}",
        "no foot bears, %": lambda r: f"{100.0 * r['none_one']:.0f} / {100.0 * r['none_other']:.0f}",
    }
    pairs = _pairs(rows)
    return (
        f"{markdown(columns, [_summary(pair) for pair in pairs])}\n\n"
        f"Step by step, {pairs[0][0]['one']} beside {pairs[0][0]['other']}:\n\n{markdown(_STEPS, _numbered(pairs[0]))}"
    )


def _numbered(pair: list[Row]) -> list[Row]:
    return [row | {"number": number} for number, row in enumerate(pair, start=1)]


def _summary(pair: list[Row]) -> Row:
    both = [row for row in pair if row["direction"] != ""]
    return pair[0] | {
        "ones": sum(row["foot_one"] != "" for row in pair),
        "others": sum(row["foot_other"] != "" for row in pair),
        "paired": len(both),
        "same": sum(row["direction"] == 0.0 for row in both),
        "near": sum(row["direction"] <= ALIKE_DEG for row in both),
        "alike": sum(map(_agrees, both)),
    }


def _step(row: Row, whose: str) -> str:
    if row[f"foot_{whose}"] == "":
        return ""
    foot = FEET[row[f"foot_{whose}"]]
    return f"{foot} foot {WORDS[row[f'to_{whose}']]}, facing {WORDS[row[f'facing_{whose}']]}"


_STEPS: dict[str, Callable[[Row], object]] = {
    "step": lambda r: r["number"],
    "recorded": lambda r: _step(r, "one"),
    "composed": lambda r: _step(r, "other"),
    "directions apart, degrees": lambda r: "" if r["direction"] == "" else f"{r['direction']:.0f}",
    "facings apart": lambda r: "" if r["facing"] == "" else f"{r['facing']:.0f}",
}
