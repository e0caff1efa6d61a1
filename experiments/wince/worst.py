"""The movements of random far pairs that are most beyond the dancers, drawn, to be looked at.

    python experiments/wince/worst.py FOLDER [--by ballet] [--pairs 120] [--most 10] [--seed 1]

Each is a contact sheet of sixteen postures, the worst first; beside its file stands what is beyond, in multiples of the
limit. Sheets of recorded movement are not to be published where the recording is not.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from experiments.harness import HERE
from experiments.material import FPS, engine
from experiments.wince.dancers import dancers, see
from experiments.wince.run import BUDGET
from motionmind import Motion, NoPathError, draw_sheet
from motionmind.render.sheet import evenly, png

SHOWN = 16  # postures of a movement


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="where the sheets go")
    parser.add_argument("--by", default="ballet", help="the corpus")
    parser.add_argument("--pairs", type=int, default=120, help="how many are tried")
    parser.add_argument("--most", type=int, default=10, help="how many are drawn")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--data", default=str(HERE.parent.parent / "shared" / "data"), help="recorded movement")
    asked = parser.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    found, danced = engine(asked.data, asked.by), dancers(asked.data, asked.by)
    tried: list[tuple[float, str, Motion]] = []
    for number, (i, k) in enumerate(danced.far_pairs(asked.pairs, asked.seed)):
        a, b = danced.ends[i], danced.ends[k]
        try:
            motion = found.tween(a, b, node_budget=BUDGET, fps=float(FPS)).motion
        except NoPathError:
            continue
        worst = danced.worst(see(motion))
        beyond = ", ".join(f"{name} {times:.2f}" for name, times in worst.items() if times > 1.0)
        tried.append((max(worst.values()), f"pair {number}, {motion.times[-1]:.2f} s: {beyond or 'nothing'}", motion))
    tried.sort(key=lambda one: -one[0])
    for rank, (_, told, motion) in enumerate(tried[: asked.most], start=1):
        path = asked.folder / f"{asked.by}-{rank:02d}.png"
        path.write_bytes(png(draw_sheet(motion, evenly(range(len(motion)), SHOWN), columns=SHOWN // 2)))
        print(f"{path}: {told}")


if __name__ == "__main__":
    main()
