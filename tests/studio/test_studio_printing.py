"""Sheets to print: which postures are on them, their captions and notes, and the files."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bundled_clips import ballet_clip
from hypothesis import given
from hypothesis import strategies as st
from piece_page import LONG, until
from PIL import Image
from studio_server import Served

from motionmind.errors import MotionMindError
from motionmind.render.lettering import font
from motionmind.render.print_sheet import (
    NOTE_LETTERS_PX,
    PAGE_HEIGHT_PX,
    PAGE_WIDTH_PX,
    PrintPosture,
    _wrapped,
    print_pages,
    print_picture,
)
from motionmind.render.sheet import tiles
from motionmind.studio import printing
from motionmind.studio.printing import Spacing, postures_at
from motionmind.studio.settings import SetMusic


def note(kind: str, text: str, at: float, author: str = "") -> dict[str, Any]:
    return {"kind": kind, "text": text, "at": at, "author": author}


@given(
    st.floats(0.0, 30.0),
    st.sampled_from([Spacing(1.0), Spacing(4.0, tempo=97.0), Spacing(0.5, "seconds"), Spacing(3.0, "seconds")]),
    st.lists(st.tuples(st.sampled_from(["note", "marker", "section"]), st.floats(0.0, 1.0)), max_size=6),
)
def test_every_note_is_on_the_sheet_once_and_sections_begin_with_a_posture(seconds, spacing, places):
    notes = [note(kind, f"text {i}", share * seconds) for i, (kind, share) in enumerate(places)]
    notes.sort(key=lambda one: one["at"])
    found = postures_at(spacing, seconds, notes)
    times = np.array([*found])
    assert (np.diff(times) > 0.0).all()
    assert times[0] == 0.0
    assert times[-1] <= seconds
    for number in range(int(seconds / spacing.seconds)):
        assert np.abs(times - number * spacing.seconds).min() < 1e-9
    texts = [text for one in found.values() for text in one.notes]
    assert sorted(texts) == sorted(one["text"] for one in notes if one["kind"] != "section")
    for one in notes:
        if one["kind"] == "section":
            assert np.abs(times - one["at"]).min() <= 1.1e-3
        else:
            before = max(time for time in found if time <= one["at"] + 1.1e-3)
            assert one["text"] in found[before].notes


def test_captions_count_the_phrases_of_the_project(studio_server: Served, monkeypatch: pytest.MonkeyPatch) -> None:
    printed: list[PrintPosture] = []
    monkeypatch.setattr(printing, "print_pages", lambda pictures, postures, title: printed.extend(postures) or [])
    monkeypatch.setattr(printing, "pdf", lambda *_: b"")
    studio_server.insert("b1", "ballet/adagio", 0, 20)
    studio_server.edit(edit="tempo", tempo=120, counts=3)
    assert studio_server.send("GET", "/api/sheet/pdf").status == 200
    assert [one.count for one in printed[:4]] == ["1·1", "1·2", "1·3", "2·1"]


def test_captions_count_eights():
    spacing = Spacing(1.0, tempo=120.0)
    found = [one.count for one in postures_at(spacing, 8.5, []).values()]
    assert found == [f"{eight}·{count}" for eight in (1, 2) for count in range(1, 9)] + ["3·1", "3·2"]
    assert {one.count for one in postures_at(Spacing(1.0, "seconds"), 3.0, []).values()} == {""}


def test_postures_at_counts_follow_the_beats_of_music():
    music = SetMusic("/song.wav", 0.9, (0.5, 1.0, 1.6, 2.3, 3.1), first=1)
    found = postures_at(Spacing(1.0), 3.8, [], music)
    assert [*found] == pytest.approx([0.0, 0.1, 0.7, 1.4, 2.2, 3.0, 3.8])
    assert [one.count for one in found.values()] == ["0·8", *(f"1·{count}" for count in range(1, 7))]
    assert [*postures_at(Spacing(2.0), 3.8, [], music)] == pytest.approx([0.0, 0.1, 1.4, 3.0])
    assert [*postures_at(Spacing(1.0, "seconds"), 3.8, [], music)] == [0.0, 1.0, 2.0, 3.0]


def test_too_many_postures_are_refused():
    with pytest.raises(MotionMindError, match="400 postures, not 601: put them farther apart"):
        postures_at(Spacing(1.0, "seconds"), 600.0, [])


@given(st.text(max_size=60), st.integers(60, 300))
def test_wrapping_keeps_every_letter_and_the_width(text, width):
    lines = _wrapped(text, width)
    assert "".join("".join(lines).split()) == "".join(text.split())
    assert all(font(NOTE_LETTERS_PX).getlength(line) <= width or len(line) == 1 for line in lines)


def test_pages_hold_all_postures_and_have_a_size():
    motion = ballet_clip("adagio").slice(0, 30)
    plain = [PrintPosture(f"{number}", "") for number in range(30)]
    pages = print_pages(tiles(motion), plain, "Evening")
    assert {page.size for page in pages} == {(PAGE_WIDTH_PX, PAGE_HEIGHT_PX)}
    sectioned = [PrintPosture("", "", "part" if number % 4 == 0 else "") for number in range(30)]
    shortest = print_picture(tiles(motion), plain, "").height
    assert print_picture(tiles(motion), sectioned, "").height > shortest  # each begins a row
    noted = [PrintPosture("", "", "", ("word " * 50,)) for number in range(30)]
    assert print_picture(tiles(motion), noted, "").height > shortest


def test_sheets_are_files_that_others_open(studio_server: Served, tmp_path: Path) -> None:
    studio_server.insert("b1", "ballet/adagio", 0, 20)
    studio_server.edit(edit="title", title="Evening: 1/2")
    for name, text in (("section", "Adagio"), ("note", "breathe")):
        written = {"id": name, "kind": name, "text": text, "block": "b1", "frame": 3}
        studio_server.edit(edit="note", note=written)
    answer = studio_server.send("GET", "/api/sheet/pdf?every=2&unit=counts&tempo=100")
    assert answer.status == 200
    assert answer.headers["content-type"] == "application/pdf"
    assert answer.headers["content-disposition"].endswith("Evening-%201-2.pdf")
    assert answer.body.startswith(b"%PDF")
    assert answer.body.count(b"/MediaBox [ 0 0 841.8 595.2 ]") >= 1  # A4, in points
    answer = studio_server.send("GET", "/api/sheet/png?every=1&unit=seconds")
    assert Image.open(BytesIO(answer.body)).width == PAGE_WIDTH_PX


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("pdf?every=0", "every"),
        ("pdf?every=nan", "every"),
        ("pdf?tempo=fast", "tempo"),
        ("pdf?unit=bars", "unit"),
        ("pdf?colour=red", "colour"),
        ("svg", "as pdf or png"),
        ("pdf?every=0.05&unit=seconds", "put them farther apart"),
    ],
)
def test_sheets_are_refused_in_words(studio_server: Served, path: str, words: str) -> None:
    assert studio_server.send("GET", "/api/sheet/pdf").value["error"] in (
        "the piece is empty: nothing to export",
        "cannot print",
    )
    studio_server.insert("b1", "ballet/adagio", 0, 60)
    answer = studio_server.send("GET", f"/api/sheet/{path}")
    assert answer.status == 400
    assert words in answer.value["error"]


@pytest.mark.long
def test_a_sheet_is_saved_by_keys_and_by_mouse(studio_server: Served, studio_page: Any) -> None:
    studio_server.insert("b1", "ballet/adagio", 0, 6)
    until(studio_page, "studio.viewer.piece?.end > 0")
    studio_page.get_by_test_id("open-take").click()
    studio_page.get_by_test_id("sheet-spacing").select_option("1 seconds")
    with studio_page.expect_download(timeout=LONG) as download:
        studio_page.get_by_test_id("sheet-pdf").click()
    assert download.value.suggested_filename == "piece.pdf"
    studio_page.get_by_test_id("sheet-png").focus()
    with studio_page.expect_download(timeout=LONG) as download:
        studio_page.keyboard.press("Enter")
    assert download.value.suggested_filename == "piece.png"
