"""How finely the viewer draws without a GPU: plainly what moves, finely what rests."""

from __future__ import annotations

from typing import Any

import pytest
from piece_page import until

pytestmark = pytest.mark.long

RATIO = "studio.viewer.stage.renderer.getPixelRatio() / devicePixelRatio"


@pytest.fixture
def viewed(studio_server: Any, studio_page: Any) -> Any:
    """The page with a piece in the viewer, at rest."""
    studio_server.insert("b1", "ballet/adagio", 0, 40)
    until(studio_page, "studio.viewer.piece?.end > 0 && studio.viewer.stage")
    assert studio_page.evaluate("studio.viewer.stage.software")
    until(studio_page, f"{RATIO} === 2")
    return studio_page


def test_every_picture_is_plain_while_the_playhead_moves_and_fine_when_it_rests(viewed: Any) -> None:
    viewed.evaluate(
        f"studio.viewer.addEventListener('draw', () => (window.drawn ??= []).push({RATIO})); window.drawn = []"
    )
    viewed.evaluate(
        "(async () => { for (let i = 1; i <= 10; i++) { studio.viewer.player.seek(0.1 * i);"
        "await new Promise(requestAnimationFrame) } })()"
    )
    until(viewed, "drawn.at(-1) === 2")
    *moving, last = viewed.evaluate("drawn")
    assert len(moving) >= 9
    assert max(moving) <= 1.0
    assert last == 2.0
    viewed.wait_for_timeout(400)
    assert viewed.evaluate("drawn.length") == len(moving) + 1  # nothing more is drawn at rest


def test_moving_pictures_that_come_late_are_coarser_to_a_bound_and_recover(viewed: Any) -> None:
    def ratio(late: float, count: int) -> float:
        script = f"{{ for (let i = 0; i < {count}; i++) studio.viewer.stage.render(true, {late}) }}"
        viewed.evaluate(f"(() => {script})()")
        return float(viewed.evaluate(RATIO))

    assert ratio(5.0, 60) == pytest.approx(1.0)  # whatever came before
    found = [ratio(100.0, 6) for _ in range(8)]
    assert found == sorted(found, reverse=True)
    assert found[0] < 1.0
    assert found[-1] == 0.5
    assert ratio(30.0, 12) == 0.5  # neither late nor early
    assert [ratio(5.0, 6) for _ in range(8)][-1] == pytest.approx(1.0)
    viewed.evaluate("studio.viewer.stage.render(false, 100)")
    assert viewed.evaluate(RATIO) == 2.0
