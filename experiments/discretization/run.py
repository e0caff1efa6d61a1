"""Which discretization: what it keeps of the movement, and what tweens are like that are made with it."""

from __future__ import annotations

from time import perf_counter
from typing import Any

import numpy as np

from experiments.charts import Panel, svg
from experiments.harness import Row, Setting, markdown
from experiments.material import corpus, engine, pairs, part, posture, recorded
from motionmind import Engine
from motionmind.corpus.corpus import Corpus
from motionmind.discretize import make_discretization
from motionmind.geometry import rotations as rot
from motionmind.learned.summary import joinable
from motionmind.metrics.paths import learn_habits
from motionmind.metrics.smoothness import angular_jerk

BUDGET = 20_000
EXPERTS = {"ballet": "ballet", "karate": "karate"}
LEAVES = ("fingers", "toes")


def jobs(setting: Setting) -> list[dict[str, Any]]:
    data = str(setting.data) if setting.data else None
    names = ["karate"] if setting.quick else ["ballet", *recorded(data, "cmu-05")]
    kinds, degrees = ("codebook", "quaternion", "euler"), (15.0,) if setting.quick else (8.0, 11.0, 15.0, 20.0, 28.0)
    wanted = [(name, kind, d) for name in names for kind in kinds for d in degrees]
    wanted += [(name, EXPERTS[name], 15.0) for name in names if name in EXPERTS]
    return [
        {"data": data, "name": name, "kind": kind, "degrees": d, "count": 3 if setting.quick else 40, "seed": 0}
        for name, kind, d in wanted
    ]


def work(data: str | None, name: str, kind: str, degrees: float, count: int, seed: int) -> list[Row]:
    """Measure one discretization of one corpus: sizes, errors on training and held-out clips, and tweens."""
    whole = corpus(data, name)
    found = engine(data, name, kind, degrees)
    apart = np.arange(0, len(whole.clips), 5)
    rest = np.setdiff1d(np.arange(len(whole.clips)), apart)
    unseen = Engine.learn(part(whole, rest), make_discretization(kind, degrees))
    own, other = errors(found, whole, seed), errors(unseen, part(whole, apart), seed)
    habits = learn_habits(found.grammar)
    moves, attested, bridges, likely, proven = [], [], [], [], []
    began = perf_counter()
    for a, b in pairs(whole, count, seed):
        tween = found.tween(posture(whole, a), posture(whole, b), node_budget=BUDGET)
        moves.append(tween.moves)
        attested.append(tween.attested)
        bridges.append(len(tween.bridges))
        likely.append(habits.log_likelihoods(tween.path))
        proven.append(tween.status == "optimal")
    sizes = found.space.sizes[: len(whole.skeleton)]
    return [
        {
            "corpus": name,
            "kind": "expert" if kind in EXPERTS.values() else kind,
            "degrees": degrees,
            "states": sizes.sum(),
            "largest": sizes.max(),
            "error_degrees": own["degrees"],
            "error_cm": own["cm"],
            "unseen_degrees": other["degrees"],
            "unseen_cm": other["cm"],
            "jaggedness": own["jaggedness"],
            "joinable": joinable(found.grammar, np.asarray(found.states), 2000, seed),
            "moves": np.mean(moves),
            "attested": np.mean(attested),
            "bridges": np.mean(bridges),
            "log_likelihood": np.concatenate(likely).mean(),
            "proven": np.mean(proven),
            "seconds": (perf_counter() - began) / count,
        }
    ]


def errors(found: Engine, movement: Corpus, seed: int) -> dict[str, float]:
    """Measure the loss if postures of a corpus are replaced by the centres of their states.

    The loss is the mean angle over joints, degrees; the displacement of fingertips and toe tips, with the pelvis in
    place, cm; and the jerk of the sequence of states as a multiple of the movement's own.
    """
    body = movement.skeleton
    joints = len(body)
    chains = movement.to_chains(movement.rotations)
    centres = found.space.centres
    states = found.space.assign(chains)
    snapped = chains.copy()
    snapped[:, :joints] = centres[found.space.starts[:joints] + states[:, :joints]]
    there = movement.from_chains(snapped)
    some = np.random.default_rng(seed).permutation(len(movement))[:1000]
    ends = [joints + i for i, joint in enumerate(body.names) if joint.endswith(LEAVES)]
    places = [body.positions_and_tips(q[some], np.zeros((len(some), 3)))[:, ends] for q in (movement.rotations, there)]
    jerks = [
        np.concatenate([angular_jerk(q[clip.start : clip.stop], 1.0).mean(axis=1) for clip in movement.clips]).mean()
        for q in (movement.rotations, there)
    ]
    return {
        "degrees": float(np.degrees(rot.angle(chains[:, :joints], snapped[:, :joints])).mean()),
        "cm": float(100.0 * np.linalg.norm(places[1] - places[0], axis=-1).mean()),
        "jaggedness": float(jerks[1] / jerks[0]),
    }


def chart(rows: list[Row]) -> str:
    panels = []
    for name in dict.fromkeys(row["corpus"] for row in rows):
        for title, y in (
            ("cm off at hands and feet", "error_cm"),
            ("the same, unseen clips", "unseen_cm"),
            ("jaggedness", "jaggedness"),
            ("joinable pairs", "joinable"),
            ("moves of a tween", "moves"),
            ("attested", "attested"),
        ):
            panel = Panel(f"{name}: {title}", "states of all joints", y.replace("_", " "), log=True)
            for row in (row for row in rows if row["corpus"] == name):
                panel.series.setdefault(row["kind"], []).append((row["states"], row[y]))
            panel.series = {kind: sorted(points) for kind, points in panel.series.items()}
            panels.append(panel)
    return svg(panels)


def tell(rows: list[Row]) -> str:
    return markdown(
        {
            "corpus": lambda r: r["corpus"],
            "states": lambda r: r["kind"],
            "within": lambda r: f"{r['degrees']:g}°",
            "how many (largest)": lambda r: f"{r['states']} ({r['largest']})",
            "off": lambda r: f"{r['error_degrees']:.1f}°, {r['error_cm']:.1f} cm",
            "off, unseen clips": lambda r: f"{r['unseen_degrees']:.1f}°, {r['unseen_cm']:.1f} cm",
            "jaggedness": lambda r: f"{r['jaggedness']:.2f}",
            "joinable": lambda r: f"{r['joinable']:.0%}",
            "moves": lambda r: f"{r['moves']:.1f}",
            "attested": lambda r: f"{r['attested']:.1%}",
            "bridges": lambda r: f"{r['bridges']:.1f}",
            "nats a transition": lambda r: f"{r['log_likelihood']:.2f}",
            "proven": lambda r: f"{r['proven']:.0%}",
            "s": lambda r: f"{r['seconds']:.2f}",
        },
        rows,
    )
