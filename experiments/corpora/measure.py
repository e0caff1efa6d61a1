"""How the bundled corpora hang together, how long they take to make, and how far their joints go beside real dancers'.

python experiments/corpora/measure.py [FOLDER OF CMU'S SUBJECT 05, BVH] [FOLDER OF SUBJECT 135, ASF AND AMC]
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path
from time import perf_counter

import numpy as np

from motionmind import Engine, Motion, Posture, own_skeleton, read_motion
from motionmind.body.anatomy import Anatomy
from motionmind.body.anatomy_file import anatomy_named
from motionmind.corpus import store
from motionmind.geometry import rotations as rot

PAIRS = 200
ANGLES = ("hip flexion", "hip abduction", "hip rotation", "knee flexion", "lumbar flexion", "thorax flexion")
ANGLES += ("shoulder flexion", "shoulder abduction", "elbow flexion")


def main(recordings: list[str]) -> None:
    names = [
        name
        for name, folder in store.list_corpora("nowhere").items()
        if store.read_manifest(folder)["format"] == store.FORMAT
    ]
    with tempfile.TemporaryDirectory() as cache:
        os.environ["XDG_CACHE_HOME"] = cache
        Engine.load(names[0])  # pgmpy is imported
        first = {name: seconds(name) for name in names[1:]} | {names[0]: seconds(names[0], Path(cache))}
        again = {name: min(seconds(name) for _ in range(5)) for name in names}
        print(f"made from source: {sum(first.values()):.1f} s in all")
        print(f"loaded: {1e3 * max(again.values()):.0f} ms at most\n")
        print(
            "| corpus | clips | postures | joinable | out-degree | new postures | attested | s a move | made | loaded |"
        )
        print("|---|---|---|---|---|---|---|---|---|---|")
        for name in names:
            print(row(name, first[name], again[name]))
    print(f"\n| degrees, 1st and 99th percentile | {' | '.join(ANGLES)} |\n|---|{'---|' * len(ANGLES)}")
    anatomy = anatomy_named("human23")
    for name in names:
        corpus = Engine.load(name).corpus
        if corpus.skeleton.names == anatomy.skeleton.names:
            print(f"| {name} | {reach(anatomy, np.asarray(corpus.rotations))} |")
    for folder in recordings:
        files = sorted(path for path in Path(folder).iterdir() if path.suffix in (".bvh", ".amc"))
        print(f"| {Path(folder).name} | {reach(anatomy, np.concatenate([recorded(file) for file in files]))} |")


def seconds(name: str, cache: Path | None = None) -> float:
    """Seconds that it takes to load a corpus; from its source where `cache` is emptied of it."""
    if cache is not None:
        for built in cache.glob(f"**/{name}-*"):
            built.rename(built.with_name(f"old-{built.name}"))
    began = perf_counter()
    Engine.load(name)
    return perf_counter() - began


def row(name: str, made: float, loaded: float) -> str:
    engine = Engine.load(name)
    found = engine.check(2000)
    rng, seen = np.random.default_rng(0), {states.tobytes() for states in np.asarray(engine.states)}
    new, between, attested = 0, 0, []
    for a, b in rng.integers(len(engine.corpus), size=(PAIRS, 2)):
        tween = engine.tween(posture(engine, a), posture(engine, b))
        inner = np.asarray(tween.path[1:-1], dtype=engine.states.dtype)
        new, between = new + sum(states.tobytes() not in seen for states in inner), between + len(inner)
        attested.append(tween.attested)
    degree = np.median(list(found["out_degree"].values()))
    return (
        f"| {name} | {len(found['clips'])} | {found['postures']} | {found['joinable']:.1%} | {degree:.2f} | "
        f"{new / max(between, 1):.0%} | {np.mean(attested):.2%} | {np.median(engine.corpus.seconds):.2f} | "
        f"{made:.2f} s | {1e3 * loaded:.0f} ms |"
    )


def posture(engine: Engine, index: int) -> Posture:
    return Posture(engine.corpus.skeleton, engine.corpus.rotations[index], engine.corpus.root[index])


def recorded(file: Path) -> np.ndarray:
    motion: Motion = own_skeleton(read_motion(file))
    return motion.slice(1, len(motion)).resample(5.0).rotations


def reach(anatomy: Anatomy, rotations: np.ndarray) -> str:
    turned = rotations.copy()
    turned[:, 0] = rot.inv_mul(rot.about_vertical(rot.heading(turned[:, 0])), turned[:, 0])
    degrees, cells = anatomy.degrees(turned), []
    for joint, word in (name.split() for name in ANGLES):
        angle = anatomy.joints[joint].angles[word]
        found = [i for i, name in enumerate(anatomy.skeleton.names) if anatomy.anatomy(name)[0] == joint]
        low, high = np.percentile(angle.sign * degrees[:, found, angle.axis], [1.0, 99.0])
        cells.append(f"{low:.0f} to {high:.0f}")
    return " | ".join(cells)


if __name__ == "__main__":
    main(sys.argv[1:])
