"""What movement the engine makes, in one table a dancer: feet, balance, limits, closeness to held-out windows, time.

    python -m experiments.synthesis.measure [--dancers ballet,cmu-05] [--pairs 60] [--windows 12] [--out FILE.json]
    python -m experiments.synthesis.measure --pictures FOLDER [--seeds 1,2] [--numbers 0,63] [--beside FOLDER]
    python -m experiments.synthesis.tables OLD.json NEW.json

It uses nothing of how a path becomes movement, so checkouts that do that in different ways can be compared: the first
command, run in each of them with OMP_NUM_THREADS=1, measures the same pairs and windows, and the last shows the files
side by side.

Pairs are those of `experiments.wince`: `--pairs` far ones, a third as many on one leg, and a third as many jumps.
Unless the list below says otherwise, figures are of far pairs, and a share is of pairs.

    feet's speed      mean level speed of ends of feet less than 5 cm above the floor, over the dancers'
    skating           mean share of frames in which a foot skates (`motionmind.body.contact.skating`), over the dancers'
    bounce            99th percentile of the mass's vertical acceleration, up or down, in all frames, over the dancers';
                      gravity where bodies fall freely in more frames than one in 100
    bounce on the floor  the same of frames in which, and before and after which, the body is not in the air
    beyond            share beyond the dancers in any of five measures, each the greatest in a movement: beyond what
                      one in 200 of the dancers' own windows of that length exceeds; then the share for each measure
    legs over 3 cm    share in which legs are more than 3 cm in each other
    leans             share in which one limb bears, the mass is hardly accelerated, and is farther outside of the
                      support than the dancers' in one of 100 such frames; "at rest" where it is accelerated even less
    standing feet rise  share of one-leg pairs that stand on one foot throughout and lift it by more than 2 cm
    falls in the air  share of frames in the air in which the mass falls freely, in far pairs and jumps
    proven optimal    share of paths that are proven optimal
    followed          share of joint-moves within tolerance of the path; A and B do not count
    attested          mean share of the motion's own transitions that the corpus attests (`Tween.motion_attested`)
    attested moves    the same share of the transitions that change a joint's state
    eased: ...        the same for eased SLERP from A to B, at the same times
    ms                median processor time of making the motion of one path, all kinds of pairs, milliseconds
    seconds           mean length of the movement

Windows are those of `experiments.likeness`, `--windows` in all of each family of takes, in lengths of 0.6 to 4 s, and
half as many again with moving ends; no take of the family is learned from. `--families` limits how many are filled.

    L2Q               mean L2Q, for two postures and for moving ends
    NPSS              mean NPSS, weighted by the power of the windows, for the same
    windows: feet, bounce  speed of low feet, and standard deviation of the root's height, over the truth's
    windows: followed as above, a mean over windows

With `--auc N` classifiers also try to tell pieces of movement from the dancer's own (AUC, 0.5 where they cannot), in N
windows of each family and length, as `experiments.likeness` does; with N = 2 it takes a minute for `indian`.

Pictures are filmstrips of 12 frames at one scale, seen from the front and the side. `--seeds` draws the first far pair,
one-leg pair and jump of each seed; `--numbers` draws measured pairs by their numbers. `--beside` puts the picture of
the same name from another folder above each.
"""

from __future__ import annotations

import argparse
import functools
import json
import os
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from PIL import Image

import motionmind
from experiments.harness import HERE, Row
from experiments.inbetween.run import GAPS
from experiments.likeness.features import LOW_M, feet_of
from experiments.likeness.filled import engine as way_of
from experiments.likeness.labels import code_of
from experiments.likeness.making import Maker
from experiments.likeness.measure import Truth, areas_of, measured
from experiments.likeness.windows import cases_of, spread, window_of
from experiments.material import FPS, RECORDED, engine, families, recorded
from experiments.synthesis.tables import report
from experiments.wince.dancers import Dancers, Seen, dancers, see
from experiments.wince.followed import near
from experiments.wince.run import BUDGET, eased, own_of, pairs_of, row_of
from motionmind import Engine, Motion, NoPathError, Posture, Tween, draw_sheet
from motionmind._typing import Floats
from motionmind.metrics.paths import attested_share
from motionmind.render.sheet import evenly, png

QUICK = "ballet,cmu-05"
BUNDLED = ("ballet", "karate", "macarena")
SEED = 1
SHOWN = 12  # postures of a filmstrip
MAKES = ("_realise", "_synthesise")  # the method of the engine that makes the motion of a path, by its names
KEPT = ("l2q", "slerp", "npss", "power", "followed", "low", "low danced", "slid", "slid danced", "bounce")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dancers", default=QUICK, help=f"of {', '.join((*BUNDLED, *RECORDED))}, with commas, or all")
    parser.add_argument("--pairs", type=int, default=60)
    parser.add_argument("--windows", type=int, default=12, help="of each family of takes; 0 for none")
    parser.add_argument("--families", type=int, default=8, help="at most, of each dancer")
    parser.add_argument("--auc", type=int, default=0, metavar="N", help="windows of each family and length; slow")
    parser.add_argument("--out", type=Path, help="file of all rows, for experiments.synthesis.tables")
    parser.add_argument("--pictures", type=Path, metavar="FOLDER", help="draw pairs instead of measuring them")
    parser.add_argument("--seeds", type=_numbers, default=[], help="whose first pair of each kind is drawn")
    parser.add_argument("--numbers", type=_numbers, default=[], help="numbers of measured pairs to be drawn")
    parser.add_argument("--beside", type=Path, metavar="FOLDER", help="whose pictures go above those that are drawn")
    parser.add_argument("--data", default=str(HERE.parent.parent / "shared" / "data"), help="recorded movement")
    asked = parser.parse_args()
    warnings.simplefilter("ignore", motionmind.MotionMindWarning)  # lengths of windows are the dancer's: some are fast
    known = (*BUNDLED, *recorded(asked.data, *RECORDED))
    names = list(known) if asked.dancers == "all" else asked.dancers.split(",")
    if strange := [name for name in names if name not in known]:
        parser.error(f"no dancer {', '.join(strange)}; there are {', '.join(known)}")
    if asked.pictures:
        for name in names:
            draw(asked.data, name, asked.pairs, asked.seeds, asked.numbers, asked.pictures, asked.beside)
        return
    if os.environ.get("OMP_NUM_THREADS") != "1":
        print("times compare only with OMP_NUM_THREADS=1: else idle threads count", file=sys.stderr)
    found: dict[str, Any] = {}
    for name in names:
        began = process_time()
        found[name] = {"code": code_of(Path(motionmind.__file__).parent)} | pairs(asked.data, name, asked.pairs)
        found[name]["windows"] = windows(asked.data, name, asked.windows, asked.families) if asked.windows else []
        found[name]["auc"] = areas(asked.data, name, asked.auc) if asked.auc else {}
        print(f"{name}: {process_time() - began:.0f} s of processor time", flush=True)
        if asked.out:
            asked.out.write_text(json.dumps(found))
    print(report({"found": found}))


def _numbers(text: str) -> list[int]:
    return [int(number) for number in text.split(",")]


# --- pairs ------------------------------------------------------------------------------------------------------------


@contextmanager
def motion_times() -> Iterator[list[float]]:
    """Yield a list that receives the processor time of each motion that any engine makes of a path, seconds."""
    name = next(name for name in MAKES if hasattr(Engine, name))
    make, spent = getattr(Engine, name), list[float]()

    @functools.wraps(make)
    def timed(*args: Any, **options: Any) -> Any:
        began = process_time()
        made = make(*args, **options)
        spent.append(process_time() - began)
        return made

    setattr(Engine, name, timed)
    try:
        yield spent
    finally:
        setattr(Engine, name, make)


def join(found: Engine, a: Posture, b: Posture) -> Tween | None:
    """Return the tween of a pair; None where there is no path."""
    try:
        return found.tween(a, b, node_budget=BUDGET, fps=float(FPS))
    except NoPathError:
        return None


def chosen(danced: Dancers, count: int, seed: int) -> list[tuple[str, Posture, Posture]]:
    return pairs_of(danced, seed, count, count // 3, count // 3)


def pairs(data: str, name: str, count: int) -> Row:
    """Return a row for each pair of a dancer that is joined, and what holds for the dancers themselves."""
    found, danced = engine(data, name), dancers(data, name)
    rows = []
    for number, (kind, a, b) in enumerate(chosen(danced, count, SEED)):
        with motion_times() as spent:
            tween = join(found, a, b)
        if tween is None:
            continue
        motion, seen = tween.motion, see(tween.motion)
        row = row_of(name, kind, number, "motionmind", a, b, 0.0, motion, seen, danced)
        row["low"], row["slid"] = low_feet(motion)
        row["joint-moves"], row["followed"], _ = near(tween, found.space.tolerances)
        row["proven"] = tween.status == "optimal"
        for maker, made in (("", motion), ("eased ", eased(a, b, len(motion)))):
            attested = transitions_of(found, made, motion.insertions[0].times)
            row |= {f"{maker}{key}": value for key, value in attested.items()}
        row["ms"], row["bounce"], row["grounded"] = 1000.0 * spent[0], seen.bounce, grounded(seen)
        rows.append({key: _plain(value) for key, value in row.items()})
    low, slid = np.sum([low_feet(clip) for clip in danced.clips], axis=0)
    floor = np.percentile(np.concatenate([grounded(one) for one in danced.seen]), 99.0)
    own = own_of(danced) | {"own_feet": slid / low, "own_bounce": danced.bounce, "own_grounded": floor}
    return {"pairs": rows} | {key: _plain(value) for key, value in own.items()}


def transitions_of(found: Engine, motion: Motion, times: Floats) -> Row:
    """Count a motion's joint transitions from each time (seconds) to the next, and how many the corpus attests.

    Moves are transitions to another state.
    """
    path = found.space.assign(found.corpus.to_chains(motion.at(times).rotations))
    joints = len(motion.skeleton)
    moved = (path[1:] != path[:-1])[:, :joints]
    seen = found.grammar.transitions.edges(path)[:, :joints] >= 0
    return {
        "attested": attested_share(path, found.grammar),
        "moves": int(moved.sum()),
        "attested moves": int((moved & seen).sum()),
    }


def low_feet(motion: Motion) -> tuple[float, float]:
    """Return the number of low ends of feet in all frames, and the sum of their level speeds, m/s."""
    heights, speeds = feet_of(motion.skeleton, motion.rotations[None], motion.root[None], np.zeros(1))
    low = heights < LOW_M
    return float(low.sum()), float((speeds * low).sum())


def grounded(seen: Seen) -> Floats:
    """Return the bounce in frames on the floor whose neighbours are on it, too, m/s^2."""
    floor = ~seen.airborne
    return seen.bounce[(floor[:-2] & floor[1:-1] & floor[2:])[: len(seen.bounce)]]


def _plain(value: Any) -> Any:
    """Return what JSON can hold; accelerations to a millimetre a second squared."""
    if isinstance(value, np.ndarray):
        return value.round(3).tolist()
    return value.item() if isinstance(value, np.generic) else value


# --- held-out windows -------------------------------------------------------------------------------------------------


def maker_of(data: str, name: str, together: Sequence[Sequence[str]], count: int) -> Maker:
    cases = cases_of(data, name, together, GAPS, count)
    return Maker(data, name, together, Truth.of(cases, [window_of(data, name, case) for case in cases]))


def windows(data: str, name: str, count: int, most: int) -> list[Row]:
    """Return a row for each held-out window of a dancer that is filled."""
    long = [takes for takes in families(data, name) if cases_of(data, name, [takes], GAPS[:1], 1)]
    maker = maker_of(data, name, spread(long, most), max(count // len(GAPS), 1))
    filled = maker.fill({"motionmind": way_of({})})["motionmind"]
    values = measured(maker.truth, filled)
    return [
        {"window": k, "given": case.given, "take": case.take, "seconds": case.seconds}
        | {key: float(values[key][k]) for key in (*KEPT, "bounce danced")}
        for k, case in enumerate(maker.truth.cases)
        if filled.found[k]
    ]


def areas(data: str, name: str, count: int) -> Row:
    """Return how well classifiers tell what is made of a dancer's windows from the truth, by what is given."""
    maker, way = maker_of(data, name, families(data, name), count), {"motionmind": way_of({})}
    return areas_of(maker.truth, maker.fill(way)["motionmind"], maker.practise(way)["motionmind"])


# --- pictures ---------------------------------------------------------------------------------------------------------


def draw(
    data: str, name: str, count: int, seeds: list[int], numbers: list[int], folder: Path, beside: Path | None
) -> None:
    """Draw pairs of a dancer as filmstrips, and print what in them is beyond the dancers."""
    found, danced = engine(data, name), dancers(data, name)
    folder.mkdir(parents=True, exist_ok=True)
    for title, a, b in _to_draw(danced, count, seeds, numbers):
        tween = join(found, a, b)
        if tween is None:
            print(f"{name}-{title}: no path")
            continue
        motion, path = tween.motion, folder / f"{name}-{title}.png"
        picture = draw_sheet(motion, evenly(range(len(motion)), SHOWN), columns=SHOWN)
        if beside and (beside / path.name).exists():
            picture = _stacked(Image.open(beside / path.name).convert("RGB"), picture)
        path.write_bytes(png(picture))
        worst = danced.worst(see(motion))
        beyond = ", ".join(f"{measure} {times:.2f}" for measure, times in worst.items() if times > 1.0)
        print(f"{path}: {motion.times[-1]:.2f} s, beyond: {beyond or 'nothing'}", flush=True)


def _to_draw(
    danced: Dancers, count: int, seeds: list[int], numbers: list[int]
) -> Iterator[tuple[str, Posture, Posture]]:
    for seed in seeds:
        for kind, a, b in pairs_of(danced, seed, 1, 1, 1):
            yield f"{kind.replace(' ', '-')}-seed-{seed}", a, b
    measured_pairs = chosen(danced, count, SEED) if numbers else []
    for number in numbers:
        kind, a, b = measured_pairs[number]
        yield f"{kind.replace(' ', '-')}-{number}", a, b


def _stacked(above: Image.Image, below: Image.Image) -> Image.Image:
    out = Image.new("RGB", (max(above.width, below.width), above.height + below.height), "white")
    out.paste(above, (0, 0))
    out.paste(below, (0, above.height))
    return out


if __name__ == "__main__":
    main()
