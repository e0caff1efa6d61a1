"""A page in a browser, and what is measured on it: pictures, whether words can be read, and buttons be met."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from io import BytesIO
from typing import Any
from urllib.parse import urljoin

import numpy as np
from PIL import Image

from motionmind._typing import Bools, Int16s

SIZE = {"width": 640, "height": 480}  # of a page, where its size is all the same
FINE = {"device_scale_factor": 1, "is_drawn": True}  # for pictures that are measured
# Few pixels and, until somebody asks for it, nothing that plays.
RESTING: dict[str, Any] = {"device_scale_factor": 0.5, "reduced_motion": "reduce"}
PLAIN = {"color_scheme": "light", "reduced_motion": "no-preference"}  # what a browser is told of its user's wishes
# WebGL does all but draw: shaders are still translated and linked. Drawing in software is most of the time of a page
# whose picture nobody looks at.
_UNDRAWN = """
for (const what of ['Arrays', 'Elements', 'ArraysInstanced', 'ElementsInstanced', 'RangeElements'])
  WebGL2RenderingContext.prototype[`draw${what}`] = () => {};
"""

# The sizes of a notebook computer, of a telephone, upright and lying, and of the smallest; these are used by fingers.
SCREENS: dict[str, dict[str, Any]] = {
    "computer": {"viewport": {"width": 1280, "height": 800}},
    "upright": {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True},
    "lying": {"viewport": {"width": 844, "height": 390}, "has_touch": True, "is_mobile": True},
    "smallest": {"viewport": {"width": 320, "height": 568}, "has_touch": True, "is_mobile": True},
}

# Of every element with words in it: its name, the contrast to what is behind it (WCAG 2.2, "contrast ratio"), and
# whether words lie on a drawing with nothing behind them.
_CONTRASTS = """
(() => {
  const pen = document.createElement('canvas').getContext('2d', { willReadFrequently: true });
  const light = colour => {
    pen.clearRect(0, 0, 1, 1);
    pen.fillStyle = colour;
    pen.fillRect(0, 0, 1, 1);
    const [r, g, b, alpha] = pen.getImageData(0, 0, 1, 1).data;
    const linear = [r, g, b].map(v => (v /= 255) <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
    return [0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2], alpha];
  };
  const behind = one => light(getComputedStyle(one).backgroundColor)[1] === 255 ? one : behind(one.parentElement);
  const words = [...document.querySelectorAll('body *')].filter(one => one.checkVisibility({ visibilityProperty: true })
    && (one.matches('select') || [...one.childNodes].some(node => node.nodeType === 3 && node.textContent.trim())));
  const canvases = [...document.querySelectorAll('canvas')];
  return words.map(one => {
    const [a] = light(getComputedStyle(one).color), [b] = light(getComputedStyle(behind(one)).backgroundColor);
    const range = document.createRange();
    range.selectNodeContents(one);
    const meets = (p, q) => p.left < q.right && q.left < p.right && p.top < q.bottom && q.top < p.bottom;
    const drawn = canvases.some(canvas => behind(one).contains(canvas)
      && [...range.getClientRects()].some(box => meets(box, canvas.getBoundingClientRect())));
    const name = one.id || one.className || one.tagName.toLowerCase();
    return [name, (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05), drawn];
  });
})()
"""

# Of every control that is seen: its name, whether it is whole, whether its middle is its own, and its size.
_TARGETS = """
[...document.querySelectorAll('button, select, summary, [role=slider], [tabindex="0"]')]
  .filter(one => one.checkVisibility({ visibilityProperty: true }) && getComputedStyle(one).pointerEvents !== 'none')
  .map(one => {
    const { left, right, top, bottom, width, height } = one.getBoundingClientRect();
    const met = document.elementFromPoint((left + right) / 2, (top + bottom) / 2);
    return [one.id || one.innerText, left >= 0 && top >= 0 && right <= innerWidth && bottom <= innerHeight,
      one === met || one.contains(met), Math.min(width, height)];
  })
"""


class Tabs:
    """Tabs of a browser, which tests use one after the other: to begin one takes half the time of showing a page."""

    def __init__(self, browser: Any) -> None:
        self.browser = browser
        self._free: dict[str, list[Any]] = defaultdict(list)

    @contextmanager
    def tab(
        self, hearing: Mapping[str, Callable[[Any], object]], is_drawn: bool = False, script: str = "", **options: Any
    ) -> Iterator[Any]:
        """Yield a tab as of a context of its own, of Playwright's `options`, which holds nothing of who had it before.

        Args:
            hearing: what hears each event of the tab.
            is_drawn: whether WebGL draws.
            script: what runs before those of each page; a tab with one serves nobody else.
            options: of the context; a viewport is among them.
        """
        wishes = {name: options.get(name, usual) for name, usual in PLAIN.items()}
        is_mobile = "is_mobile" in options  # a page on a telephone keeps the scale at which it was laid out
        lasting = {name: value for name, value in options.items() if is_mobile or name not in (*PLAIN, "viewport")}
        free = [] if script else self._free[json.dumps([is_drawn, lasting], sort_keys=True)]
        tab = free.pop() if free else self._begin("" if is_drawn else _UNDRAWN, script, options)
        tab.set_viewport_size(options["viewport"])
        tab.emulate_media(**wishes)
        for event, hear in hearing.items():
            tab.on(event, hear)
        yield tab
        tab.unroute_all(behavior="wait")  # an answer still held back would fail in whatever test comes next
        if script:
            tab.context.close()
            return
        for event, hear in hearing.items():
            tab.remove_listener(event, hear)
        self._leave(tab)
        free.append(tab)

    def _leave(self, tab: Any) -> None:
        """Leave the page of a tab, and nothing of it: no other tabs of its context, cookies, or notes of its own."""
        for other in tab.context.pages:
            if other is not tab:
                other.close()
        if tab.url.startswith("http:"):
            tab.evaluate("localStorage.clear(), sessionStorage.clear()")
            tab.context.clear_cookies()
            # A page of the same server: the next one is then shown by the same process, which knows its scripts. That
            # and what the browser keeps of the server's files is more than half of what it takes to open a studio.
            tab.goto(urljoin(tab.url, "/health"))
        else:
            tab.goto("about:blank")
        tab.mouse.move(0, 0)

    def _begin(self, *scripts_and_options: Any) -> Any:
        *scripts, options = scripts_and_options
        context = self.browser.new_context(**options)
        for script in filter(None, scripts):
            context.add_init_script(script)
        tab = context.new_page()
        _fill_screen(tab)
        return tab


def beside(tab: Any) -> Any:
    """Return another tab of the same browser's user, of the same size.

    Without that, its size is the one for which the context was begun, perhaps by a test of telephones.
    """
    other = tab.context.new_page()
    other.set_viewport_size(tab.viewport_size)
    return other


class Chromium:
    """The browser, from when it is first asked for until it is closed; it is started anew when it is needed again.

    To start it takes as long as to show a page, so that tests of pages that follow each other share it.
    """

    def __init__(self, path: str, flags: Sequence[str]) -> None:
        self._path, self._flags = path, [*flags]
        self._open = ExitStack()
        self._tabs: Tabs | None = None

    @property
    def browser(self) -> Any:
        """Playwright's browser."""
        return self.tabs.browser

    @property
    def tabs(self) -> Tabs:
        """The browser's tabs."""
        if self._tabs is None:
            from playwright.sync_api import sync_playwright

            playwright = self._open.enter_context(sync_playwright())
            browser = playwright.chromium.launch(executable_path=self._path, args=self._flags)
            self._open.callback(browser.close)
            self._tabs = Tabs(browser)
        return self._tabs

    def close(self) -> None:
        """End the browser."""
        self._tabs = None
        self._open.close()


def _fill_screen(tab: Any) -> None:
    """Leave nothing of the window but the page: a wheel that turns while a page loads has all of it composed again."""
    session = tab.context.new_cdp_session(tab)
    window = session.send("Browser.getWindowForTarget")["windowId"]
    session.send("Browser.setWindowBounds", {"windowId": window, "bounds": {"windowState": "fullscreen"}})
    session.detach()


@dataclass
class Opened:
    """A page in the browser, and what it did that no page should."""

    page: Any
    said: list[str] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)

    def get(self, script: str) -> Any:
        return self.page.evaluate(script)

    def wait(self, script: str) -> None:
        """Wait until this is so. The page forbids itself what Playwright's own waiting does."""
        for _ in range(500):
            if self.get(f"!!({script})"):
                return
            self.page.wait_for_timeout(20)
        raise AssertionError(f"never so: {script}")

    def press(self, key: str) -> None:
        self.page.keyboard.press(key)

    def click(self, button: str) -> None:
        self.page.click(f"#{button}")

    def picture(self) -> Int16s:
        """The canvas's pixels [H, W, 3], when the picture is that of now."""
        self.get("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
        shot = self.page.locator("#canvas").screenshot(style="#state, #legend, #credits { visibility: hidden }")
        return np.array(Image.open(BytesIO(shot)).convert("RGB")).astype(np.int16)

    @property
    def time(self) -> float:
        return float(self.get("motionmind.player.time"))


def near(picture: Int16s, colour: tuple[int, int, int], most: float = 0.06) -> Bools:
    """Pixels [H, W] of a colour, whatever its brightness and haze: whose hue, as shares of the channels, is like it."""
    pale = picture - picture.min(axis=-1, keepdims=True)
    wanted = np.array(colour) - min(colour)
    strong = pale.sum(axis=-1) > 0.45 * wanted.sum()
    shares = pale / np.maximum(pale.sum(axis=-1, keepdims=True), 1)
    return np.asarray(strong & (np.abs(shares - wanted / wanted.sum()).max(axis=-1) < most))


def readable_words(tab: Any) -> set[str]:
    """Check that all words on a page have a contrast of 4.5 to what is behind them; return whose words these are."""
    found = tab.evaluate(_CONTRASTS)
    assert [name for name, _, drawn in found if drawn] == []
    assert {name: ratio for name, ratio, _ in found if ratio < 4.5} == {}
    return {name for name, _, _ in found}


def reachable_controls(tab: Any, least: float) -> set[str]:
    """Check that controls are whole, uncovered and `least` CSS pixels wide and high; return which there are."""
    assert tab.evaluate("[document.documentElement.scrollWidth > innerWidth]") == [False]
    found = tab.evaluate(_TARGETS)
    assert [name for name, whole, _, _ in found if not whole] == []
    assert [name for name, _, met, _ in found if not met] == []
    assert {name: size for name, _, _, size in found if size < least} == {}
    return {name for name, _, _, _ in found}
