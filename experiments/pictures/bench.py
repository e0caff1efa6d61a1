"""How fast pictures, films, pages and files for other programs are made, and how smoothly a page plays.

    python experiments/pictures/bench.py [--browser /usr/bin/chromium]

Compiled code is on disk before anything is timed. The page is measured only where Playwright and a browser are there;
it draws without a GPU.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np

from motionmind import Engine, Motion, compose, draw_picture, draw_sheet, human44, read_posture, write_motion
from motionmind.render.sheet import png

BALLET = Path(__file__).parents[2] / "corpora" / "ballet"
POSTURES = BALLET / "postures"

# What 300 pictures take: from one to the next, and of that in the player's own code, milliseconds.
FRAMES = """async () => {
  const { player, stage } = window.motionmind;
  const own = [], [show, render] = [stage.show.bind(stage), stage.render.bind(stage)];
  stage.show = (...all) => { const t = performance.now(); show(...all); own.push(performance.now() - t); };
  stage.render = (...all) => { const t = performance.now(); render(...all); own.push(performance.now() - t); };
  player.play();
  const times = [];
  await new Promise((done) => {
    const next = (time) => { times.push(time); times.length > 300 ? done() : requestAnimationFrame(next); };
    requestAnimationFrame(next);
  });
  return { frames: times.slice(1).map((time, i) => time - times[i]), own };
}"""


def long(motion: Motion, frames: int) -> Motion:
    """The motion over and over, so many frames in all, 30 a second."""
    chosen = np.arange(frames) % len(motion)
    times = np.arange(frames) / 30.0
    return replace(
        motion, rotations=motion.rotations[chosen], root=motion.root[chosen], times=times, insertions=(), name="long"
    )


def best(make: Callable[[], object], times: int = 5) -> float:
    """The least time that it takes, seconds; the first run, which loads compiled code, does not count."""
    make()
    spent = []
    for _ in range(times):
        began = perf_counter()
        make()
        spent.append(perf_counter() - began)
    return min(spent)


def playing(page: Path, browser: str, ghosts: bool) -> str:
    """Frame times of a page in a browser without a GPU."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        flags = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
        chromium = playwright.chromium.launch(executable_path=browser, args=flags)
        view = chromium.new_page(viewport={"width": 1280, "height": 720})
        view.goto(page.as_uri())
        view.wait_for_function("window.motionmind")
        if not ghosts:
            view.click("#ends")
        view.wait_for_timeout(1000)
        found = view.evaluate(FRAMES)
        chromium.close()
    frames, own = sorted(found["frames"]), sum(found["own"])
    return (
        f"{1000 * len(frames) / sum(frames):.0f} a second, median {statistics.median(frames):.0f} ms, 95th percentile "
        f"{frames[int(0.95 * len(frames))]:.0f} ms; {own / sum(frames):.1%} of it in the player's own code"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--browser", default="/usr/bin/chromium")
    browser = parser.parse_args().browser
    adagio = compose(BALLET / "centre.score", "adagio")
    film = adagio.resample(25.0).slice(0, 200)
    piece = long(adagio.resample(30.0), 5000)
    whole = long(adagio.resample(30.0), 10_000)
    hands = long(compose(BALLET.parent / "hands" / "hands.score", "wave").resample(30.0), 5000)
    assert human44().difference(hands.skeleton) is None
    tween = (
        Engine.load("ballet")
        .tween(*(read_posture(POSTURES / f"{name}.json") for name in ("arabesque", "fifth")))
        .motion
    )
    rows: list[tuple[str, str, str]] = []
    with tempfile.TemporaryDirectory() as folder:
        here = Path(folder)

        def timed(what: str, make: Callable[[], object], aim: str = "") -> None:
            rows.append((what, f"{best(make):.2f} s", aim))

        timed("contact sheet of 50 postures, as PNG", lambda: png(draw_sheet(adagio, range(50))), "0.3 s")
        timed("GIF of 200 frames, 480 pixels", lambda: draw_picture(here / "a.gif", film, fps=25), "1.5 s")
        timed("MP4 of 200 frames, 480 pixels", lambda: draw_picture(here / "a.mp4", film, fps=25))
        timed("SVG of a tween of 1.5 s, 19 frames", lambda: draw_picture(here / "a.svg", tween))
        timed("GLB of 10,000 frames", lambda: write_motion(here / "a.glb", whole), "1 s")
        timed("BVH of 10,000 frames", lambda: write_motion(here / "a.bvh", whole))
        timed("AMASS's .npz of 10,000 frames", lambda: write_motion(here / "a.npz", whole))
        timed("page of 5,000 postures", lambda: draw_picture(here / "a.html", piece))
        draw_picture(here / "b.html", hands)
        for name, file in (("human23", "a.html"), ("human44", "b.html")):
            rows.append((f"size of that page, {name}", f"{(here / file).stat().st_size / 1e6:.2f} MB", "4 MB"))
        try:
            draw_picture(here / "c.html", tween)
            rows += [
                ("the tween's page, pictures", playing(here / "c.html", browser, True), "60 a second"),
                ("the same without ghosts", playing(here / "c.html", browser, False), "60 a second"),
            ]
        except Exception as error:  # a browser that is not there has many ways to say so
            print(f"the page was not played: {error}", file=sys.stderr)
    print("| | reached | aim |\n|---|---|---|")
    for row in rows:
        print(f"| {' | '.join(row)} |")


if __name__ == "__main__":
    main()
