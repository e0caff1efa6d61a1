"""The studio as a hand uses it: a mouse's button or a finger goes down, moves and goes up."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Literal

import pytest
from pages import RESTING, Tabs

if TYPE_CHECKING:
    from studio_server import Served

Pointer = Literal["mouse", "finger"]


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """One studio for all tests of this module; each begins with an empty piece."""
    from studio_server import serving

    from motionmind.studio.project import Project

    project = Project.create(tmp_path_factory.mktemp("pointers") / "piece.motionmind", "ballet")
    with serving(project) as one:
        yield one


@pytest.fixture
def page(served: Served, tabs: Tabs) -> Iterator[Any]:
    """A page, 1440x900, that fingers can touch; an error on its console fails the test."""
    served.edit(edit="arrange", blocks=[], about={"words": "begin anew"})
    errors: list[str] = []
    hearing = {
        "console": lambda message: errors.append(message.text) if message.type == "error" else None,
        "pageerror": lambda error: errors.append(str(error)),
    }
    with tabs.tab(hearing, viewport={"width": 1440, "height": 900}, has_touch=True, **RESTING) as page:
        page.goto(served.entry)
        yield page
    assert errors == []


def rest(page: Any, selector: str) -> dict[str, float]:
    """Wait until something stays where it is, and return its box."""
    box: dict[str, float] = page.evaluate(
        """async (selector) => {
          const next = () => new Promise((done) => setTimeout(done, 100));
          let [before, still] = ["", 0];
          for (let tries = 0; tries < 300 && still < 3; tries++) {
            await next();
            const found = document.querySelector(selector)?.getBoundingClientRect();
            const now = found ? JSON.stringify(found) : "";
            still = now && now === before ? still + 1 : 0;
            before = now;
          }
          return JSON.parse(before);
        }""",
        selector,
    )
    return box


def drag(page: Any, pointer: Pointer, selector: str, by: tuple[float, float], share: float = 0.5) -> None:
    """Take hold of something, a share of the way along it, drag it in ten steps, and let go."""
    box = rest(page, selector)
    x, y = box["x"] + share * box["width"], box["y"] + box["height"] / 2
    places = [(x + by[0] * step / 10, y + by[1] * step / 10) for step in range(1, 11)]
    if pointer == "mouse":
        page.mouse.move(x, y)
        page.mouse.down()
        for place in places:
            page.mouse.move(*place)
            page.wait_for_timeout(20)
        page.mouse.up()
        return
    finger = page.context.new_cdp_session(page)
    for kind, points in [("touchStart", [(x, y)]), *(("touchMove", [place]) for place in places), ("touchEnd", [])]:
        sent = [{"x": across, "y": down} for across, down in points]
        finger.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": sent})
        page.wait_for_timeout(20)


POINTERS: tuple[Pointer, ...] = ("mouse", "finger")


@pytest.mark.long
@pytest.mark.parametrize("pointer", POINTERS)
def test_a_heel_is_dragged_up_into_a_releve(page: Any, pointer: Pointer) -> None:
    page.get_by_test_id("open-pose").click()
    page.get_by_test_id("handle-pelvis").wait_for()
    page.get_by_test_id("pose-from").and_(page.locator(":has(optgroup)")).select_option("ballet/arabesque")
    page.get_by_text("arabesque, being edited").wait_for()
    heel, head = (f"[data-testid=handle-{name}][style*=translate]" for name in ("left_heel", "atlantal"))
    before = rest(page, head)
    drag(page, pointer, heel, (0.0, -40.0), share=0.1)  # the rest of it is behind the handle of the foot
    page.get_by_test_id("pose-undo").and_(page.locator(":enabled")).wait_for()
    assert before["y"] - rest(page, head)["y"] > 6.0
    page.get_by_test_id("pose-undo").click()
    page.get_by_test_id("pose-undo").and_(page.locator(":disabled")).wait_for()
    assert abs(rest(page, head)["y"] - before["y"]) < 1.0
