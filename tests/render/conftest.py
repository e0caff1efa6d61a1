"""What tests of pages share."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from pages import SIZE, Opened, Tabs

from motionmind.body.motion import Motion
from motionmind.ensemble.dancers import Ensemble
from motionmind.music import Sound
from motionmind.render.group_page import write_group_page
from motionmind.render.page import write_page


@pytest.fixture
def show(tabs: Tabs, tmp_path: Path) -> Iterator[Callable[..., Opened]]:
    """A function that opens a page; afterwards, that it neither complained nor asked for anything."""
    opened: list[Opened] = []

    def show(
        motion: Motion | Ensemble,
        ready: str = "window.motionmind",
        script: str = "",
        sound: Sound | None = None,
        stage: tuple[float, float] | None = None,
        **options: Any,
    ) -> Opened:
        path = tmp_path / f"{len(opened)}.html"
        if isinstance(motion, Ensemble):
            write_group_page(path, motion, sound=sound)
        else:
            write_page(path, motion, sound=sound, stage=stage)
        # Few pixels: drawing in software is most of a test's time. Tests that measure pictures ask for all of them.
        usual = {"viewport": SIZE, "reduced_motion": "reduce", "device_scale_factor": 0.5}
        said: list[str] = []
        asked: list[str] = []
        hearing = {
            "console": lambda message: said.append(message.text),
            "pageerror": lambda error: said.append(str(error)),
            "request": lambda request: asked.append(request.url),
        }
        tab = Opened(using.enter_context(tabs.tab(hearing, script=script, **(usual | options))), said, asked)
        opened.append(tab)
        tab.page.goto(path.as_uri())
        tab.wait(ready)
        return tab

    with ExitStack() as using:
        yield show
    for tab in opened:
        assert [line for line in tab.said if not re.search("GPU stall|WebGL context could not", line)] == []
        assert [url for url in tab.asked if not url.startswith(("data:", "file:"))] == []
        assert len([url for url in tab.asked if url.startswith("file:")]) == 1
