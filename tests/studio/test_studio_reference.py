"""The reference video: which files are shown, to whom, and how well it keeps in step with the playhead."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pages import RESTING, Tabs
from piece_page import until, wait_for
from starlette.requests import Request
from studio_server import LARGE, SMALL, Client, Served

from motionmind.errors import MotionMindError
from motionmind.studio.local_files import is_here
from motionmind.studio.project import Project
from motionmind.studio.reference import find_video

FPS, N_FRAMES, WIDTH, HEIGHT = 25, 300, 160, 96
FRAME_S = 1.0 / FPS
# The number of the frame in view, which is written in it as ten columns, black or white.
_NUMBER = f"""(() => {{
  const pen = new OffscreenCanvas({WIDTH}, {HEIGHT}).getContext('2d', {{ willReadFrequently: true }});
  pen.drawImage(document.querySelector('video'), 0, 0, {WIDTH}, {HEIGHT});
  let number = 0;
  for (let bit = 0; bit < 10; bit++) number |= (pen.getImageData(bit * 16 + 8, 48, 1, 1).data[1] > 128) << bit;
  return number;
}})()"""
# While the piece plays, [seconds since the start, how far the video's clock is ahead of the playhead] for each picture
# of the body, and the same of the frame in view for each frame of the video, when the playhead may have yet to follow.
_DRIFTS = """([begins, seconds]) => new Promise((done) => {
  const video = document.querySelector('video'), { player } = studio.viewer, begun = performance.now();
  const clocks = [], frames = [];
  let latest = begun;
  const since = () => (performance.now() - begun) / 1000;
  const step = () => {
    latest = performance.now();
    clocks.push([since(), video.currentTime - player.time - begins]);
  };
  player.addEventListener('change', step);
  video.requestVideoFrameCallback(function look(_, { mediaTime }) {
    const due = player.time + begins + player.speed * (performance.now() - latest) / 1000;
    frames.push([since(), mediaTime - due]);
    if (since() < seconds) video.requestVideoFrameCallback(look);
  });
  setTimeout(() => {
    player.removeEventListener('change', step);
    done([clocks, frames]);
  }, 1000 * seconds);
})"""


@pytest.fixture(scope="session")
def video(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A WebM file whose frames say their numbers."""
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    path = tmp_path_factory.mktemp("video") / "dance.webm"
    options = ["-g", "25", "-deadline", "realtime", "-b:v", "400k"]
    writer = ffmpeg.write_frames(
        str(path), (WIDTH, HEIGHT), fps=FPS, codec="libvpx", macro_block_size=16, output_params=options
    )
    writer.send(None)
    for number in range(N_FRAMES):
        bits = [255 * (number >> bit & 1) for bit in range(10)]
        row = np.repeat(np.array(bits, dtype=np.uint8), 16)
        writer.send(np.ascontiguousarray(np.broadcast_to(row[None, :, None], (HEIGHT, WIDTH, 3))))
    writer.close()
    return path


def choose(server: Client, path: object) -> Any:
    return server.post("/api/reference", {"window": "w1", "path": str(path)})


# --- the file -------------------------------------------------------------------------------------------------------


def test_a_video_is_kept_by_its_path_and_undone(studio_server: Served, video: Path, tmp_path: Path) -> None:
    assert studio_server.project()["reference"] == {"path": "", "begins": 0.0}
    assert choose(studio_server, video)["reference"] == {"path": str(video), "begins": 0.0}
    studio_server.edit(edit="reference", path=str(video), begins=1.25)
    assert studio_server.project()["undo"] == "change the reference video"
    studio_server.studio.project.close()
    again = Project.open(studio_server.studio.project.path)
    assert (again.state.reference.path, again.state.reference.begins) == (str(video), 1.25)
    again.undo("w9")
    assert again.state.reference.begins == 0.0
    again.close()


def test_what_is_no_video_is_refused_in_a_line(studio_server: Served, tmp_path: Path) -> None:
    (tmp_path / "secret.txt").write_text("hunter2, hunter2, hunter2")
    (tmp_path / "short.webm").write_bytes(b"\x1a\x45")
    (tmp_path / "closed.webm").write_bytes(b"\x1a\x45\xdf\xa3")
    (tmp_path / "closed.webm").chmod(0)
    cases = {
        tmp_path / "missing.webm": "no such file",
        tmp_path / "secret.txt": "is not a video that browsers play: WebM, MP4, MOV or Ogg",
        tmp_path / "short.webm": "is not a video that browsers play",
        tmp_path: "is not a file",
        "dance.webm": "needs its whole path",
        "~nobody-of-this-name/dance.webm": "",
        "a\0b": "",
        "/dev/zero": "is not a file",
        "": "needs its whole path",
    }
    if os.name == "posix" and os.geteuid() != 0:
        cases[tmp_path / "closed.webm"] = "permission denied"
    before = studio_server.project()["sequence"]
    for path, words in cases.items():
        answer = studio_server.send("POST", "/api/reference", {"window": "w1", "path": str(path)})
        assert answer.status == 400, path
        assert words in answer.value["error"]
        assert "\n" not in answer.value["error"]
    assert studio_server.project()["sequence"] == before
    # Nor is it shown if it takes a video's place.
    (tmp_path / "replaced.webm").write_bytes(b"\x1a\x45\xdf\xa3" + b"rest" * 10)
    choose(studio_server, tmp_path / "replaced.webm")
    (tmp_path / "secret.txt").replace(tmp_path / "replaced.webm")
    for headers in ({}, {"Range": "bytes=0-"}):
        answer = studio_server.send("GET", "/api/reference", **headers)
        assert answer.status == 404
        assert b"hunter2" not in answer.body
    studio_server.edit(edit="reference")
    assert studio_server.send("GET", "/api/reference").status == 404


def test_an_edit_shifts_or_removes_the_video_and_names_no_other_file(studio_server: Served, tmp_path: Path) -> None:
    first, second = tmp_path / "first.webm", tmp_path / "second.webm"
    for file in (first, second):
        file.write_bytes(b"\x1a\x45\xdf\xa3" + b"rest" * 10)

    def status(*paths: object, begins: float = 0.0) -> int:
        edits = [{"edit": "reference", "path": str(path), "begins": begins} for path in paths]
        edit = edits[0] if len(edits) == 1 else {"edit": "several", "edits": edits}
        return int(studio_server.send("POST", "/api/edits", {"window": "w1", "edit": edit}).status)

    assert status(first) == 409
    choose(studio_server, first)
    before = studio_server.project()["sequence"]
    assert (status(second), status("", second), status(first, second), status("/etc/passwd")) == (409,) * 4
    assert studio_server.project()["sequence"] == before
    assert status(first, begins=2.5) == 200
    assert studio_server.project()["reference"] == {"path": str(first), "begins": 2.5}
    assert (status(""), status(first)) == (200, 409)
    assert studio_server.post("/api/undo", {"window": "w1"})["reference"]["path"] == str(first)


@pytest.mark.parametrize(
    ("head", "kind"),
    [(b"\x1a\x45\xdf\xa3", "video/webm"), (b"\0\0\0\x20ftypisom", "video/mp4"), (b"OggS\0", "video/ogg")],
)
def test_a_file_is_known_by_its_beginning(tmp_path: Path, head: bytes, kind: str) -> None:
    file = tmp_path / "any.name"
    file.write_bytes(head + b"rest" * 10)
    assert find_video(str(file)) == (file, kind, len(head) + 40)
    file.write_bytes(b"x" + head)
    with pytest.raises(MotionMindError, match="is not a video"):
        find_video(str(file))


def test_ranges_are_answered_part_by_part(studio_server: Served, tmp_path: Path) -> None:
    data = b"\x1a\x45\xdf\xa3" + np.random.default_rng(0).bytes(2_500_000)
    (tmp_path / "long.webm").write_bytes(data)
    choose(studio_server, tmp_path / "long.webm")

    def part(wanted: str) -> tuple[int, str, bytes]:
        answer = studio_server.send("GET", "/api/reference", Range=wanted)
        return answer.status, answer.headers.get("content-range", ""), answer.body

    size, most = len(data), 2**20
    assert part("bytes=0-3") == (206, f"bytes 0-3/{size}", data[:4])
    assert part("bytes=0-") == (206, f"bytes 0-{most - 1}/{size}", data[:most])
    assert part(f"bytes={size - 10}-") == (206, f"bytes {size - 10}-{size - 1}/{size}", data[-10:])
    assert part(f"bytes={size - 10}-{size + 99}") == (206, f"bytes {size - 10}-{size - 1}/{size}", data[-10:])
    assert part("bytes=-7") == (206, f"bytes {size - 7}-{size - 1}/{size}", data[-7:])
    for wanted in (f"bytes={size}-", "bytes=9-3", "bytes=-0", "bytes=-", "lines=0-3", "bytes=0-1,5-6", "bytes=a-"):
        assert part(wanted)[:2] == (416, f"bytes */{size}")
    got, begin = b"", 0
    while begin < size:
        body = part(f"bytes={begin}-")[2]
        got, begin = got + body, begin + len(body)
    assert got == data
    whole = studio_server.send("GET", "/api/reference")
    assert (whole.status, whole.body) == (200, data)
    assert whole.headers["content-type"] == "video/webm"
    assert studio_server.send("GET", "/api/reference", Cookie=None).status == 401


@pytest.mark.parametrize(
    ("client", "server", "here"),
    [
        ("127.0.0.1", "127.0.0.1", True),
        ("::1", "::1", True),
        ("192.168.1.5", "192.168.1.5", True),
        ("192.168.1.9", "192.168.1.5", False),
        ("192.168.1.9", "127.0.0.1", False),
    ],
)
def test_only_this_computer_is_shown_a_video(client: str, server: str, here: bool) -> None:
    scope = {"type": "http", "client": (client, 5), "server": (server, 6)}
    assert is_here(Request(scope)) is here
    assert not is_here(Request({"type": "http", "client": None, "server": None}))


# --- the page -------------------------------------------------------------------------------------------------------


@pytest.fixture
def open_page(studio_server: Served, tabs: Tabs) -> Iterator[Callable[..., Any]]:
    """Open a piece of eight seconds, of a size."""

    def enter(size: tuple[int, int] = LARGE) -> Any:
        studio_server.insert("b1", "ballet/adagio", 0, 20)
        using = tabs.tab({}, viewport={"width": size[0], "height": size[1]}, **RESTING)
        page = opened.enter_context(using)
        page.goto(studio_server.entry)
        wait_for(page, "studio.viewer.piece?.length > 1")
        return page

    with ExitStack() as opened:
        yield enter


def ready(page: Any) -> None:
    until(page, "document.querySelector('video')?.readyState >= 2 && !document.querySelector('video').seeking")


def shown_at(page: Any, time: float) -> int:
    """Seek the piece to a time; return the number of the video's frame."""
    page.evaluate("(time) => studio.viewer.player.seek(time)", time)
    ready(page)
    page.wait_for_timeout(120)
    ready(page)
    return int(page.evaluate(_NUMBER))


@pytest.mark.long
@pytest.mark.parametrize("size", [LARGE, SMALL], ids=["large", "small"])
def test_a_video_is_chosen_and_shifted_by_mouse_and_scrubs_with_the_piece(
    open_page: Callable[..., Any], video: Path, size: tuple[int, int], axe_faults: Callable[[Any], list[str]]
) -> None:
    page = open_page(size)
    page.get_by_test_id("reference-toggle").click()
    assert axe_faults(page) == []
    page.get_by_test_id("reference-path").fill(str(video.with_name("missing.webm")))
    page.get_by_test_id("reference-open").click()
    page.get_by_test_id("toast").get_by_text("no such file").wait_for()
    page.wait_for_timeout(400)  # a further click so soon would be a double click
    page.get_by_test_id("reference-path").fill(str(video))
    page.get_by_test_id("reference-open").click()
    ready(page)
    assert axe_faults(page) == []
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    for time in (0.0, 0.1, 1.02, 4.5, 2.3, 8.0):
        assert abs(shown_at(page, time) - int(time * FPS + 1e-6)) <= 1, time
    # To drag it to the right by 100 pixels shows what is a second later.
    page.evaluate("studio.viewer.player.seek(2.02)")
    box = page.get_by_test_id("reference-shift").bounding_box()
    x, y = box["x"] + 40, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 100, y, steps=5)
    assert page.evaluate("studio.store.state.reference.begins") == 0.0
    page.mouse.up()
    wait_for(page, "studio.store.state.reference.begins === 1", 5.0)
    assert abs(shown_at(page, 2.02) - 75) <= 1
    # Dragging the slider scrubs both.
    scrub = page.get_by_test_id("scrub").bounding_box()
    page.mouse.click(scrub["x"] + 0.5 * scrub["width"], scrub["y"] + scrub["height"] / 2)
    now = page.evaluate("studio.viewer.player.time")
    assert abs(shown_at(page, now) - int((now + 1.0) * FPS)) <= 1
    page.get_by_test_id("undo").click()
    wait_for(page, "studio.store.state.reference.begins === 0", 5.0)
    assert abs(shown_at(page, 2.02) - 50) <= 1
    page.reload()  # the project has the path
    ready(page)
    page.get_by_test_id("reference-remove").click()
    wait_for(page, "studio.store.state.reference.path === ''", 5.0)
    assert page.locator("video").count() == 0


@pytest.mark.long
def test_a_video_is_chosen_and_shifted_by_keys_alone(open_page: Callable[..., Any], video: Path) -> None:
    page = open_page()
    press = page.keyboard.press
    press("v")
    page.get_by_test_id("reference-path").focus()
    page.keyboard.type(str(video))
    press("Enter")
    ready(page)
    page.get_by_test_id("reference-shift").focus()
    page.evaluate("studio.viewer.player.seek(2.02)")
    for key in ("PageUp", "ArrowRight", "ArrowRight", "ArrowLeft"):
        press(key)
    wait_for(page, "studio.store.state.reference.begins === 1.04", 5.0)
    assert page.evaluate("studio.viewer.player.time") == 2.02
    assert "starts at 1.04 s" in page.get_by_test_id("reference-shift").get_attribute("aria-valuetext")
    assert abs(shown_at(page, 2.02) - 76) <= 1
    press("Tab")
    press("Control+a")
    page.keyboard.type("-1.5")
    press("Enter")
    wait_for(page, "studio.store.state.reference.begins === -1.5", 5.0)
    assert shown_at(page, 0.5) == 0  # before its beginning, its first frame
    assert abs(shown_at(page, 3.52) - 50) <= 1


@pytest.mark.long
def test_a_file_of_this_computer_is_shown_and_not_sent(open_page: Callable[..., Any], video: Path) -> None:
    page, sent = open_page(), list[str]()
    page.on("request", lambda request: sent.append(f"{request.method} {request.url}"))
    press = page.keyboard.press
    press("v")
    page.get_by_test_id("reference-file").set_input_files(video)
    ready(page)
    assert abs(shown_at(page, 3.02) - 75) <= 1
    page.get_by_test_id("reference-begins").fill("1")
    press("Enter")
    assert abs(shown_at(page, 3.02) - 100) <= 1
    press("v")
    page.evaluate("document.activeElement.blur()")
    press("v")
    press("v")  # hidden, it keeps its file
    assert not any("POST" in one or "/api/reference" in one for one in sent)


@pytest.mark.long
def test_a_file_that_browsers_cannot_play_is_told_of_in_a_line(
    open_page: Callable[..., Any], studio_server: Served, tmp_path: Path, video: Path
) -> None:
    page = open_page()
    broken = tmp_path / "broken.webm"
    broken.write_bytes(b"\x1a\x45\xdf\xa3" + b"x" * 5000)
    choose(studio_server, broken)
    fault = page.get_by_test_id("reference-fault")
    fault.get_by_text("This browser cannot play broken.webm").wait_for()
    moved = tmp_path / "moved.webm"
    moved.write_bytes(video.read_bytes())
    choose(studio_server, moved)
    fault.wait_for(state="detached")
    ready(page)
    moved.unlink()
    page.reload()
    fault.get_by_text("moved.webm: no such file").wait_for()
    choose(studio_server, video)  # as the field beside the message does
    fault.wait_for(state="detached")
    ready(page)


@pytest.mark.long
def test_a_video_plays_in_step(open_page: Callable[..., Any], studio_server: Served, video: Path) -> None:
    page = open_page()
    choose(studio_server, video)
    studio_server.edit(edit="reference", path=str(video), begins=1.0)
    wait_for(page, "studio.store.state.reference.begins === 1", 5.0)
    ready(page)
    for speed in (1, 0.5):
        page.evaluate(f"studio.viewer.player.seek(0), studio.viewer.player.speed = {speed}")
        page.evaluate("studio.viewer.player.play()")
        clocks, frames = (np.array(found) for found in page.evaluate(_DRIFTS, [1.0, 5.0]))
        page.evaluate("studio.viewer.player.pause()")
        for found, most in ((clocks, FRAME_S), (frames, 2 * FRAME_S)):
            settled = np.abs(found[found[:, 0] > 1.0, 1])
            assert len(settled) > 10
            assert np.median(settled) < most, speed
    # A drift, as of a computer that had no time for the video, is made up for without a jump.
    page.evaluate("studio.viewer.player.seek(1), studio.viewer.player.speed = 1, studio.viewer.player.play()")
    page.wait_for_timeout(1000)
    page.evaluate("document.querySelector('video').currentTime -= 0.15")
    clocks, _ = (np.array(found) for found in page.evaluate(_DRIFTS, [1.0, 3.5]))
    page.evaluate("studio.viewer.player.pause()")
    late = clocks[clocks[:, 0] < 0.3, 1]
    assert late.min() < -0.08
    assert np.median(np.abs(clocks[clocks[:, 0] > 2.0, 1])) < FRAME_S
    # A jump of the playhead is followed at once.
    page.evaluate("studio.viewer.player.seek(1), studio.viewer.player.play()")
    page.wait_for_timeout(500)
    page.evaluate("studio.viewer.player.seek(6)")
    drift = "document.querySelector('video').currentTime - studio.viewer.player.time - 1"
    until(page, f"Math.abs({drift}) < {2 * FRAME_S}", None, 2.0)
    page.evaluate("studio.viewer.player.pause()")
    # The piece loops: the video begins again, too.
    page.evaluate("studio.viewer.player.seek(studio.viewer.player.motion.end - 0.3), studio.viewer.player.speed = 1")
    page.evaluate("studio.viewer.player.play()")
    until(page, "studio.viewer.player.time < 4 && studio.viewer.player.time > 1.2")
    assert abs(page.evaluate(drift)) < 2 * FRAME_S
