"""Files come whole and verified over networks that fail, or an error says why, and what has come is of use later."""

from __future__ import annotations

import hashlib
import http.client
import shutil
import socket
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import pytest
from file_server import Files, dripping, serving_files

from motionmind.errors import CorpusError
from motionmind.registry import download as downloads
from motionmind.registry.download import check_address, download, read_address

DATA = bytes(range(251)) * 4000  # several chunks


@pytest.fixture
def files(tmp_path: Path) -> Iterator[Files]:
    folder = tmp_path / "served"
    folder.mkdir()
    (folder / "file").write_bytes(DATA)
    with serving_files(folder) as served:
        yield served


class Place(NamedTuple):
    """Where a file is downloaded to, and where what has come of it is kept."""

    whole: Path
    part: Path

    def fetch(self, url: str, sha256: str = hashlib.sha256(DATA).hexdigest()) -> None:
        download(url, self.whole, len(DATA), sha256)


@pytest.fixture
def place(tmp_path: Path) -> Place:
    (tmp_path / "kept").mkdir()
    return Place(tmp_path / "kept" / "file", tmp_path / "kept" / "file.part")


def test_a_file_comes_whole_and_nothing_else_stays(files: Files, place: Place) -> None:
    place.fetch(f"{files.address}/file")
    assert place.whole.read_bytes() == DATA
    assert [*place.whole.parent.iterdir()] == [place.whole]


def test_a_connection_that_ends_early_is_gone_on_with(files: Files, place: Place) -> None:
    files.most = len(DATA) // 3
    place.fetch(f"{files.address}/file")
    assert place.whole.read_bytes() == DATA
    assert files.sent == len(DATA)


def test_what_has_come_is_kept_and_the_next_process_goes_on_from_it(files: Files, place: Place) -> None:
    files.most = 1000
    with pytest.raises(CorpusError, match=r"5,000 of 1,004,000 bytes have come.*fetch it again"):
        place.fetch(f"{files.address}/file")
    assert place.part.read_bytes() == DATA[:5000]
    files.most, files.sent = None, 0
    place.fetch(f"{files.address}/file")
    assert files.asked[-1] == ("/file", "bytes=5000-")
    assert files.sent == len(DATA) - 5000
    assert place.whole.read_bytes() == DATA


def test_ctrl_c_keeps_what_has_come(files: Files, place: Place) -> None:
    def press(here: int) -> None:
        if here > len(DATA) // 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        download(f"{files.address}/file", place.whole, len(DATA), "", press)
    kept = place.part.stat().st_size
    assert kept > len(DATA) // 2
    place.fetch(f"{files.address}/file")
    assert files.asked[-1] == ("/file", f"bytes={kept}-")
    assert place.whole.read_bytes() == DATA


def test_a_server_that_sends_no_parts_sends_the_whole(files: Files, place: Place) -> None:
    place.part.write_bytes(DATA[:5000])
    files.ranges = False
    place.fetch(f"{files.address}/file")
    assert place.whole.read_bytes() == DATA


@pytest.mark.parametrize("kept", [b"of another file", b"?" * len(DATA), b"?" * (len(DATA) + 1)])
def test_a_part_of_another_file_does_no_harm(files: Files, place: Place, kept: bytes) -> None:
    place.part.write_bytes(kept)
    place.fetch(f"{files.address}/file")
    assert place.whole.read_bytes() == DATA


def test_a_file_that_became_shorter_on_the_server_is_begun_anew(files: Files, place: Place) -> None:
    place.part.write_bytes(b"?" * 5000)
    (files.folder / "file").write_bytes(DATA[:100])
    with pytest.raises(CorpusError, match="100 of 1,004,000 bytes have come"):
        place.fetch(f"{files.address}/file")


def test_another_file_is_refused_and_not_kept(files: Files, place: Place) -> None:
    with pytest.raises(CorpusError, match="not the file that the index names: its SHA-256 is"):
        place.fetch(f"{files.address}/file", "0" * 64)
    assert [*place.whole.parent.iterdir()] == []


def test_no_more_is_kept_than_the_index_states(files: Files, place: Place) -> None:
    files.extra = b"!"
    with pytest.raises(CorpusError, match="larger than the 1,004,000 bytes"):
        place.fetch(f"{files.address}/file")
    assert place.part.stat().st_size == 0


def test_a_disk_that_is_too_small_is_said_beforehand(
    files: Files, place: Place, monkeypatch: pytest.MonkeyPatch
) -> None:
    usage = shutil.disk_usage(place.whole.parent)._replace(free=1000)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage)
    with pytest.raises(CorpusError, match="the disk is too small: 1,004,000 bytes are needed, and 1,000 are free"):
        place.fetch(f"{files.address}/file")
    assert files.asked == []


def test_redirections_are_followed(files: Files, place: Place) -> None:
    files.redirections["/old"] = f"{files.address}/file"
    place.part.write_bytes(DATA[:10])
    place.fetch(f"{files.address}/old")
    assert place.whole.read_bytes() == DATA
    assert files.asked == [("/old", "bytes=10-"), ("/file", "bytes=10-")]


@pytest.mark.parametrize("to", ["http://example.org/file", "ftp://127.0.0.1/file", "file:///etc/passwd"])
def test_redirections_lead_nowhere_else(files: Files, place: Place, to: str) -> None:
    files.redirections["/old"] = to
    with pytest.raises(CorpusError, match=r"addresses begin with https://|Redirection to url .* is not allowed"):
        place.fetch(f"{files.address}/old")
    assert not place.whole.exists()


def test_redirections_end(files: Files, place: Place) -> None:
    files.redirections["/old"] = f"{files.address}/old"
    with pytest.raises(CorpusError, match="302"):
        place.fetch(f"{files.address}/old")
    assert len(files.asked) < 10


def test_what_is_not_there_is_named(files: Files, place: Place) -> None:
    with pytest.raises(CorpusError, match="/none: cannot be fetched: the server answers 404 Not Found"):
        place.fetch(f"{files.address}/none")
    with pytest.raises(CorpusError, match="/none: cannot be reached: the server answers 404 Not Found"):
        read_address(f"{files.address}/none", 1000)


def test_no_network_is_said_at_once_and_what_has_come_stays(place: Place) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        nobody = f"http://127.0.0.1:{taken.getsockname()[1]}/file"
    place.part.write_bytes(DATA[:10])
    with pytest.raises(CorpusError, match=r"10 of 1,004,000 bytes have come: .*refused"):
        place.fetch(nobody)
    assert place.part.read_bytes() == DATA[:10]
    with pytest.raises(CorpusError, match=r"cannot be reached: .*refused"):
        read_address(nobody, 1000)


@pytest.fixture
def hasty(monkeypatch: pytest.MonkeyPatch) -> None:
    """Limit all time to 0.3 s."""
    monkeypatch.setattr(downloads, "_TIMEOUT_S", 0.3)
    monkeypatch.setattr(downloads, "_INDEX_TIMEOUT_S", 0.3)


def test_a_server_that_says_nothing_is_not_waited_for(place: Place, hasty: None) -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:
        url = f"http://127.0.0.1:{silent.getsockname()[1]}/file"
        with pytest.raises(CorpusError, match=r"0 of 1,004,000 bytes have come: less than 1 kB/s came for 0\.3 s"):
            place.fetch(url)
        with pytest.raises(CorpusError, match=r"cannot be reached: it took longer than 0\.3 s"):
            read_address(url, 1000)


HEAD = b"HTTP/1.1 200 OK\r\n"
CHUNKED = HEAD + b"Transfer-Encoding: chunked\r\n\r\n"
DRIPS = {
    "the status": (b"HTTP/1.1 200 ", b"O", 0.02),
    "a header": (HEAD + b"Server: ", b"x", 0.02),
    "headers": (HEAD, b"A: b\r\n", 0.02),
    "answers before the answer": (b"", 1000 * b"HTTP/1.1 100 Continue\r\n\r\n", 0.0),
    "the length of a chunk": (CHUNKED, b"0", 0.02),
    "chunks": (CHUNKED, b"1\r\nx\r\n", 0.02),
    "what follows chunks": (CHUNKED + b"1\r\nx\r\n0\r\n", b"A: b\r\n", 0.02),
    "the file": (HEAD + b"Content-Length: 1004000\r\n\r\n", b"x", 0.02),
}


@pytest.mark.parametrize("what", DRIPS)
def test_a_server_that_drips_for_ever_is_left(what: str, place: Place, hasty: None) -> None:
    with dripping(*DRIPS[what]) as url:
        with pytest.raises(CorpusError, match=r"bytes have come: less than 1 kB/s came"):
            place.fetch(url)
        with pytest.raises(CorpusError, match=r"cannot be reached: it took longer"):
            read_address(url, 10**6)
    assert not place.whole.exists()


def test_a_redirection_without_end_is_followed_at_once(place: Place) -> None:
    with (
        dripping(HEAD + b"Content-Length: 9\r\n\r\n", b"all of it") as there,
        dripping(b"HTTP/1.1 302 Found\r\nLocation: " + there.encode() + b"\r\n\r\n", bytes(10**6), 0.0) as url,
    ):
        assert read_address(url, 9) == (b"all of it", there)


@pytest.mark.parametrize(("rate", "lasts"), [(0.0, 30.0), (500.0, 60.0), (900.0, 300.0), (1001.0, None), (1e6, None)])
def test_a_download_lasts_as_long_as_its_rate_is_high(
    rate: float, lasts: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = 1000.0
    monkeypatch.setattr(downloads, "monotonic", lambda: now)
    deadline = downloads._Deadline(30.0, "slow")
    for quick in (0.0, 3600.0):  # an hour at 1 MB/s buys no more time afterwards
        now += quick
        deadline.postpone(int(quick * 1e6))
    begun = now
    with suppress(TimeoutError):
        while now - begun < 3600.0:
            now += 0.5
            deadline.left()
            deadline.postpone(int(rate * 0.5))
    assert now - begun == pytest.approx(3600.0 if lasts is None else lasts, rel=0.05)


def test_another_part_than_was_asked_for_is_not_taken(
    files: Files, place: Place, monkeypatch: pytest.MonkeyPatch
) -> None:
    place.part.write_bytes(DATA[:10])
    real = http.client.HTTPMessage.get
    monkeypatch.setattr(
        http.client.HTTPMessage,
        "get",
        lambda self, name, other=None: "bytes 20-30/40" if name == "Content-Range" else real(self, name, other),
    )
    with pytest.raises(CorpusError, match="another part of the file"):
        place.fetch(f"{files.address}/file")
    assert place.part.read_bytes() == DATA[:10]


def test_small_files_are_read_whole_and_up_to_a_limit(files: Files) -> None:
    assert read_address(f"{files.address}/file", len(DATA)) == (DATA, f"{files.address}/file")
    with pytest.raises(CorpusError, match="is larger than"):
        read_address(f"{files.address}/file", len(DATA) - 1)
    files.most = 1000
    with pytest.raises(CorpusError, match="1,003,000 bytes early"):
        read_address(f"{files.address}/file", len(DATA))


@pytest.mark.parametrize(
    "url", ["https://example.org/a", "https://127.0.0.1/a", "http://localhost:80/a", "http://[::1]"]
)
def test_addresses_that_may_be_asked(url: str) -> None:
    check_address(url)


@pytest.mark.parametrize(
    ("url", "message"),
    [
        ("http://example.org/a", "begin with https"),
        ("http://127.0.0.1.example.org/a", "begin with https"),
        ("http://localhost.example.org/a", "begin with https"),
        ("file:///etc/passwd", "begin with https"),
        ("ftp://example.org/a", "begin with https"),
        ("https://", "begin with https"),
        ("https:///a", "begin with https"),
        ("https://a:b@example.org/", "remove the user name and password"),
        ("https://example.org:99999/", "is not an address"),
        ("https://[::1/", "is not an address"),
    ],
)
def test_addresses_that_may_not_be_asked(url: str, message: str) -> None:
    with pytest.raises(CorpusError, match=message):
        check_address(url)


@pytest.mark.parametrize("url", ["http://127.0.0.1/a", "https://localhost/a", "https://[::1]/a"])
def test_what_others_publish_names_nothing_on_this_machine(url: str) -> None:
    check_address(url, "http://127.0.0.1:80/index.json")
    with pytest.raises(CorpusError, match="is on this machine"):
        check_address(url, "https://example.org/index.json")


@pytest.mark.parametrize("url", ["http://127.0.0.1:1/\n", "http://127.0.0.1:1/é", "http://127.0.0.1:1/ a"])
def test_addresses_that_http_cannot_say_are_errors_too(url: str, place: Place) -> None:
    with pytest.raises(CorpusError):
        read_address(url, 10)
    with pytest.raises(CorpusError):
        place.fetch(url)
