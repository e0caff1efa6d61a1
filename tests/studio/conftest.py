"""A studio that listens, and requests to it."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from pages import RESTING

_IS_HERE = find_spec("starlette") is not None and find_spec("uvicorn") is not None
collect_ignore_glob = [] if _IS_HERE else ["test_studio_*.py"]  # the extra studio

_AXE_FAULTS = """async () => {
  const { violations } = await axe.run(document, { resultTypes: ['violations'] });
  return violations
    .filter(({ impact }) => impact === 'serious' || impact === 'critical')
    .flatMap(({ id, nodes }) => nodes.map((node) => `${id}: ${node.html.slice(0, 200)} ${node.failureSummary}`));
}"""

if TYPE_CHECKING:
    from pages import Tabs
    from studio_server import Served

    from motionmind.body.motion import Motion
    from motionmind.studio.project import Project


@pytest.fixture(scope="session", autouse=True)
def _thumbnails() -> Iterator[None]:
    """Every page that is opened shows the same thirty small pictures: each is drawn once, for the same movement."""
    from motionmind.studio import studio, thumbnails
    from motionmind.studio.thumbnails import thumbnail

    drawn: dict[object, bytes] = {}

    def draw(motion: Motion, frame: int, height: int) -> bytes:
        motion.posture(frame)
        body = motion.skeleton
        shape = body.names, body.parents, body.offsets.tobytes(), body.tips.tobytes()
        place = motion.rotations[frame].tobytes(), motion.root[frame].tobytes(), bool(motion.inserted()[frame])
        key = shape, place, height
        if key not in drawn:
            drawn[key] = thumbnail(motion, frame, height)
        return drawn[key]

    with pytest.MonkeyPatch.context() as patch:
        for module in (studio, thumbnails):
            patch.setattr(module, "thumbnail", draw)
        yield


@pytest.fixture
def make_project(tmp_path: Path) -> Iterator[Callable[..., Project]]:
    """Make or open a project of the corpus ballet by its file's name, "piece" by default."""
    from motionmind.studio.project import Project

    opened: list[Project] = []

    def make(name: str = "piece", corpus: str = "ballet") -> Project:
        path = tmp_path / f"{name}.motionmind"
        opened.append(Project.open(path) if path.exists() else Project.create(path, corpus))
        return opened[-1]

    yield make
    for project in opened:
        project.close()


@pytest.fixture
def studio_server(tmp_path: Path) -> Iterator[Served]:
    """A studio with an empty project of the corpus ballet, in this process, at a free port; one worker."""
    from studio_server import serving

    from motionmind.studio.project import Project

    with serving(Project.create(tmp_path / "piece.motionmind", "ballet")) as served:
        yield served


@pytest.fixture
def is_drawn() -> bool:
    """Whether WebGL draws on `studio_page`: tests that look at what it draws ask for it by a parameter."""
    return False


@pytest.fixture
def studio_page(request: pytest.FixtureRequest, studio_server: Served, tabs: Tabs, is_drawn: bool) -> Iterator[Any]:
    """A page of Playwright, LARGE or of the size that is its parameter, that is let into `studio_server`; an error on
    its console fails the test."""
    from studio_server import LARGE

    width, height = getattr(request, "param", LARGE)
    errors: list[str] = []

    def hear(message: Any) -> None:
        if message.type == "error":
            errors.append(f"{message.text} {message.location.get('url', '')}")

    hearing = {"console": hear, "pageerror": lambda error: errors.append(str(error))}
    with tabs.tab(hearing, is_drawn, viewport={"width": width, "height": height}, **RESTING) as page:
        page.goto(studio_server.entry)
        yield page
    assert not errors


@pytest.fixture(scope="session")
def axe_faults() -> Callable[[Any], list[str]]:
    """Find the serious faults of a page with axe-core, which is installed for node, as `.ci/run` does."""
    node = shutil.which("node")
    asked = 'require.resolve("axe-core/axe.min.js")'
    found = node and subprocess.run([node, "-p", asked], capture_output=True, text=True, check=False)
    if not found or found.returncode:
        pytest.skip("axe-core is not here (install it for node, and set NODE_PATH)")
    source = Path(found.stdout.strip()).read_text(encoding="utf-8")

    def find(page: Any) -> list[str]:
        page.evaluate(f"{source};0")
        faults: list[str] = page.evaluate(_AXE_FAULTS)
        return faults

    return find
