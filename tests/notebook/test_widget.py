"""The widget: what Python and the page share, in a kernel and in a browser.

In the browser a small host stands for the notebook: a model with `get`, `set`, `save_changes`, `on` and `off`, which is
all that anywidget gives a widget (anywidget.dev, "Anywidget Front-End Module").
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bundled_clips import ballet_clip
from pages import RESTING, Tabs

from motionmind import Motion, MotionMindError, Posture, WrongTypeError, vary
from motionmind.notebook.cell import MAX_ROTATIONS

pytest.importorskip("anywidget", reason="anywidget is not installed")

from motionmind.notebook import Player

pytestmark = pytest.mark.long

ADAGIO = replace(ballet_clip("adagio").resample(10.0).slice(0, 21), name="adagio")  # 0 to 2 seconds


# --- in Python ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("thing", [ADAGIO, ADAGIO.posture(0), vary(ADAGIO)], ids=["motion", "posture", "variation"])
def test_anything_that_moves_is_shown_from_its_beginning(thing: Any) -> None:
    player = Player(thing)
    assert isinstance(player.motion, Motion)
    assert (player.time, player.selection) == (player.motion.times[0], None)
    assert player.selected() is player.motion
    assert player.get_state("_page")["_page"].startswith("<!doctype html>")


@pytest.mark.parametrize(("start", "end"), [(0.0, 2.0), (0.5, 1.5), (0.45, 0.72), (1.03, 1.08), (0.0, 0.05)])
def test_the_selected_frames_are_those_within(start: float, end: float) -> None:
    player = Player(ADAGIO)
    player.selection = (start, end)
    within = [float(time) for time in ADAGIO.times if start - 1e-9 <= time <= end + 1e-9]
    before = [float(time) for time in ADAGIO.times if time <= end][-1:]
    np.testing.assert_allclose(player.selected().times, within or before)


def test_the_posture_is_that_of_the_moment() -> None:
    player = Player(ADAGIO)
    player.time = 0.73
    assert isinstance(player.posture(), Posture)
    np.testing.assert_array_equal(player.posture().rotations, ADAGIO.at(np.array([0.73])).rotations[0])


def test_another_motion_begins_anew() -> None:
    player = Player(ADAGIO)
    player.time, player.selection, page = 1.0, (0.5, 1.5), player._page
    player.motion = ADAGIO.slice(3, 6)
    assert (player.time, player.selection) == (pytest.approx(0.3), None)
    assert player._page != page


def refuse_time(player: Player) -> None:
    player.time = 2.5


def refuse_selection(player: Player) -> None:
    player.selection = (1.0, 3.0)


def refuse_backwards(player: Player) -> None:
    player.selection = (1.0, 0.5)


def refuse_words(player: Player) -> None:
    player.selection = ("a", "b")  # type: ignore[assignment]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (refuse_time, "time: the motion lasts from 0 to 2 s; 2.5 is outside"),
        (refuse_selection, "selection: the motion lasts from 0 to 2 s; 3 is outside"),
        (refuse_backwards, "an earlier and a later time"),
        (refuse_words, "selection must be an array of numbers"),
    ],
)
def test_what_is_not_within_the_motion_is_refused(change: Callable[[Player], None], words: str) -> None:
    player = Player(ADAGIO)
    with pytest.raises(MotionMindError, match=words):
        change(player)
    assert (player.time, player.selection) == (0.0, None)


def test_what_does_not_move_or_is_too_long_is_refused() -> None:
    with pytest.raises(WrongTypeError, match="movement must be"):
        Player("clip.bvh")
    frames = MAX_ROTATIONS // 23 + 1
    rest = np.tile([0.0, 0.0, 0.0, 1.0], (frames, 23, 1))
    with pytest.raises(MotionMindError, match="too long"):
        Player(Motion(ADAGIO.skeleton, rest, np.zeros((frames, 3)), np.arange(frames) / 30.0))


# --- in a kernel ----------------------------------------------------------------------------------------------------


def test_a_kernel_shows_it_and_hears_the_page(tmp_path: Path) -> None:
    nbformat = pytest.importorskip("nbformat", reason="nbformat is not installed")
    nbclient = pytest.importorskip("nbclient", reason="nbclient is not installed")
    pytest.importorskip("ipykernel", reason="ipykernel is not installed")
    cells = [
        "from motionmind import Engine\n"
        "from motionmind.notebook import Player\n"
        "engine = Engine.load('ballet')\n"
        "tween = engine.tween(engine.posture('ballet/arabesque'), engine.posture('ballet/fifth'))\n"
        "player = Player(tween)\n"
        "player",
        "player.time = 0.5; player.selection = (0.25, 0.75)",
        # As the notebook calls it for each message of the page:
        "player.comm.handle_msg({'content': {'data': {'method': 'update', 'state': {'time': 1.25}}}, 'buffers': []})\n"
        "print(player.time, len(player.selected()))",
        "tween",
    ]
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(source) for source in cells])
    client = nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(tmp_path)}})
    client.execute()
    (shown,) = notebook.cells[0].outputs
    identity = shown["data"]["application/vnd.jupyter.widget-view+json"]["model_id"]
    state = notebook.metadata.widgets["application/vnd.jupyter.widget-state+json"]["state"][identity]["state"]
    assert (state["time"], state["selection"]) == (1.25, [0.25, 0.75])
    assert "function render" in state["_esm"]
    assert notebook.cells[2].outputs[0]["text"] == "1.25 15\n"
    assert "<iframe" in notebook.cells[3].outputs[0]["data"]["text/html"]


# --- in a browser ---------------------------------------------------------------------------------------------------

HOST = """<!doctype html>
<meta charset="utf-8">
<div id="one"></div><div id="two"></div>
<script type="application/json" id="state">STATE</script>
<script type="application/json" id="esm">ESM</script>
<script type="module">
const parsed = (id) => JSON.parse(document.getElementById(id).textContent);
const url = URL.createObjectURL(new Blob([parsed("esm")], { type: "text/javascript" }));
const { default: widget } = await import(url);
class Model {
  constructor(state) { this.state = state; this.listeners = {}; this.said = []; this.unsaved = {}; }
  get(name) { return this.state[name]; }
  set(name, value) { this.unsaved[name] = value; this.receive(name, value); }
  save_changes() { this.said.push(this.unsaved); this.unsaved = {}; }
  on(event, listener) { (this.listeners[event] ??= new Set()).add(listener); }
  off(event, listener) { this.listeners[event].delete(listener); }
  receive(name, value) {
    if (JSON.stringify(this.state[name]) === JSON.stringify(value)) return;
    this.state[name] = value;
    for (const listener of this.listeners[`change:${name}`] ?? []) listener();
  }
}
const model = new Model(parsed("state"));
const close = ["one", "two"].map((id) => widget.render({ model, el: document.getElementById(id) }));
window.host = { model, close };
</script>
"""


class Host:
    """A host page with two views of one player."""

    def __init__(self, tab: Any) -> None:
        self.tab = tab

    def get(self, script: str) -> Any:
        return self.tab.evaluate(script)

    def view(self, number: int) -> Any:
        return self.tab.query_selector_all("iframe")[number].content_frame()

    def wait(self, view: int | None, script: str) -> None:
        for _ in range(300):
            place = self.tab if view is None else self.view(view)
            if place.evaluate(f"!!({script})"):
                return
            self.tab.wait_for_timeout(20)
        raise AssertionError(f"never so: {script}")

    def wait_until_ready(self) -> None:
        self.wait(None, "window.host && document.querySelectorAll('iframe').length === 2")
        for number in (0, 1):
            self.tab.query_selector_all("iframe")[number].scroll_into_view_if_needed()
            self.wait(number, "window.motionmind?.selection")
            self.view(number).evaluate("motionmind.player.pause()")
        self.tab.query_selector_all("iframe")[0].scroll_into_view_if_needed()


@pytest.fixture
def host(tabs: Tabs, tmp_path: Path) -> Iterator[Host]:
    player = Player(ADAGIO, height=400)
    state = {key: player.get_state(key)[key] for key in ("time", "selection", "height", "_page")}
    text = [json.dumps(part).replace("<", "\\u003c") for part in (state, player.get_state("_esm")["_esm"])]
    (tmp_path / "host.html").write_text(HOST.replace("ESM", text[1]).replace("STATE", text[0]), "utf-8")
    asked: list[str] = []
    hearing = {"request": lambda request: asked.append(request.url)}
    with tabs.tab(hearing, viewport={"width": 800, "height": 900}, **RESTING) as tab:
        tab.goto((tmp_path / "host.html").as_uri())
        host = Host(tab)
        host.wait_until_ready()
        yield host
    assert [url for url in asked if not url.startswith(("data:", "file:", "blob:", "about:"))] == []


def test_the_page_tells_the_model_of_the_time_and_the_other_view_follows(host: Host) -> None:
    host.view(0).evaluate("motionmind.player.seek(0.7)")
    host.wait(None, "host.model.state.time === 0.7")
    host.wait(1, "motionmind.player.time === 0.7")
    assert host.get("host.model.said.at(-1)") == {"time": 0.7}


def test_the_model_moves_the_page_and_nothing_is_said_back(host: Host) -> None:
    said = host.get("host.model.said.length")
    host.get("host.model.receive('time', 0.3)")
    host.get("host.model.receive('selection', [0.2, 1.1])")
    for view in (0, 1):
        host.wait(view, "motionmind.player.time === 0.3 && motionmind.selection.stretch?.join() === '0.2,1.1'")
        assert host.view(view).evaluate("document.querySelector('.selection').getBoundingClientRect().width") > 100
    host.tab.wait_for_timeout(300)
    assert host.get("host.model.said.length") == said


def test_while_it_plays_python_learns_of_it_some_ten_times_a_second(host: Host) -> None:
    host.view(1).evaluate("motionmind.player.speed = 0.5")
    before = host.get("host.model.said.length")
    host.view(0).evaluate("motionmind.player.speed = 0.5; motionmind.player.play()")
    host.tab.wait_for_timeout(1500)
    host.view(0).evaluate("motionmind.player.pause()")
    assert 3 <= host.get("host.model.said.length") - before <= 22
    host.wait(1, f"motionmind.player.time === {host.view(0).evaluate('motionmind.player.time')}")


def test_dragging_with_shift_selects_and_without_it_seeks(host: Host) -> None:
    shown = host.view(0).evaluate("motionmind.player.time")
    box = host.view(0).query_selector("#timeline").bounding_box()
    middle = box["y"] + box["height"] / 2
    host.tab.keyboard.down("Shift")
    host.tab.mouse.move(box["x"] + 0.75 * box["width"], middle)
    host.tab.mouse.down()
    host.tab.mouse.move(box["x"] + 0.25 * box["width"], middle, steps=5)
    host.tab.mouse.up()
    host.tab.keyboard.up("Shift")
    host.wait(None, "host.model.state.selection?.length === 2")
    assert host.get("host.model.state.selection") == pytest.approx([0.5, 1.5], abs=0.02)
    assert host.view(0).evaluate("motionmind.player.time") == shown
    host.tab.mouse.click(box["x"] + 0.5 * box["width"], middle)
    host.wait(None, "Math.abs(host.model.state.time - 1) < 0.02")
    assert host.get("host.model.state.selection") == pytest.approx([0.5, 1.5], abs=0.02)


def test_keys_and_buttons_select_what_plays(host: Host) -> None:
    frame = host.view(0)
    frame.evaluate("motionmind.player.seek(0.4); document.body.focus()")
    frame.query_selector("#from").click()
    host.wait(None, "host.model.state.selection?.join() === '0.4,2'")
    frame.evaluate("motionmind.player.seek(0.6)")
    host.tab.keyboard.press("]")
    host.wait(None, "host.model.state.selection?.join() === '0.4,0.6'")
    frame.evaluate("motionmind.player.play()")
    times = []
    for _ in range(20):
        host.tab.wait_for_timeout(40)
        times.append(frame.evaluate("motionmind.player.time"))
    assert 0.4 <= min(times) < max(times) <= 0.6 + 1e-6
    host.tab.keyboard.press("Escape")
    host.wait(None, "host.model.state.selection === null")
    assert frame.evaluate("document.querySelector('.selection').hidden")
    assert "Shift" in frame.evaluate("document.querySelector('#sheet dl').textContent")


def test_another_motion_takes_the_place_of_the_first(host: Host) -> None:
    player = Player(ADAGIO.slice(0, 4))
    host.get(f"host.model.receive('_page', {json.dumps(player._page)})")
    host.wait(0, "window.motionmind?.selection && motionmind.motion.length === 4")


def test_a_view_that_is_closed_hears_nothing_more(host: Host) -> None:
    said = host.get("host.close.forEach((close) => close()), host.model.said.length")
    host.view(0).evaluate("motionmind.player.seek(0.9)")
    host.get("host.model.receive('time', 0.2)")
    host.tab.wait_for_timeout(200)
    assert host.get("host.model.said.length") == said
    assert host.view(0).evaluate("motionmind.player.time") == 0.9
