"""A Turing test in a box: a folder with films, and a page on which people say what they think of them.

python experiments/turing/box.py FOLDER [--data ../shared/data] [--films 20] [--seed 0]

Half of the films show what was danced, half what the engine made between two postures that were danced 2 s apart, of
sequences that it had not seen; no window is shown twice. All are drawn alike, and their names say nothing. The page
needs no server and asks nothing of any: it shows the films in an order drawn for each rater, keeps the answers in the
browser, and saves them as a file for `analyse.py`. Which film is which is in key.json: do not hand that out.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import replace
from html import escape
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from experiments.material import FPS, movement, recorded, without
from motionmind import Motion, draw_picture

SECONDS = 2.0
FRAMES = round(SECONDS * FPS)
KINDS = ("danced", "made")
# The wording is ours; [O10] asked for three judgements from 1 to 5 of 20 clips as well.
SCALES = {
    "natural": ("How natural is the movement?", "not at all", "entirely"),
    "style": ("How well does it keep to one style?", "not at all", "entirely"),
    "person": ("Who made it?", "surely a computer", "surely a person"),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--data", type=Path, default=Path(__file__).parents[3] / "shared" / "data")
    parser.add_argument("--films", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    data = str(options.data) if options.data.is_dir() else None
    name = next(iter(recorded(data, "cmu-05")), "ballet")
    fill(options.folder, data, name, options.films, options.seed)
    print(f"{options.folder / 'index.html'}: {options.films} films of {name}")


def fill(folder: Path, data: str | None, name: str, films: int, seed: int) -> None:
    """Make the films, the page and the key."""
    rng = np.random.default_rng(seed)
    pieces = movement(data, name, FRAMES)
    windows = [
        (sequence, number, start)
        for sequence, found in pieces.items()
        for number, piece in enumerate(found)
        for start in range(0, len(piece) - FRAMES, FRAMES)
    ]
    folder.mkdir(parents=True, exist_ok=True)
    key, kinds = {}, [KINDS[i % 2] for i in range(films)]
    names = [f"{number:08x}" for number in rng.choice(1 << 32, size=films, replace=False)]
    chosen = rng.choice(len(windows), size=films, replace=False)
    for film, kind, at in zip(names, kinds, chosen, strict=True):
        sequence, number, start = windows[at]
        real = pieces[sequence][number].slice(start, start + FRAMES + 1)
        motion = real
        if kind == "made":
            engine = without(data, name, sequence)
            motion = engine.tween(real.posture(0), real.posture(-1), duration=SECONDS, fps=FPS).motion
        draw_picture(folder / f"{film}.gif", plain(motion))
        key[film] = {"kind": kind, "corpus": name, "sequence": sequence, "seconds": float(real.times[0])}
    (folder / "key.json").write_text(json.dumps(key, indent=1, sort_keys=True) + "\n")
    (folder / "index.html").write_text(page(sorted(names)))


def plain(motion: Motion) -> Motion:
    """Return the movement without any mark of its origin."""
    return replace(motion, times=motion.times - motion.times[0], name="", insertions=())


def page(films: list[str]) -> str:
    """Return the page that shows films and takes answers."""
    scales = "".join(
        f"<fieldset><legend>{escape(question)}</legend><span>{escape(low)}</span>"
        + "".join(f'<label><input type="radio" name="{scale}" value="{n}">{n}</label>' for n in range(1, 6))
        + f"<span>{escape(high)}</span></fieldset>"
        for scale, (question, low, high) in SCALES.items()
    )
    template = (Path(__file__).parent / "page.html").read_text()
    return template.replace("<!--scales-->", scales).replace(
        "/*given*/", f"const films = {json.dumps(films)}, scales = {json.dumps(list(SCALES))};"
    )


if __name__ == "__main__":
    main()
