"""The page and its server in a browser: who is let in, what is asked for, and windows that share a project."""

from __future__ import annotations

import re
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import urlsplit

import pytest
from pages import RESTING, Tabs, beside
from piece_page import until
from studio_server import LARGE, SMALL, Client, Served

pytestmark = pytest.mark.long


class Elsewhere(BaseHTTPRequestHandler):
    """An empty page of another server."""

    def do_GET(self) -> None:
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()

    def log_message(self, *_: object) -> None:  # type: ignore[override]
        pass


@pytest.fixture
def expect() -> Any:
    return pytest.importorskip("playwright.sync_api").expect


def test_the_address_forgets_the_token_and_a_reload_keeps_the_window(
    studio_server: Served, studio_page: Any, expect: Any
) -> None:
    expect(studio_page.get_by_test_id("posture-arabesque")).to_be_visible()
    assert studio_server.keys.token not in studio_page.url
    window = studio_page.evaluate("studio.window")
    studio_page.reload()
    expect(studio_page.get_by_test_id("posture-arabesque")).to_be_visible()
    assert studio_page.evaluate("studio.window") == window
    asked = "performance.getEntriesByType('resource').filter(one => one.transferSize > 0).map(one => one.name)"
    assert [name for name in studio_page.evaluate(asked) if "/api/" not in name] == [], "files that the browser has"


def test_no_request_leaves_this_machine(studio_server: Served, tabs: Tabs, expect: Any) -> None:
    asked: set[str] = set()
    hearing = {"request": lambda request: asked.add(urlsplit(request.url).netloc)}
    with tabs.tab(hearing, viewport={"width": 1024, "height": 768}, **RESTING) as page:
        page.goto(studio_server.entry)
        expect(page.get_by_test_id("posture-arabesque")).to_be_visible()
        for name in ("vary", "pose", "movement", "take"):
            page.get_by_test_id(f"open-{name}").click()
            expect(page.get_by_test_id(f"panel-{name}")).to_be_visible()
    assert asked - {""} == {urlsplit(studio_server.url).netloc}  # "" of data: and blob:


def test_another_window_sees_an_edit_and_takes_back_its_own_alone(
    studio_server: Served, studio_page: Any, expect: Any
) -> None:
    expect(studio_page.get_by_test_id("posture-arabesque")).to_be_visible()
    other = beside(studio_page)
    other.goto(studio_server.url)  # the cookie lets it in
    expect(other.get_by_test_id("posture-arabesque")).to_be_visible()
    mine = Client(studio_server.url, studio_page.evaluate("studio.window"))
    mine.cookie = studio_server.cookie
    mine.insert("b1", "ballet/adagio", 0, 20)
    for page in (studio_page, other):
        page.bring_to_front()  # a browser may rest from drawing windows that nobody sees
        expect(page.get_by_test_id("block-b1")).to_be_visible(timeout=30_000)
    expect(other.get_by_test_id("undo")).to_be_disabled()
    studio_page.get_by_test_id("undo").click()
    for page in (studio_page, other):
        expect(page.get_by_test_id("block-b1")).to_have_count(0)


def test_a_title_that_is_left_as_it_was_is_not_given_again(
    studio_server: Served, studio_page: Any, expect: Any
) -> None:
    title = studio_page.get_by_test_id("title")
    expect(title).to_have_value("piece")
    title.click()
    studio_server.edit(edit="title", title="Swan")
    expect(studio_page).to_have_title(re.compile("^Swan"))
    expect(title).to_have_value("piece")  # nobody's words are taken from under their fingers
    title.press("Tab")
    expect(title).to_have_value("Swan")
    studio_page.wait_for_timeout(200)
    assert studio_server.project()["title"] == "Swan"


def test_a_posture_that_is_saved_again_is_pictured_again(studio_server: Served, studio_page: Any, expect: Any) -> None:
    def save(source: str) -> str:
        told = studio_server.post("/api/pose/open", {"key": source})
        pose = {"key": source, "rotations": told["rotations"], "root": told["root"]}
        key: str = studio_server.post("/api/pose/keep", {"pose": pose, "name": "mine"})["key"]
        studio_server.edit(edit="posture", name="mine", posture=key)
        return key

    picture = studio_page.get_by_test_id("posture-mine").locator("img")
    shown = "JSON.stringify(studio.viewer.motion.rotations)"
    before = ""
    for source in ("ballet/fifth", "ballet/arabesque"):
        key = save(source)
        expect(picture).to_have_attribute("src", f"/api/thumbnails/{key}/0.png?height=96")
        studio_page.get_by_test_id("posture-mine").click()
        expect(studio_page.locator(".caption .name")).to_have_text("mine")
        until(studio_page, f"(before) => {shown} !== before", before)
        before = studio_page.evaluate(shown)
        studio_page.evaluate("studio.desk.set('a', null)")  # which stays what it was: the new one would be B
    studio_page.reload()
    expect(picture).to_have_attribute("src", f"/api/thumbnails/{key}/0.png?height=96")


def test_what_is_edited_while_a_page_opens_is_seen_there(studio_server: Served, studio_page: Any, expect: Any) -> None:
    edited: list[Any] = []

    def late(route: Any) -> None:
        """The answer of before the edit, once the edit has been told of."""
        answer = route.fetch()
        if not edited:
            edited.append(studio_server.insert("b1", "ballet/adagio", 0, 20))
            studio_page.wait_for_timeout(1000)
        route.fulfill(response=answer)

    studio_page.route("**/api/project?*", late)
    studio_page.reload()
    expect(studio_page.get_by_test_id("block-b1")).to_be_visible()


@pytest.mark.parametrize("end", ["", "/#token=wrong"])
def test_a_browser_without_the_token_is_told_where_to_look(
    studio_server: Served, browser: Any, expect: Any, end: str
) -> None:
    context = browser.new_context()
    page = context.new_page()
    page.goto(studio_server.url + end)
    expect(page.get_by_test_id("toast").get_by_text("shown in the terminal")).to_be_visible()
    if not end:  # as a page that is still open when the studio is started again
        expect(page.get_by_test_id("offline")).to_contain_text("edits are not saved; open the studio at the address")
    page.goto(studio_server.entry)  # in the same tab: nothing but the end of the address is another
    expect(page.get_by_test_id("posture-arabesque")).to_be_visible()
    assert studio_server.keys.token not in page.url
    context.close()


def test_a_page_elsewhere_can_neither_read_nor_write(studio_server: Served, studio_page: Any) -> None:
    attack = """async (url) => {
      const tried = {};
      for (const [name, path, options] of [
        ["read", "/api/project", {}],
        ["form", "/api/edits", {method: "POST", body: '{"window": "w1", "edit": {"edit": "title", "title": "mine"}}'}],
        ["json", "/api/edits", {method: "POST", body: "{}", headers: {"X-MotionMind": "studio"}}],
      ]) {
        const asked = fetch(url + path, {credentials: "include", ...options});
        tried[name] = await asked.then((answer) => answer.status, () => "refused");
      }
      tried.stream = await new Promise((resolve) => {
        const stream = new EventSource(url + "/api/events", {withCredentials: true});
        stream.onopen = () => resolve("open");
        stream.onerror = () => resolve("refused");
      });
      tried.image = await new Promise((resolve) => {
        const image = new Image();
        image.onload = () => resolve("shown");
        image.onerror = () => resolve("refused");
        image.src = url + "/api/thumbnails/ballet/first/0.png";
      });
      return tried;
    }"""
    # Another port of this computer is another origin, but the same site: the cookie is sent.
    before = studio_server.project()
    elsewhere = ThreadingHTTPServer(("127.0.0.1", 0), Elsewhere)
    threading.Thread(target=elsewhere.serve_forever, daemon=True).start()
    try:
        page = beside(studio_page)
        page.goto(f"http://127.0.0.1:{elsewhere.server_address[1]}/")
        tried = page.evaluate(attack, studio_server.url)
    finally:
        elsewhere.shutdown()
        elsewhere.server_close()
    assert tried == dict.fromkeys(tried, "refused")
    assert len(tried) == 5
    assert studio_server.project() == before


def test_a_search_is_begun_again_by_the_studio_that_was_started_again(
    studio_server: Served, browser: Any, expect: Any
) -> None:
    studio = studio_server.studio

    def lose() -> None:
        """What a page sees of it: its stream ends, and its jobs are known no more."""
        studio.workers._jobs.clear()
        for stream in studio.events._streams:
            stream.end()

    context = browser.new_context(
        viewport={"width": 1024, "height": 768}, device_scale_factor=0.5, reduced_motion="reduce"
    )
    page, searches = context.new_page(), list[str]()
    page.on("request", lambda request: request.url.endswith("/api/between") and searches.append(request.url))
    page.goto(studio_server.entry)
    page.get_by_test_id("posture-arabesque").click()
    with page.expect_response("**/api/between"):
        page.get_by_test_id("posture-fifth").click()
    studio.workers._loop.call_soon_threadsafe(lose)
    with page.expect_response("**/api/between"):
        pass
    expect(page.get_by_test_id("alternatives")).to_have_attribute("data-state", "found", timeout=120_000)
    assert len(searches) == 2
    # Nobody was there when it was asked for: it is once somebody is.
    page.route("**/api/between", lambda route: route.abort())
    page.get_by_label("Exchange A and B").click()
    expect(page.get_by_test_id("alternatives")).to_contain_text("The studio does not answer")
    page.unroute("**/api/between")
    studio.workers._loop.call_soon_threadsafe(lose)
    expect(page.get_by_test_id("alternatives")).to_have_attribute("data-state", "found", timeout=120_000)
    # Whatever else is asked for says the same.
    page.route("**/api/export/*", lambda route: route.abort())
    page.get_by_test_id("open-take").click()
    page.get_by_test_id("export-project").click()
    expect(page.get_by_test_id("toast")).to_contain_text("The studio does not answer. Is it still running?")
    context.close()


@pytest.mark.parametrize("studio_page", [LARGE, SMALL, (820, 1180), (390, 844)], indirect=True)
def test_what_is_said_hides_no_track_and_no_button(studio_server: Served, studio_page: Any, expect: Any) -> None:
    page = studio_page
    studio_server.insert("b1", "ballet/adagio", 0, 20)
    expect(page.get_by_test_id("block-b1")).to_be_attached()
    for number in range(3):
        page.evaluate(f"studio.say('{'Something was not as it should have been, and so it is said. ' * 2}{number}')")
    said = page.get_by_test_id("toast")
    expect(said).to_have_count(3)
    for other in (".strip", ".bar", ".rail", ".panel", "[data-testid=transport]"):
        met = """(other, one) => {
          const [a, b] = [other, document.querySelector(one)].map((each) => each.getBoundingClientRect());
          return b.width > 0 && a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
        }"""
        assert not any(one.evaluate(met, other) for one in said.all()), other
