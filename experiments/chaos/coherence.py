"""Lengths of the stretches of a piece that survive chaotic reordering: Lorenz, Rossler and baselines.

python experiments/chaos/coherence.py [--nudges 400] [--seed 0] [--csv runs.csv] [--plot runs.svg]

A stretch is a run i, i + 1, i + 2 of the piece's postures; what is compared is a variation's mean run. Only the number
of a piece's postures matters. Each of the nudges goes with a start of its own, somewhere on the attractor, so that no
two variations share their sites; its direction is random, in standard deviations of the attractor's coordinates, its
length 0.001 to 0.1 of them (uniform in the logarithm), and the same for both flows: that makes the pairs.

A flow has no frame rate: the time between its points is a choice, and runs depend on it. So the flows are compared in
three ways: with one step for both, with equally many points a turn, and with equal divergence of neighbours between
points; and along a range of the last two.
"""

import argparse
import csv
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.random import Generator

from motionmind import compose
from motionmind._typing import Floats
from motionmind.bundled import bundled
from motionmind.chaos.baselines import dabby, shuffled
from motionmind.chaos.flows import FLOWS, Flow
from motionmind.chaos.reorder import itinerary, runs
from motionmind.chaos.trajectories import largest_exponent, trajectory

Row = dict[str, Any]

PIECES = {
    "ballet jump": ("ballet/allegro.score", "jump"),
    "macarena": ("macarena/macarena.score", "macarena"),
    "karate form": ("karate/kata.score", "heian-shodan"),
    "medley": ("medley/medley.score", "medley"),
}
STEP, EVERY = 0.01, 11  # one step for both flows
POINTS_A_TURN = 9.0
FLIPS = 9_999
BOOTSTRAPS = 2_000
FEWEST = 10  # pairs for a test
RANGE = np.geomspace(0.005, 1.0, 24)  # nats by which neighbours part from one point to the next
CURVE_PIECE, CURVE_NUDGES = "medley", 200


@dataclass(frozen=True)
class Known:
    """A flow with properties of its attractor: the exponent, the time of a turn, the spread, and starts on it."""

    flow: Flow
    exponent: float
    turn: float
    spread: Floats
    starts: Floats

    @classmethod
    def of(cls, name: str, count: int) -> "Known":
        flow = FLOWS[name]
        points = trajectory(flow, count=400_000, every=1)
        z = points[:, 2]
        turns = np.sum((z[1:-1] > z[:-2]) & (z[1:-1] >= z[2:]))
        starts = trajectory(flow, count=count, every=2_000)
        return cls(flow, largest_exponent(flow), len(z) * flow.step / float(turns), points.std(axis=0), starts)

    def sampling(self, interval: float) -> tuple[int, float]:
        """Return the number of steps between points `interval` apart, and the step, no longer than the flow's own."""
        every = max(EVERY, int(np.ceil(interval / self.flow.step)))
        return every, interval / every

    def varied(self, index: int, count: int, nudge: Floats, interval: float, rng: Generator) -> Row:
        """Return mean runs of the variation from one start, of Dabby's mapping along it, and of a shuffle."""
        every, step = self.sampling(interval)
        found = itinerary(
            self.flow,
            count,
            start=self.starts[index],
            nudge=nudge * self.spread,
            every=every,
            step=step,
            transient=0,
        )
        kept = runs(found.indices)
        return {
            "flow": self.flow.name,
            "nudge": index,
            "interval": interval,
            "nats_a_point": self.exponent * interval,
            "points_a_turn": self.turn / interval,
            "mean_run": kept.mean(),
            "longest_run": kept.max(),
            "mean_later_run": kept[1:].mean() if len(kept) > 1 else np.nan,
            "dabby_mean_run": runs(dabby(found.sites, found.points)).mean(),
            "shuffle_mean_run": runs(shuffled(count, rng)).mean(),
        }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--nudges", type=int, default=400)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--csv", type=Path)
    parser.add_argument("--plot", type=Path)
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    flows = {name: Known.of(name, options.nudges) for name in ("lorenz", "rossler")}
    for name, known in flows.items():
        print(f"{name}: exponent {known.exponent:.4f} nats, a turn {known.turn:.3f}: {known.exponent * known.turn:.3f}")
    nudges = drawn(options.nudges, rng)
    lengths = {name: len(compose(bundled("corpora") / path, clip)) for name, (path, clip) in PIECES.items()}
    rows = list(measured(flows, lengths, nudges, rng))
    report(rows, lengths, rng)
    curve = list(along(flows, lengths[CURVE_PIECE], nudges[:CURVE_NUDGES], rng))
    report_curve(curve)
    if options.csv:
        with options.csv.open("w", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(["piece", "sampling", "flow", *ALIKE, "variations", "measure", "of", *QUARTILES])
            writer.writerows(summary(rows + curve))
    if options.plot:
        options.plot.write_text(drawing(curve, lengths[CURVE_PIECE]))


def drawn(count: int, rng: Generator) -> Floats:
    """Draw nudges [count, 3], in standard deviations."""
    directions = rng.normal(size=(count, 3))
    sizes = 10.0 ** rng.uniform(-3.0, -1.0, count)
    return sizes[:, None] * directions / np.linalg.norm(directions, axis=1, keepdims=True)


def measured(flows: dict[str, Known], lengths: dict[str, int], nudges: Floats, rng: Generator) -> Iterator[Row]:
    """Return a row for each piece, sampling, flow and nudge."""
    equal_turns = {name: known.turn / POINTS_A_TURN for name, known in flows.items()}
    parting = flows["lorenz"].exponent * equal_turns["lorenz"]
    samplings = {
        "one step": dict.fromkeys(flows, STEP * EVERY),
        "points a turn": equal_turns,
        "parting": {name: parting / known.exponent for name, known in flows.items()},
    }
    for piece, count in lengths.items():
        for sampling, intervals in samplings.items():
            for name, known in flows.items():
                for n, nudge in enumerate(nudges):
                    varied = known.varied(n, count, nudge, intervals[name], rng)
                    yield {"piece": piece, "sampling": sampling, **varied}


def along(flows: dict[str, Known], count: int, nudges: Floats, rng: Generator) -> Iterator[Row]:
    """Return a row for each flow, interval of RANGE and nudge."""
    for known in flows.values():
        for nats in RANGE:
            for n, nudge in enumerate(nudges):
                varied = known.varied(n, count, nudge, nats / known.exponent, rng)
                yield {"piece": CURVE_PIECE, "sampling": "range", **varied}


# --- what it comes to -------------------------------------------------------------------------------------------------


def report(rows: list[Row], lengths: dict[str, int], rng: Generator) -> None:
    def column(piece: str, sampling: str, flow: str, what: str) -> Floats:
        key = (piece, sampling, flow)
        return np.array([r[what] for r in rows if (r["piece"], r["sampling"], r["flow"]) == key], dtype=float)

    tests: list[tuple[str, Floats, Floats]] = []
    samplings = list(dict.fromkeys(r["sampling"] for r in rows))
    for what in ("mean_run", "mean_later_run"):
        for piece in lengths:
            for sampling in samplings:
                pair = [column(piece, sampling, flow, what) for flow in ("rossler", "lorenz")]
                both = np.isfinite(pair).all(axis=0)
                if both.sum() >= FEWEST:
                    tests.append((f"{what:15} {piece:12} {sampling:14} rossler, lorenz", pair[0][both], pair[1][both]))
    for piece in lengths:
        for flow in ("lorenz", "rossler"):
            mine = column(piece, "points a turn", flow, "mean_run")
            for other in ("dabby_mean_run", "shuffle_mean_run"):
                theirs = column(piece, "points a turn", flow, other)
                tests.append((f"{'mean_run':15} {piece:12} {'points a turn':14} {flow}, {other[:-9]}", mine, theirs))
    values = [flipped(np.log(a) - np.log(b), rng) for _, a, b in tests]
    print(f"\npostures: {', '.join(f'{piece} {count}' for piece, count in lengths.items())}")
    print(f"{'':62}{'pairs':>6}{'means':>14}{'ratio (95 %)':>24}{'dominance':>10}{'p, Holm':>9}")
    for (name, a, b), p in zip(tests, holm(values), strict=True):
        ratio, low, high = bootstrapped(np.log(a) - np.log(b), rng)
        ends = f"{ratio:.2f} ({low:.2f} to {high:.2f})"
        dominance = np.mean(np.sign(a - b))
        print(f"{name:62}{len(a):6}{a.mean():7.2f}{b.mean():7.2f}  {ends:>22}{dominance:10.2f}{p:9.4f}")


def flipped(differences: Floats, rng: Generator) -> float:
    """Return the two-sided p of a paired permutation test: how often random signs give as large a mean."""
    signs = rng.choice((-1.0, 1.0), size=(FLIPS, len(differences)))
    met = np.abs(signs @ differences) >= np.abs(differences.sum()) * (1.0 - 1e-12)
    return float((met.sum() + 1) / (FLIPS + 1))


def holm(values: list[float]) -> Floats:
    """Correct p values for multiple tests by the method of Holm, Scand. J. Statistics 6:65 (1979)."""
    order = np.argsort(values)
    factors = len(values) - np.arange(len(values))
    corrected = np.empty(len(values))
    corrected[order] = np.minimum(1.0, np.maximum.accumulate(factors * np.array(values)[order]))
    return corrected


def bootstrapped(differences: Floats, rng: Generator) -> tuple[float, float, float]:
    """Return the ratio of geometric means and its 95 % bootstrap interval, by percentiles."""
    drawn = rng.integers(len(differences), size=(BOOTSTRAPS, len(differences)))
    low, high = np.percentile(differences[drawn].mean(axis=1), [2.5, 97.5])
    return float(np.exp(differences.mean())), float(np.exp(low)), float(np.exp(high))


def report_curve(curve: list[Row]) -> None:
    print("\nnats a point: points a turn and mean run, lorenz; the same, rossler")
    lorenz, rossler = (means(curve, flow, "mean_run") for flow in ("lorenz", "rossler"))
    for (nats, turn, run), (_, other_turn, other) in zip(lorenz, rossler, strict=True):
        print(f"{nats:8.3f}: {turn:8.1f} {run:8.2f}; {other_turn:8.1f} {other:8.2f}")


def means(curve: list[Row], flow: str, what: str) -> list[tuple[float, float, float]]:
    """Return nats a point, points a turn and the geometric mean of `what`, for each interval."""
    out = []
    mine = [r for r in curve if r["flow"] == flow]
    for interval in dict.fromkeys(r["interval"] for r in mine):
        here = [r for r in mine if r["interval"] == interval]
        out.append(
            (here[0]["nats_a_point"], here[0]["points_a_turn"], float(np.exp(np.mean(np.log([r[what] for r in here])))))
        )
    return out


ALIKE = ("nats_a_point", "points_a_turn")
MEASURES = ("mean_run", "longest_run", "mean_later_run", "dabby_mean_run", "shuffle_mean_run")
QUARTILES = ("25 %", "50 %", "75 %")


def summary(rows: list[Row]) -> Iterator[list[object]]:
    """Tabulate quartiles of each measure for each piece, sampling and flow, with the number of variations."""
    groups: dict[tuple[object, ...], list[Row]] = {}
    for one in rows:
        key = (one["piece"], one["sampling"], one["flow"], *(f"{one[what]:.4g}" for what in ALIKE))
        groups.setdefault(key, []).append(one)
    for key, group in groups.items():
        for measure in MEASURES:
            values = np.array([one[measure] for one in group], dtype=float)
            values = values[np.isfinite(values)]
            if len(values):
                quartiles = np.percentile(values, [25.0, 50.0, 75.0])
                yield [*key, len(group), measure, len(values), *(f"{value:.4g}" for value in quartiles)]


COLOURS = {"lorenz": "#c0392b", "rossler": "#2471a3"}
LEFT, WIDTH, TOP, BOTTOM = (50, 500), 370, 30, 310
AXES = (
    ((0.005, 1.0), (0.01, 0.1, 1.0), "nats by which neighbours part from one point to the next"),
    ((0.5, 200.0), (1.0, 10.0, 100.0), "points a turn"),
)


def drawing(curve: list[Row], count: int) -> str:
    """Plot mean runs over the divergence between points, and over points a turn, as SVG with logarithmic axes."""

    def at(panel: int, value: float, run: float) -> tuple[float, float]:
        low, high = AXES[panel][0]
        x = LEFT[panel] + WIDTH * np.log(value / low) / np.log(high / low)
        return round(float(x), 1), round(float(BOTTOM - (BOTTOM - TOP) * np.log(run) / np.log(count)), 1)

    parts = [
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 900 360" font-family="sans-serif" font-size="12">',
        '<rect width="900" height="360" fill="#fff"/>',
        '<text x="50" y="16">mean run, postures</text>',
        '<text x="500" y="16">dotted: Dabby\'s mapping along the same trajectories</text>',
    ]
    for panel, ((low, high), ticks, title) in enumerate(AXES):
        left = LEFT[panel]
        for value in ticks:
            x, _ = at(panel, value, 1.0)
            parts.append(f'<path d="M{x} {TOP}V{BOTTOM}" stroke="#ddd"/>')
            parts.append(f'<text x="{x}" y="{BOTTOM + 16}" text-anchor="middle">{value:g}</text>')
        for run in (1, 2, 5, 10, 20, 50, 100):
            _, y = at(panel, low, run)
            parts.append(f'<path d="M{left} {y}H{left + WIDTH}" stroke="#ddd"/>')
            parts.append(f'<text x="{left - 6}" y="{y + 4}" text-anchor="end">{run}</text>')
        parts.append(f'<text x="{left + WIDTH / 2}" y="{BOTTOM + 36}" text-anchor="middle">{title}</text>')
        for flow, colour in COLOURS.items():
            for what, dashes in (("mean_run", ""), ("dabby_mean_run", ' stroke-dasharray="2 4"')):
                shown = [(known[panel], known[2]) for known in means(curve, flow, what)]
                line = " ".join("{},{}".format(*at(panel, *pair)) for pair in shown if low <= pair[0] <= high)
                parts.append(f'<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="2"{dashes}/>')
    for n, (flow, colour) in enumerate(COLOURS.items()):
        parts.append(f'<text x="{250 + 70 * n}" y="16" fill="{colour}" font-weight="bold">{flow}</text>')
    return "\n".join([*parts, "</svg>\n"])


if __name__ == "__main__":
    main()
