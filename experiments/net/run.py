"""Does the net matter: tweens without coordination, with postures' and with progressions', beside what was danced."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from experiments.charts import Panel, svg
from experiments.harness import Row, Setting, markdown
from experiments.material import FPS, TOLD_APART, movement, recorded, without
from motionmind import Skeleton
from motionmind._typing import Bools, Floats
from motionmind.body.anatomy_file import anatomy_named as anatomy
from motionmind.body.contact import find_feet, find_floor
from motionmind.geometry import rotations as rot
from motionmind.metrics.inbetween import l2q
from motionmind.metrics.smoothness import angular_speed
from motionmind.metrics.style import StyleClassifier, fit_style_classifier
from motionmind.render.body_shape import shape_of

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
    """Make tweens between postures of one sequence 2 s apart, with what was learned from the other sequences."""
    found, classifier = without(data, name, sequence), style_classifier(data, name)
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
        asked = {"duration": SECONDS, "node_budget": BUDGET, "fps": FPS}
        for kind, more in (*((scheme, {"coordination": scheme, "guide": 0.0}) for scheme in SCHEMES), ("guided", {})):
            motion = found.tween(real.posture(0), real.posture(-1), **asked, **more).motion
            made[kind] = motion.rotations, motion.root
        for kind, (rotations, root) in made.items():
            legs, others = collides(piece.skeleton, rotations, root)
            turned = [piece.skeleton.global_rotations(q[1:-1]) for q in (real.rotations, rotations)]
            out.append(
                {
                    "corpus": name,
                    "sequence": sequence,
                    "window": int(number),
                    "kind": kind,
                    "taken": int(classifier.takes(rotations[:FRAMES], name, sequence)),
                    "distance": classifier.distance(rotations[:FRAMES], name, sequence),
                    "speed": angular_speed(rotations, FPS).mean(),
                    "legs_collide": legs.mean(),
                    "others_collide": others.mean(),
                    "off_balance_cm": off_balance(piece.skeleton, rotations, root),
                    "l2q": l2q(*turned),
                }
            )
    return out


@lru_cache(maxsize=1)
def style_classifier(data: str | None, name: str) -> StyleClassifier:
    """Fit the classifier that tells the corpus from others."""
    names = [name, *recorded(data, *(other for other in TOLD_APART if other != name))] if name in TOLD_APART else []
    return fit_style_classifier(
        {
            one: {seq: [piece.rotations for piece in pieces] for seq, pieces in movement(data, one, FRAMES).items()}
            for one in names or ["karate", "ballet"]
        },
        FRAMES,
    )


# --- what bodies cannot do --------------------------------------------------------------------------------------------


def collides(skeleton: Skeleton, rotations: Floats, root: Floats) -> tuple[Bools, Bools]:
    """Tell whether the legs, and whether any two other parts that are apart at rest, overlap by more than 1 cm [T]."""
    body = shape_of(skeleton)
    rest = _deepest(skeleton, np.tile(rot.IDENTITY, (1, len(skeleton), 1)), np.zeros((1, 3)))[0]
    parts = np.array(body.parts[: len(body.cones)])
    apart = (rest < 0.0) & (parts[:, None] != parts[None, :])
    leg = np.array([part.endswith(("thigh", "kneecap", "shank", "foot")) for part in parts])
    legs = leg[:, None] & leg[None, :]
    deep = _deepest(skeleton, rotations, root) > DEEP
    return np.any(deep[:, apart & legs], axis=1), np.any(deep[:, apart & ~legs], axis=1)


def _deepest(skeleton: Skeleton, rotations: Floats, root: Floats) -> Floats:
    """Return how deep each pair of the body's round cones overlaps [T, N, N], metres; negative if apart."""
    cones, _ = shape_of(skeleton).solids(rotations, root)
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
    """Return how far the centre of mass is outside the support of the feet, cm: the mean over frames with a foot
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


MEASURES = {
    "taken": ("taken for the corpus", "{:.0%}"),
    "distance": ("distance in style", "{:.2f}"),
    "speed": ("angular speed, rad/s", "{:.2f}"),
    "legs_collide": ("frames in which legs collide", "{:.1%}"),
    "others_collide": ("or other parts", "{:.1%}"),
    "off_balance_cm": ("off balance, cm", "{:.1f}"),
    "l2q": ("L2Q", "{:.3f}"),
}
BOOTSTRAPS = 2000
COMPARED = (
    ("posture", "none"),
    ("progression", "none"),
    ("progression", "posture"),
    ("posture", "slerp"),
    ("guided", "posture"),
)


def chart(rows: list[Row]) -> str:
    panels = []
    for key, (title, _) in MEASURES.items():
        panel = Panel(title, "a dot a sequence, at the right their mean", "", joined=False, numbered=False)
        for place, kind in enumerate(("danced", "slerp", *SCHEMES, "guided")):
            by_sequence = _by_sequence(rows, kind, key)
            found = [(place + 0.3 * n / len(by_sequence), _mean(v)) for n, v in enumerate(by_sequence.values())]
            panel.series[kind] = [*found, (place + 0.5, _mean([v for values in by_sequence.values() for v in values]))]
        panels.append(panel)
    return svg(panels)


def tell(rows: list[Row]) -> str:
    kinds = list(dict.fromkeys(row["kind"] for row in rows))
    first = [
        {"kind": kind} | {key: _mean([r[key] for r in rows if r["kind"] == kind]) for key in MEASURES} for kind in kinds
    ]
    columns = {"": lambda r: r["kind"]} | {
        title: lambda r, key=key, how=how: how.format(r[key]) for key, (title, how) in MEASURES.items()
    }
    second = [
        {"kind": f"{one} less {other}"} | {key: _difference(rows, one, other, key) for key in MEASURES}
        for one, other in COMPARED
    ]
    between = {"": lambda r: r["kind"]} | {
        title: lambda r, key=key, how=how: "{} ({} to {})".format(*map(how.format, r[key]))
        for key, (title, how) in MEASURES.items()
    }
    windows = len(rows) // len(kinds)
    return (
        f"{windows} windows of {len({row['sequence'] for row in rows})} sequences.\n\n{markdown(columns, first)}\n\n"
        f"Differences, with 95 % intervals by drawing sequences again:\n\n{markdown(between, second)}"
    )


def _by_sequence(rows: list[Row], kind: str, key: str) -> dict[str, list[float]]:
    out: dict[str, list[float]] = {}
    for row in rows:
        if row["kind"] == kind:
            out.setdefault(row["sequence"], []).append(row[key])
    return out


def _difference(rows: list[Row], one: str, other: str, key: str) -> tuple[float, float, float]:
    """Return the mean difference over windows of one kind and another, and its 95 % interval over sequences."""
    mine, theirs = _by_sequence(rows, one, key), _by_sequence(rows, other, key)
    found = [np.subtract(mine[sequence], theirs[sequence]) for sequence in mine]
    rng = np.random.default_rng(0)
    drawn = rng.integers(len(found), size=(BOOTSTRAPS, len(found)))
    means = [_mean(np.concatenate([found[n] for n in row]).tolist()) for row in drawn]
    return _mean(np.concatenate(found).tolist()), *np.nanpercentile(means, [2.5, 97.5])


def _mean(values: list[float]) -> float:
    found = [value for value in values if np.isfinite(value)]
    return float(np.mean(found)) if found else float("nan")
