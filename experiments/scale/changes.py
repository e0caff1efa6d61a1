"""Adds one recording to a corpus and removes it again, and learns the corpus afresh in the same states.

python experiments/scale/changes.py PATH/TO/shared/data --times 1 100 --keep FOLDER [--rounds 2]

Corpora are those of `tweens.py`, kept and found in FOLDER; the recording is another performance of a clip of theirs.
A command is a process of its own, imports included. In the end the files of the corpus must be those of the one that is
learned afresh.
"""

import argparse
import os
import re
import subprocess
import sys
import tempfile
import threading
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from time import sleep

sys.path.insert(0, str(Path(__file__).parents[2]))

from experiments.scale import tweens
from experiments.scale.run import NAME, Job, _recorded, performance
from motionmind.executors.workshop import Workshop
from motionmind.formats.bvh import write_bvh
from motionmind.learned import persistence
from motionmind.learned.learning import learn_in

ADDED = "added"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path, help=f"folder of recorded movement, with {NAME}")
    parser.add_argument("--times", type=int, nargs="+", default=[1, 100])
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--keep", type=Path, required=True, help="where corpora are kept, and found again")
    parser.add_argument("--afresh", help="learn this corpus afresh, and compare files")
    options = parser.parse_args()
    if options.afresh:
        learn_afresh(options.afresh, options.keep)
        return
    recording = options.keep / f"{ADDED}.bvh"
    write_bvh(recording, performance(_recorded(str(options.data))[5], Job(str(options.data), 5, 5001)))
    print("times | command | processor s | own memory, MB", flush=True)
    for times in options.times:
        name = tweens.name_of(times)
        words = ["--times", str(times), "--keep", str(options.keep)]
        if not (options.keep / "corpora" / name).exists():
            subprocess.run(
                [sys.executable, tweens.__file__, str(options.data / NAME), *words, "--part", "build"], check=True
            )
        change = [sys.executable, "-m", "motionmind", "corpus"]
        where = ["--home", str(options.keep)]
        measured([*change, "info", name, *where])  # learns it if other code learned it before
        for number in range(options.rounds):
            for command in (["add", name, str(recording)], ["remove", name, ADDED]):
                print(f"{times} | {command[0]} | {measured([*change, *command, *where])}", flush=True)
            if number + 1 == options.rounds:
                afresh = [sys.executable, __file__, str(options.data), "--keep", str(options.keep), "--afresh", name]
                print(f"{times} | afresh | {measured(afresh)}", flush=True)


def measured(command: Sequence[str]) -> str:
    """Run a command; return the processor time that it took, seconds, and its own memory at most, MB."""
    before, most = os.times(), [0.0]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:

        def watch() -> None:
            while process.poll() is None:
                with suppress(OSError):
                    found = re.search(r"RssAnon:\s+(\d+)", Path(f"/proc/{process.pid}/status").read_text())
                    most[0] = max(most[0], float(found[1]) / 1024.0 if found else 0.0)
                sleep(0.02)

        watcher = threading.Thread(target=watch)
        watcher.start()
        watcher.join()
    if process.returncode:
        raise SystemExit(f"{' '.join(command)} ended with {process.returncode}")
    after = os.times()
    used = after.children_user + after.children_system - before.children_user - before.children_system
    return f"{used:.2f} | {most[0]:.0f}"


def learn_afresh(name: str, home: Path) -> None:
    """Learn a corpus afresh in its own states, and compare the arrays."""
    learned = persistence.load(name, home)
    with tempfile.TemporaryDirectory(dir=home) as room:
        afresh = learn_in(learned.corpus, learned.space, Workshop(folder=Path(room)))
        one, other = (persistence.learned_arrays(of) | {"states": of.states} for of in (learned, afresh))
        for key, array in one.items():
            if array.tobytes() != other[key].tobytes():
                raise SystemExit(f"{name}: {key} is not that of a corpus that is learned afresh")


if __name__ == "__main__":
    main()
