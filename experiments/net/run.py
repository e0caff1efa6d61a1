"""Does the net matter: tweens without coordination, with postures' and with progressions', beside what was danced."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.charts import Panel, svg
from experiments.harness import Row, Setting, markdown
from experiments.material import FPS, RECORDED, movement, recorded, without
from motionmind import Skeleton
from motionmind import rotations as rot
from motionmind.metrics import Judge, find_feet, find_floor, find_judge, l2q
from motionmind.notation.body_file import body as anatomy
from motionmind.render.anatomy import body_of

Floats = NDArray[np.float64]

SECONDS = 2.0
FRAMES = round(SECONDS * FPS)
SCHEMES = ("none", "posture", "progression")
BUDGET = 20_000
DEEP = 0.01  # metres that one part of the body may reach into another before it counts
LOW = 0.05  # metres; a foot that is lower bears weight
POINTS = 5  # along each limb, at which collisions are looked for


def jobs(setting: Setting) -> list[dict[str, Any]]:
    data = str(setting.data) if setting.data else None
    name = next(iter(recorded(data, "cmu-05")), "karate")
    sequences = list(movement(data, name, FRAMES))
    return [
        {"data": data, "name": name, "sequence": sequence, "windows": 1 if setting.quick else 8, "seed": 0}
        for sequence in (sequences[:1] if setting.quick else sequences)
    ]


def work(data: str | None, name: str, sequence: str, windows: int, seed: int) -> list[Row]:
    """Tweens between postures of one sequence that lie 2 s apart, by what was learned from the others."""
    found, who = without(data, name, sequence), judge(data, name)
    places = [
        (piece, start)
        for piece in movement(data, name, FRAMES)[sequence]
        for start in range(0, len(piece) - FRAMES, FPS)
    ]
    rng = np.random.default_rng(seed)
    out = []
    for number in sorted(rng.permutation(len(places))[:windows]):
        piece, start = places[number]
        real = piece.slice(start, start + FRAMES + 1)
        share = np.linspace(0.0, 1.0, FRAMES + 1)[:, None]
        made = {
            "danced": (real.rotations, real.root),
            "slerp": (
                rot.slerp(real.rotations[:1], real.rotations[-1:], share),
                real.root[0] + share * (real.root[-1] - real.root[0]),
            ),
        }
        for scheme in SCHEMES:
            tween = found.tween(
                real.posture(0), real.posture(-1), duration=SECONDS, coordination=scheme, node_budget=BUDGET, fps=FPS
            )
            made[scheme] = tween.motion.rotations, tween.motion.root
        for kind, (rotations, root) in made.items():
            turned = [piece.skeleton.global_rotations(q[1:-1]) for q in (real.rotations, rotations)]
            out.append(
                {
                    "corpus": name,
                    "sequence": sequence,
                    "window": int(number),
                    "kind": kind,
                    "taken": int(who.takes(rotations[:FRAMES], name, sequence)),
                    "distance": who.distance(rotations[:FRAMES], name, sequence),
                    "collides": collides(piece.skeleton, rotations, root).mean(),
                    "off_balance_cm": off_balance(piece.skeleton, rotations, root),
                    "l2q": l2q(*turned),
                }
            )
    return out


@lru_cache(maxsize=1)
def judge(data: str | None, name: str) -> Judge:
    """Who tells the corpus from others."""
    names = [name, *recorded(data, *(other for other in RECORDED if other != name))] if name in RECORDED else []
    return find_judge(
        {
            one: {seq: [piece.rotations for piece in pieces] for seq, pieces in movement(data, one, FRAMES).items()}
            for one in names or ["karate", "ballet"]
        },
        FRAMES,
    )


# --- what bodies cannot do --------------------------------------------------------------------------------------------


def collides(skeleton: Skeleton, rotations: Floats, root: Floats) -> NDArray[np.bool_]:
    """Whether two parts of the body that are apart when it rests reach into each other by more than 1 cm [T]."""
    body = body_of(skeleton)
    rest = _deepest(skeleton, np.tile(rot.IDENTITY, (1, len(skeleton), 1)), np.zeros((1, 3)))[0]
    parts = np.array(body.parts[: len(body.cones)])
    apart = (rest < 0.0) & (parts[:, None] != parts[None, :])
    return np.any(_deepest(skeleton, rotations, root)[:, apart] > DEEP, axis=1)


def _deepest(skeleton: Skeleton, rotations: Floats, root: Floats) -> Floats:
    """How far each of the body's round cones reaches into each other one [T, N, N], metres; negative where apart."""
    cones, _ = body_of(skeleton).solids(rotations, root)
    share = np.linspace(0.0, 1.0, POINTS)
    centres = cones.a[..., None, :] + share[:, None] * (cones.b - cones.a)[..., None, :]
    radii = cones.a_radius[:, None] + share * (cones.b_radius - cones.a_radius)[:, None]
    count = len(radii)
    flat, size = centres.reshape(len(centres), -1, 3), radii.ravel()
    squared = np.sum(flat**2, axis=-1)
    apart = squared[:, :, None] + squared[:, None, :] - 2.0 * flat @ flat.swapaxes(1, 2)
    depth = size[:, None] + size[None, :] - np.sqrt(np.maximum(apart, 0.0))
    return np.asarray(depth.reshape(-1, count, POINTS, count, POINTS).max(axis=(2, 4)))


def off_balance(skeleton: Skeleton, rotations: Floats, root: Floats) -> float:
    """How far the centre of mass is outside what the feet on the floor enclose, cm: the mean over frames with a foot
    down. How far a point is outside a hull is the most, over directions, by which it is further than all corners."""
    mass = anatomy("human23").centre_of_mass(rotations, root)
    feet = np.array(find_feet(skeleton))
    ankles = np.array([skeleton.parents[foot] for foot in feet])
    places = skeleton.positions_and_tips(rotations, root)[:, np.stack([feet, feet + len(skeleton), ankles])]
    floor = find_floor(skeleton, rotations, root)
    down = np.repeat(places[:, :2, :, 1].min(axis=1, keepdims=True) - floor < LOW, 3, axis=1)
    turn = np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False)
    ways = np.stack([np.cos(turn), np.sin(turn)])
    corners = np.where(down[..., None], places[..., ::2] @ ways, -np.inf).max(axis=(1, 2))
    outside = (mass[:, ::2] @ ways - corners).max(axis=1).clip(0.0)
    standing = down.any(axis=(1, 2))
    return float(100.0 * outside[standing].mean()) if standing.any() else float("nan")


# --- what is told -----------------------------------------------------------------------------------------------------


def means(rows: list[Row]) -> list[Row]:
    out = []
    for kind in dict.fromkeys(row["kind"] for row in rows):
        mine = [row for row in rows if row["kind"] == kind]
        out.append({"kind": kind, "windows": len(mine)} | {k: _mean(mine, k) for k in list(rows[0])[4:]})
    return out


def _mean(rows: list[Row], key: str) -> float:
    found = [row[key] for row in rows if np.isfinite(row[key])]
    return float(np.mean(found)) if found else float("nan")


def chart(rows: list[Row]) -> str:
    panels = []
    for title, key in (
        ("taken for the corpus", "taken"),
        ("distance in style, in limits", "distance"),
        ("frames with a collision", "collides"),
        ("cm off balance", "off_balance_cm"),
        ("L2Q", "l2q"),
    ):
        panel = Panel(title, "", "", joined=False)
        for place, row in enumerate(means(rows)):
            panel.series[row["kind"]] = [(float(place), row[key])]
        panels.append(panel)
    return svg(panels, columns=5)


def tell(rows: list[Row]) -> str:
    return markdown(
        {
            "": lambda r: r["kind"],
            "windows": lambda r: r["windows"],
            "taken for the corpus": lambda r: f"{r['taken']:.0%}",
            "distance in style": lambda r: f"{r['distance']:.2f}",
            "frames with a collision": lambda r: f"{r['collides']:.1%}",
            "off balance": lambda r: f"{r['off_balance_cm']:.1f} cm",
            "L2Q": lambda r: f"{r['l2q']:.3f}",
        },
        means(rows),
    )
