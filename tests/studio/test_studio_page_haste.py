"""The page in hasty hands: clicks and keys that come before what was asked for is answered."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from piece_page import piece, wait_for

if TYPE_CHECKING:
    from studio_server import Served


def hold_up(page: Any, address: str, milliseconds: int = 200) -> None:
    """Let every answer from some address come late."""

    def late(route: Any) -> None:
        answer = route.fetch()
        page.wait_for_timeout(milliseconds)
        route.fulfill(response=answer)

    page.route(address, late)


def test_what_is_varied_is_the_piece_as_it_stands(studio_server: Served, studio_page: Any) -> None:
    page = studio_page
    studio_server.insert("b1", "ballet/adagio", 0, 40)
    page.get_by_test_id("open-vary").click()
    page.get_by_test_id("tile-3").wait_for()
    hold_up(page, "**/api/vary")
    page.get_by_test_id("depart").fill("10")  # is asked for when the edit comes
    edit = "{ edit: 'insert', id: 'b2', source: 'ballet/plies', first: 0, last: 20, mirrored: false, before: 'b1' }"
    page.evaluate(f"void studio.api.edit({edit})")
    page.get_by_test_id("vary").click()
    wait_for(page, "studio.store.state.undo === 'vary the piece'", 20.0)
    assert "ballet/plies" in {block["source"] for block in piece(page)["blocks"]}
