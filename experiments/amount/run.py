"""How much corpus is enough: what can be joined, in how many moves, over how many bridges, as clips are added."""

from __future__ import annotations

from typing import Any

import numpy as np

from experiments.charts import Panel, svg
from experiments.harness import Row, Setting, markdown
from experiments.material import corpus, pairs, part, posture, recorded
from motionmind import Engine
from motionmind.discretize import make_discretization
from motionmind.learned.summary import joinable

BUDGET = 20_000
DEGREES = 15.0


def jobs(setting: Setting) -> list[dict[str, Any]]:
    data = str(setting.data) if setting.data else None
    names = ["karate"] if setting.quick else ["ballet", *recorded(data, "cmu-05")]
    out = []
    for name in names:
        clips = len(corpus(data, name).clips)
        sizes = sorted({1, clips} | ({2, 4, 8, 16, 32, 64} & set(range(clips)) if not setting.quick else set()))
        orders = range(1 if setting.quick else 3)
        out += [
            {
                "data": data,
                "name": name,
                "clips": size,
                "mirror": mirror,
                "order": order,
                "count": 3 * 10 ** (not setting.quick),
            }
            for order in orders
            for size in sizes
            for mirror in (False, True)
        ]
    return out


def work(data: str | None, name: str, clips: int, mirror: bool, order: int, count: int) -> list[Row]:
    """Learn from some clips, in random order, and make tweens between postures of all of them."""
    whole = corpus(data, name)
    drawn = np.random.default_rng(order).permutation(len(whole.clips))[:clips]
    small = part(whole, drawn, mirror)
    found = Engine.learn(small, make_discretization("codebook", DEGREES))
    moves, attested, bridges, off = [], [], [], []
    for a, b in pairs(whole, count, 0):
        tween = found.tween(posture(whole, a), posture(whole, b), node_budget=BUDGET)
        moves.append(tween.moves)
        attested.append(tween.attested)
        bridges.append(sum(bridge.degrees for bridge in tween.bridges))
        off.append(tween.snap_degrees[:, : len(whole.skeleton)].mean())
    return [
        {
            "corpus": name,
            "mirror": mirror,
            "order": order,
            "clips": clips,
            "postures": sum(len(whole.clips[number]) for number in drawn),
            "states": found.space.sizes[: len(whole.skeleton)].sum(),
            "joinable": joinable(found.grammar, np.asarray(found.states), 2000, 0),
            "moves": np.mean(moves),
            "attested": np.mean(attested),
            "bridged_degrees": np.mean(bridges),
            "off_degrees": np.mean(off),
        }
    ]


def chart(rows: list[Row]) -> str:
    panels = []
    for name in dict.fromkeys(row["corpus"] for row in rows):
        for title, y in (
            ("joinable pairs", "joinable"),
            ("moves of a tween", "moves"),
            ("attested", "attested"),
            ("degrees bridged a tween", "bridged_degrees"),
            ("degrees A and B are off", "off_degrees"),
            ("states", "states"),
        ):
            panel = Panel(f"{name}: {title}", "clips", y.replace("_", " "), log=True)
            for mirror in (False, True):
                mine = [row for row in means(rows) if row["corpus"] == name and row["mirror"] == mirror]
                panel.series["mirrored too" if mirror else "as they are"] = [(row["clips"], row[y]) for row in mine]
            panels.append(panel)
    return svg(panels)


def tell(rows: list[Row]) -> str:
    return markdown(
        {
            "corpus": lambda r: r["corpus"],
            "clips": lambda r: r["clips"],
            "postures": lambda r: f"{r['postures']:.0f}",
            "mirrored too": lambda r: "yes" if r["mirror"] else "",
            "joinable": lambda r: f"{r['joinable']:.0%}",
            "moves": lambda r: f"{r['moves']:.1f}",
            "attested": lambda r: f"{r['attested']:.1%}",
            "bridged": lambda r: f"{r['bridged_degrees']:.0f}°",
            "A and B off": lambda r: f"{r['off_degrees']:.1f}°",
        },
        means(rows),
    )


def means(rows: list[Row]) -> list[Row]:
    """Return the mean over the orders in which clips were added."""
    groups: dict[tuple[str, int, bool], list[Row]] = {}
    for row in rows:
        groups.setdefault((row["corpus"], row["clips"], row["mirror"]), []).append(row)
    return [
        {
            key: value
            if isinstance(value, str | bool)
            else float(np.mean([row[key] for row in group]))
            if key != "clips"
            else value
            for key, value in group[0].items()
        }
        for group in groups.values()
    ]
