"""Draw the pictures of the studio in these pages, and the film in README: use it in a browser, and look.

    python docs/studio/draw.py

It needs Chromium, Playwright and the extra `studio`; it takes about a minute.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from playwright.sync_api import sync_playwright

HERE = Path(__file__).parent
SIZE = {"width": 1200, "height": 750}  # pixels of the page
TALL = {"width": 1200, "height": 900}  # where a panel says more
FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
FILM_WIDTH = 800  # pixels
PAUSE = 125  # milliseconds of the film between two pictures
LONG = 120_000  # milliseconds: the first search compiles
COLOURS = 256  # in a picture
EACH = 20  # pixels of a colour that count: most of a page is paper


def main() -> None:
    """Draw all of them."""
    with tempfile.TemporaryDirectory() as folder, studio(Path(folder)) as address, browser() as chromium:
        page = chromium.new_context(viewport=SIZE, color_scheme="light").new_page()
        page.goto(address)
        film = Film(page)
        a_to_b(page, film)
        time_line(page, film)
        film.write(HERE.parent / "studio.gif")
        page.set_viewport_size(TALL)
        variations(page)
        pose(page)
        movement(page, Path(folder))
        take_away(page)


@contextmanager
def studio(folder: Path) -> Iterator[str]:
    """A studio with a project of its own; gives its address, token and all."""
    command = [sys.executable, "-m", "motionmind", "studio", str(folder / "dance.motionmind"), "--no-browser"]
    process = subprocess.Popen([*command, "--port", "0"], stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        yield next(match[0] for line in process.stdout if (match := re.search(r"http://\S+", line)))
    finally:
        process.terminate()
        process.wait()


@contextmanager
def browser() -> Iterator[Any]:
    """Chromium, which draws without a screen."""
    with sync_playwright() as playwright:
        path = shutil.which("chromium") or shutil.which("chromium-headless-shell")  # or else Playwright's own
        chromium = playwright.chromium.launch(executable_path=path, args=FLAGS)
        yield chromium
        chromium.close()


class Film:
    """Pictures of a page, one after the other."""

    def __init__(self, page: Any) -> None:
        self._page = page
        self._pictures: list[Image.Image] = []

    def look(self, times: int) -> None:
        """Look so many times, while the page goes on."""
        for _ in range(times):
            picture = seen(self._page)
            height = picture.height * FILM_WIDTH // picture.width
            self._pictures.append(picture.resize((FILM_WIDTH, height), Image.Resampling.LANCZOS))
            self._page.wait_for_timeout(20)

    def write(self, path: Path) -> None:
        """Write them as a GIF that goes round."""
        palette = palette_of(self._pictures)
        first, *others = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in self._pictures]
        first.save(path, save_all=True, append_images=others, duration=PAUSE, loop=0, optimize=True)


def seen(page: Any) -> Image.Image:
    """Return the page as it looks now."""
    return Image.open(BytesIO(page.screenshot())).convert("RGB")


def palette_of(pictures: Sequence[Image.Image]) -> Image.Image:
    """Return a picture with colours for some pictures: half for what there is most of, half for what is small."""
    pixels = np.concatenate([np.asarray(picture).reshape(-1, 3) for picture in pictures])
    alike = (pixels >> 3).astype(np.int64) @ [1024, 32, 1]
    order = np.argsort(alike, kind="stable")
    _, starts, counts = np.unique(alike[order], return_index=True, return_counts=True)
    number = np.arange(len(order)) - np.repeat(starts, counts)  # of a pixel among those of its colour
    colours = [
        colour
        for some in (pixels, pixels[order[number < EACH]])
        for colour in Image.fromarray(some[None]).quantize(COLOURS // 2).getpalette() or []
    ]
    palette = Image.new("P", (1, 1))
    palette.putpalette(colours)
    return palette


def draw(page: Any, name: str) -> None:
    """Draw the page as it looks now."""
    picture = seen(page)
    drawn = picture.quantize(palette=palette_of([picture]), dither=Image.Dither.NONE)
    drawn.save(HERE / f"{name}.png", optimize=True)


def click(page: Any, name: str) -> None:
    """Click what has this test id."""
    page.get_by_test_id(name).first.click()


def insert(page: Any, name: str, last: int = 0) -> None:
    """Put a posture, or a clip up to its frame `last`, at the end of the time line."""
    page.evaluate(
        "([name, last]) => studio.api.edit({ edit: 'insert', id: `drawn-${name}`, source: `ballet/${name}`,"
        " first: 0, last, mirrored: false, before: null })",
        [name, last],
    )


def settle(page: Any) -> None:
    """Wait until all seams are smooth."""
    for _ in range(LONG // 200):
        if page.evaluate("studio.store.state.piece.seams.every(({ state }) => ['inserted', 'smooth'].includes(state))"):
            return
        page.wait_for_timeout(200)


def a_to_b(page: Any, film: Film) -> None:
    """Find movement from one posture to another, and accept one of four."""
    page.get_by_test_id("posture-arabesque").wait_for()
    page.wait_for_timeout(2000)
    film.look(4)
    click(page, "posture-arabesque")
    film.look(3)
    click(page, "posture-fifth")
    film.look(2)
    page.wait_for_selector("[data-testid=alternatives][data-state=found]", timeout=LONG)
    film.look(16)
    page.evaluate("Promise.all([...document.querySelectorAll('.film img')].map((picture) => picture.decode()))")
    click(page, "play-alternatives")  # at rest, pictures are fine
    page.set_viewport_size(TALL)
    page.wait_for_timeout(2000)
    draw(page, "a-to-b")
    page.set_viewport_size(SIZE)
    page.wait_for_timeout(1000)
    click(page, "alternative-2")
    film.look(3)
    click(page, "accept")
    page.get_by_test_id("insertion-1").wait_for()


def time_line(page: Any, film: Film) -> None:
    """Let the piece grow, and look at what was inserted."""
    for posture in ("attitude", "bow"):
        insert(page, posture)
    page.wait_for_timeout(500)
    page.get_by_test_id("insertion-3").wait_for(timeout=LONG)
    settle(page)
    click(page, "play")
    film.look(28)
    click(page, "insertion-2")
    page.wait_for_timeout(500)
    film.look(4)
    click(page, "play")  # at rest, pictures are fine
    page.wait_for_timeout(2000)
    draw(page, "time-line")


def variations(page: Any) -> None:
    """Vary the piece, with a clip at its end, and look at both."""
    insert(page, "adagio", 40)
    page.get_by_test_id("insertion-4").wait_for(timeout=LONG)
    settle(page)
    click(page, "open-vary")
    page.get_by_test_id("tile-3").wait_for(timeout=LONG)
    page.get_by_test_id("depart").fill("25")
    click(page, "beside")
    page.wait_for_timeout(3000)
    page.get_by_test_id("scrub").fill("0.7")
    page.wait_for_timeout(3000)
    draw(page, "variations")


def pose(page: Any) -> None:
    """Move a body by its hand."""
    click(page, "open-pose")
    page.get_by_test_id("handle-pelvis").wait_for()
    page.get_by_test_id("pose-from").select_option("ballet/arabesque")
    page.wait_for_timeout(2000)
    handle = page.get_by_test_id("handle-left_wrist")
    handle.focus()
    for _ in range(8):
        page.keyboard.press("Shift+ArrowUp")
    page.wait_for_timeout(1500)
    draw(page, "pose")


def movement(page: Any, folder: Path) -> None:
    """Bring a recording."""
    file = folder / "my dance.bvh"
    score = ["ballet/centre.score", "--clip", "adagio"]
    subprocess.run([sys.executable, "-m", "motionmind", "compose", *score, "-o", str(file)], check=True)
    click(page, "open-movement")
    page.locator("input[type=file]").first.set_input_files(str(file))
    page.get_by_test_id("understood").wait_for(timeout=LONG)
    page.wait_for_timeout(1500)
    draw(page, "movement")


def take_away(page: Any) -> None:
    """Look at what can be taken away."""
    click(page, "open-take")
    page.wait_for_timeout(1500)
    draw(page, "take-away")


if __name__ == "__main__":
    main()
