"""Reads, retargets and learns a hundred hours, or as many times what one dancer recorded as is said; then joins pairs.

python experiments/scale/hours.py PATH/TO/shared/data [--times 2270] [--workers 2] [--folder FOLDER] [--pairs 60]

The movement is made from recordings (see `experiments.scale.run`), each performance by the worker that reads it, and
none is kept. FOLDER takes large arrays, and the corpus, until the run ends; what it must hold is said first. Tweens of
random pairs are timed as `tweens.py` does.
"""

import argparse
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from experiments.scale import tweens
from experiments.scale.run import NAME, measure, tell
from motionmind import read_motion

BYTES = 11_500  # a posture: arrays that are being learned from, and the corpus
RATE = 5.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path, help=f"folder of recorded movement, with {NAME}")
    parser.add_argument("--times", type=int, default=2270, help="as much as was recorded")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--folder", type=Path, default=Path(tempfile.gettempdir()))
    parser.add_argument("--pairs", type=int, default=60)
    options = parser.parse_args()
    seconds = sum(read_motion(path).times[-1] for path in (options.data / NAME).glob("*.bvh"))
    needed = BYTES * RATE * seconds * options.times
    free = shutil.disk_usage(options.folder).free
    print(
        f"{seconds * options.times / 3600.0:.1f} hours; about {needed / 1e9:.1f} GB of disk, {free / 1e9:.1f} are free"
    )
    if needed > free:
        parser.error(f"{options.folder}: too little space; name another --folder, or fewer --times")
    with tempfile.TemporaryDirectory(dir=options.folder) as home:
        kept = Path(home) / "corpora" / tweens.name_of(options.times)
        print(tell([measure(str(options.data), options.times, options.workers, str(options.folder), kept)]), flush=True)
        asked = ["--times", str(options.times), "--pairs", str(options.pairs), "--keep", home]
        words = [sys.executable, tweens.__file__, str(options.data / NAME), *asked]
        subprocess.run(words, check=True)


if __name__ == "__main__":
    main()
