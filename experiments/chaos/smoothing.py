"""Count the abrupt transitions of chaotic variations, and those that the engine smooths.

python experiments/chaos/smoothing.py --csv experiments/chaos/smoothing.csv
"""

from __future__ import annotations

import argparse
import csv
from dataclasses import replace
from itertools import product
from pathlib import Path
from time import perf_counter

import numpy as np

from motionmind import Engine, Piece, Variation, own_skeleton, read_motion, vary
from motionmind.chaos import find_flow
from motionmind.variation.seams import judge_transitions

PIECES = (("ballet", "jump"), ("macarena", "macarena"), ("karate", "heian-shodan"), ("medley", "medley"))
FLOWS = ("lorenz", "rossler")
NUDGES = (0.1, 0.3, 1.0)  # a variation each
RULES = {"whole_body": {"whole_body": True}, "strict": {"strict": True}, "bridged": {}}
SHUFFLES = 10  # of each variation, by seeds from 0 on
RATE = 5.0  # postures a second of recordings
LEAST = 200  # postures of a variation, or as many as the piece has if it has more


def piece_of(engine: Engine, clip: str) -> Piece:
    """Return a clip of a corpus as a piece, with the corpus's facing."""
    found = next(one for one in engine.corpus.clips if one.name == clip)
    return Piece.of(engine.corpus.motion(found), facing=engine.corpus.facing)


def measure(variations: list[Variation]) -> dict[str, object]:
    """Count abrupt transitions per 100 moves before and after smoothing, the share solved, and the insertions."""
    seams = [seam for variation in variations for seam in variation.seams]
    abrupt = [seam.transition for seam in seams if seam.transition and seam.transition.is_abrupt]
    found = [seam.insertion for seam in seams if seam.insertion]
    moves = sum(len(variation.postures) - 1 for variation in variations)
    after = moves + sum(one.moves - 1 for one in found)
    lengths = np.array([one.moves for one in found] or [0])
    return {
        "moves": moves,
        "seams": len(seams),
        "abrupt": len(abrupt),
        "of_seams": round(len(abrupt) / max(1, len(seams)), 3),
        "per_100": round(100 * len(abrupt) / moves, 1),
        "solved": len(found),
        "share": round(len(found) / max(1, len(abrupt)), 3),
        "after_per_100": round(100 * (len(abrupt) - len(found)) / after, 1),
        "least": int(lengths.min()),
        "median": float(np.median(lengths)),
        "most": int(lengths.max()),
        "bridged": sum(bool(one.bridges) for one in found),
        "bridges": sum(len(one.bridges) for one in found),
        "joint_moves": sum(one.moves * one.path.shape[1] for one in found),
        "proven": sum(one.status == "optimal" for one in found),
    }


def shuffled(variations: list[Variation], engine: Engine) -> float | None:
    """Return the abrupt share of the seams of shuffles, in chunks as long as each variation's own runs.

    None if the variations do not leave the piece's order within as many postures as it has.
    """
    found = []
    for variation, seed in product(variations, range(SHUFFLES)):
        flow, nudge = find_flow(variation.course.flow), variation.course.nudge
        control = vary(variation.piece, by="chunks", seed=seed, flow=flow, nudge=nudge)
        pairs = [(seam.start, seam.end) for seam in control.seams]
        found += [one.is_abrupt for one in judge_transitions(variation.piece, pairs, engine, whole_body=False)]
    return round(float(np.mean(found)), 3) if found else None


def recorded(folder: Path) -> tuple[Engine, list[Piece]]:
    """Learn from a folder of recordings, and return the engine and each recording as a piece."""
    clips = [replace(own_skeleton(read_motion(path)), name=path.stem) for path in sorted(folder.glob("*.bvh"))]
    clips = [clip.slice(1, len(clip)) for clip in clips]  # without the added T-pose
    return Engine.fit(clips, name=folder.name, rate=RATE), [Piece.of(clip, RATE) for clip in clips]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--csv", type=Path, required=True, help="where the figures go")
    parser.add_argument("--recorded", type=Path, help="a folder of BVH files, smoothed by what was learned from them")
    arguments = parser.parse_args()
    engines = {name: Engine.load(name) for name, _ in PIECES}
    questions = [
        (clip, [piece_of(engines[corpus], clip)], engines[by], NUDGES)
        for corpus, clip in PIECES
        for by in dict.fromkeys((corpus, "ballet"))
    ]
    if arguments.recorded:
        engine, pieces = recorded(arguments.recorded)
        questions.append((f"{len(pieces)} recordings", pieces, engine, NUDGES[:1]))
    rows = []
    for name, pieces, engine, nudges in questions:
        for flow, (rule, options) in product(FLOWS, RULES.items()):
            began = perf_counter()
            variations = [
                vary(
                    piece,
                    engine,
                    flow=find_flow(flow),
                    nudge=nudge,
                    length=max(LEAST, len(piece)),
                    alternatives=1,
                    **options,
                )
                for piece in pieces
                for nudge in nudges
            ]
            row = {"piece": name, "flow": flow, "by": engine.corpus.name, "rule": rule, **measure(variations)}
            if rule == "strict":
                row["shuffled"] = shuffled(variations, engine)
            rows.append(row | {"seconds": round(perf_counter() - began, 1)})
            print(rows[-1], flush=True)
    with arguments.csv.open("w", newline="") as file:
        names = list(dict.fromkeys(name for row in rows for name in row))
        table = csv.DictWriter(file, names, lineterminator="\n")
        table.writeheader()
        table.writerows(rows)


if __name__ == "__main__":
    main()
