"""Random far pairs: how often a viewer sees what no dancer does, and how long movements take for how far a way."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from scipy.stats import spearmanr

from experiments.charts import Panel, svg
from experiments.harness import Row, Setting, markdown
from experiments.material import FPS, engine, recorded
from experiments.wince.dancers import MEASURES, Dancers, Seen, dancers, nearer, on_the_same_spot, see
from motionmind import Motion, NoPathError, Posture
from motionmind._typing import Bools, Floats
from motionmind.body.plausibility import GRAVITY_MPS2
from motionmind.body.support import standing_rise
from motionmind.geometry import rotations as rot
from motionmind.learned.pace import way_between

PAIRS, ONE_LEG, JUMPS = 120, 100, 90  # of each corpus
BUDGET = 20_000
MAKERS = ("motionmind", "eased")
LIFTED = 0.02  # metres by which a standing foot may rise
CROSSED = 0.03  # metres
LEAP = 1.0  # metres: no jump goes farther
NEAR_GRAVITY = 0.2  # of it


def jobs(setting: Setting) -> list[dict[str, Any]]:
    data = str(setting.data) if setting.data else None
    by = ["ballet"] if setting.quick else ["ballet", "karate", *recorded(data, *RECORDINGS)]
    share = 0.05 if setting.quick else 1.0
    counts = {"pairs": round(share * PAIRS), "one_leg": round(share * ONE_LEG), "jumps": round(share * JUMPS)}
    return [{"data": data, "by": one, "seed": 1} | counts for one in by]


RECORDINGS = ("cmu-05", "indian", "cmu-16", "cmu-135", "bandai")  # no constant was chosen on the last


def work(data: str | None, by: str, seed: int, pairs: int, one_leg: int, jumps: int) -> list[Row]:
    """Fill pairs of one corpus: a row a pair and maker. What holds for all of a maker's pairs stands in each."""
    found, danced = engine(data, by), dancers(data, by)
    rows: list[Row] = []
    bounces: dict[str, list[Floats]] = {maker: [] for maker in MAKERS}
    for number, (kind, a, b) in enumerate(pairs_of(danced, seed, pairs, one_leg, jumps)):
        way = float(found.pace.expected(way_between(a, b), (np.ones(()), np.ones(()))))
        try:
            tween = found.tween(a, b, node_budget=BUDGET, fps=float(FPS))
        except NoPathError:
            rows += [row_of(by, kind, number, maker, a, b, way) for maker in MAKERS]
            continue
        for maker in MAKERS:
            motion = tween.motion if maker == "motionmind" else eased(a, b, len(tween.motion))
            seen = see(motion)
            rows.append(row_of(by, kind, number, maker, a, b, way, motion, seen, danced))
            if kind == "far":
                bounces[maker].append(seen.bounce)
    own = own_of(danced)
    pooled = {maker: np.concatenate([*values, np.zeros(0)]) for maker, values in bounces.items()}
    bounce = {
        maker: float(np.percentile(values, 99.0)) / danced.bounce if len(values) else float("nan")
        for maker, values in pooled.items()
    }
    return [row | {"bounce": bounce[row["maker"]]} | own for row in rows]


def pairs_of(danced: Dancers, seed: int, far: int, one_leg: int, jumps: int) -> list[tuple[str, Posture, Posture]]:
    """Return the kind and both postures of random pairs of each kind, so many of each."""
    ends = danced.ends
    return [
        *(("far", ends[i], ends[k]) for i, k in danced.far_pairs(far, seed)),
        *(("one leg", ends[i], on_the_same_spot(ends[i], ends[k])) for i, k in danced.one_leg_pairs(one_leg, seed)),
        *(("jump", ends[i], nearer(ends[i], ends[k], LEAP)) for i, k in danced.jumps(jumps, seed)),
    ]


def own_of(danced: Dancers) -> Row:
    """Return how often the dancers skate, move their feet fast, and fall freely in the air."""
    return {
        "own_skates": max(float(np.concatenate([seen.skates for seen in danced.seen]).mean()), 1e-6),
        "own_swings": float(np.concatenate([seen.swings for seen in danced.seen]).mean()),
        "own_falls": _share_of_falls([seen.fall for seen in danced.seen]),
    }


def eased(a: Posture, b: Posture, frames: int) -> Motion:
    """Each joint the short way, and the root straight, from rest to rest."""
    share = np.linspace(0.0, 1.0, frames)
    share = share * share * (3.0 - 2.0 * share)
    rotations = rot.normalise(rot.slerp(a.rotations, b.rotations, share[:, None]))
    root = a.root + share[:, None] * (b.root - a.root)
    return Motion(a.skeleton, rotations, root, np.arange(frames) / FPS)


def row_of(
    by: str,
    kind: str,
    number: int,
    maker: str,
    a: Posture,
    b: Posture,
    way: float,
    motion: Motion | None = None,
    seen: Seen | None = None,
    danced: Dancers | None = None,
) -> Row:
    """What is seen of one movement; of one that was not found, that it was not."""
    turns = rot.angle(a.rotations, b.rotations)
    row: Row = {
        "by": by,
        "kind": kind,
        "pair": number,
        "maker": maker,
        "solved": int(motion is not None),
        "seconds": float("nan"),
        "travel": float(np.hypot(*(b.root - a.root)[[0, 2]])),
        "turn": float(turns.mean()),
        "way": way,
        "own": float("nan"),
        "own_leans": float("nan"),
        "own_rests": float("nan"),
        "own_stays": float("nan"),
        "any": 0,
        **dict.fromkeys(MEASURES, float("nan")),
        "leans": 0,
        "rests": 0,
        "stays": 0,
        "crossed": 0,
        "given_crossed": 0,
        "rise": float("nan"),
        "skates": float("nan"),
        "swings": float("nan"),
        "airborne": 0,
        "falls": 0,
    }
    if motion is None or seen is None or danced is None:
        return row
    worst, limits = danced.worst(seen), danced.limits(len(motion))
    leans, rests, stays = np.any(seen.lean > danced.lean, axis=0)
    return row | {
        "seconds": float(motion.times[-1]),
        "own": limits.own,
        "own_leans": float(limits.leans[0]),
        "own_rests": float(limits.leans[1]),
        "own_stays": float(limits.leans[2]),
        "any": int(max(worst.values()) > 1.0),
        **worst,
        "leans": int(leans),
        "rests": int(rests),
        "stays": int(stays),
        "crossed": int(seen.greatest["legs"].max() > CROSSED),
        "given_crossed": int(seen.greatest["legs"][[0, -1]].max() > CROSSED),
        "rise": standing_rise(motion.skeleton, motion.rotations, motion.root) if kind == "one leg" else float("nan"),
        "skates": float(seen.skates.mean()) if len(seen.skates) else 0.0,
        "swings": float(seen.swings.mean()) if len(seen.swings) else 0.0,
        "airborne": len(seen.fall),
        "falls": int(_is_falling(seen.fall).sum()),
    }


def _is_falling(accelerations: Floats) -> Bools:
    return np.asarray(np.abs(accelerations + GRAVITY_MPS2) < NEAR_GRAVITY * GRAVITY_MPS2)


def _share_of_falls(accelerations: list[Floats]) -> float:
    all_of = np.concatenate([*accelerations, np.zeros(0)])
    return float(_is_falling(all_of).mean()) if len(all_of) else float("nan")


# --- what is told -----------------------------------------------------------------------------------------------------


def tell(rows: list[Row]) -> str:
    far = [row for row in rows if row["kind"] == "far" and row["solved"]]
    columns: dict[str, Callable[[Row], object]] = {
        "pairs of": lambda r: r["by"],
        "made by": lambda r: r["maker"],
        "beyond the dancers in any": lambda r: _interval(r["rows"], "any"),
        "their own windows": lambda r: f"{_mean(r['rows'], 'own'):.1%}",
        **{name: _share_column(name) for name in MEASURES},
    }
    seen: dict[str, Callable[[Row], object]] = {
        "pairs of": lambda r: r["by"],
        "made by": lambda r: r["maker"],
        "bounce over the dancers'": lambda r: f"{r['rows'][0]['bounce']:.2f}",
        "leans": lambda r: _leans(r["rows"], "leans"),
        "their own windows": lambda r: _percent(_mean(r["rows"], "own_leans")),
        "leans at rest": lambda r: _leans(r["rows"], "rests"),
        "their own, at rest": lambda r: _percent(_mean(r["rows"], "own_rests")),
        "at rest for 0.1 s": lambda r: _leans(r["rows"], "stays"),
        "their own, at rest for 0.1 s": lambda r: _percent(_mean(r["rows"], "own_stays")),
        "legs over 3 cm": lambda r: _interval(r["rows"], "crossed"),
        "not given so": lambda r: sum(row["crossed"] > row["given_crossed"] for row in r["rows"]),
        "skates over the dancers'": lambda r: f"{_mean(r['rows'], 'skates') / r['rows'][0]['own_skates']:.2f}",
        "of fast feet": lambda r: f"{_skates_of_swings(r['rows']):.2f}",
        "standing feet that rise": lambda r: _rises(r["one leg"]),
        "falls in the air": lambda r: _falls(r["rows"] + r["jump"]),
        "their own": lambda r: _percent(r["rows"][0]["own_falls"]),
    }
    lasts: dict[str, Callable[[Row], object]] = {
        "pairs of": lambda r: r["by"],
        "solved": lambda r: f"{r['solved']:.0%}",
        "median": lambda r: f"{np.median(_all(r['rows'], 'seconds')):.2f} s",
        "10 to 90 %": lambda r: "{:.2f} to {:.2f} s".format(*np.percentile(_all(r["rows"], "seconds"), [10, 90])),
        "with travel": lambda r: f"{_spearman(r['rows'], 'travel'):.2f}",
        "with turn": lambda r: f"{_spearman(r['rows'], 'turn'):.2f}",
        "with both": lambda r: f"{_spearman(r['rows'], 'both'):.2f}",
        "with both at usual speeds": lambda r: f"{_spearman(r['rows'], 'way'):.2f}",
    }
    groups = _groups(rows, far)
    mine = [group for group in groups if group["maker"] == MAKERS[0]]
    return "\n\n".join(
        [
            "### Beyond the dancers",
            markdown(columns, groups),
            "### What is seen",
            markdown(seen, groups),
            "### How long it takes: seconds, and rank correlation with how far it is",
            markdown(lasts, mine),
        ]
    )


def _groups(rows: list[Row], far: list[Row]) -> list[Row]:
    """The solved rows of each corpus and maker."""
    out: list[Row] = []
    for by, maker in dict.fromkeys((row["by"], row["maker"]) for row in far):
        mine = [row for row in rows if (row["by"], row["maker"]) == (by, maker)]
        solved = [row for row in mine if row["solved"]]
        out.append(
            {
                "by": by,
                "maker": maker,
                "rows": _with_both([row for row in solved if row["kind"] == "far"]),
                "one leg": [row for row in solved if row["kind"] == "one leg"],
                "jump": [row for row in solved if row["kind"] == "jump"],
                "solved": len(solved) / len(mine),
            }
        )
    return out


def _with_both(rows: list[Row]) -> list[Row]:
    """Rows with how far it is: the sum of travel and turn, each over its mean."""
    travel, turn = (max(_mean(rows, name), 1e-9) for name in ("travel", "turn"))
    return [row | {"both": row["travel"] / travel + row["turn"] / turn} for row in rows]


def _all(rows: Iterable[Row], name: str) -> Floats:
    return np.array([row[name] for row in rows], dtype=float)


def _mean(rows: Iterable[Row], name: str) -> float:
    return float(_all(rows, name).mean())


def _share_column(name: str) -> Callable[[Row], object]:
    """The share of movements beyond the limit of one measure."""
    return lambda r: f"{(_all(r['rows'], name) > 1.0).mean():.0%}"


def _interval(rows: list[Row], name: str) -> str:
    """The share of rows that are so, with the interval (95 %) of 4,000 draws of pairs."""
    values = _all(rows, name)
    draws = np.random.default_rng(0).integers(len(values), size=(4000, len(values)))
    low, high = np.percentile(values[draws].mean(axis=1), [2.5, 97.5])
    return f"{values.mean():.0%} ({low:.0%} to {high:.0%})"


def _leans(rows: list[Row], name: str) -> str:
    """Return the share of movements that lean, with its interval; none where the dancers do not say what is usual."""
    return _interval(rows, name) if np.isfinite(_mean(rows, f"own_{name}")) else "none"


def _skates_of_swings(rows: list[Row]) -> float:
    """Return how much of the time in which feet are fast they skate, over the dancers'."""
    own = rows[0]["own_skates"] / rows[0]["own_swings"]
    return _mean(rows, "skates") / max(_mean(rows, "swings"), 1e-9) / own


def _rises(rows: list[Row]) -> str:
    """Of the movements that stand on one foot, how many lift it."""
    known = _all(rows, "rise")
    known = known[np.isfinite(known)]
    return f"{int((known > LIFTED).sum())} of {len(known)}"


def _percent(share: float) -> str:
    return f"{share:.0%}" if np.isfinite(share) else "none"


def _falls(rows: list[Row]) -> str:
    """The share of frames in the air that fall freely, and how many there are."""
    airborne = int(_all(rows, "airborne").sum())
    return f"{_all(rows, 'falls').sum() / airborne:.0%} of {airborne}" if airborne else "none"


def _spearman(rows: list[Row], name: str) -> float:
    return float(spearmanr(_all(rows, "seconds"), _all(rows, name)).statistic)


def chart(rows: list[Row]) -> str:
    """How long a movement takes for how far a way, a panel a corpus."""
    panels = []
    for by in dict.fromkeys(row["by"] for row in rows):
        panel = Panel(f"by {by}", "travel, metres", "seconds", joined=False)
        mine = [row for row in rows if row["by"] == by and row["maker"] == MAKERS[0] and row["kind"] == "far"]
        for name, any_ in (("as the dancers do", 0), ("beyond them", 1)):
            panel.series[name] = [(row["travel"], row["seconds"]) for row in mine if row["any"] == any_]
        panels.append(panel)
    return svg(panels)
