"""Reach the studio that has a project open already, if it is the user's own."""

from __future__ import annotations

import hmac
import http.client
import secrets
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import urlsplit

import msgspec

from motionmind.studio.answers import Proving, Visiting
from motionmind.studio.guard import CHALLENGE_PATH, RENEW_PATH
from motionmind.studio.renewal import known, proof

_ANSWER_TIME_S = 5.0
_MAX_BYTES = 4096


class Reached(NamedTuple):
    """A running studio.

    Attributes:
        url: its URL with the token.
        visit: its URL with a token for one visit within a minute.
    """

    url: str
    visit: str


def reach(project: Path, home: Path) -> Reached | None:
    """Return how to enter the studio that has a project open; None if it does not answer, or is not the user's own.

    Args:
        project: the project's file.
        home: the folder of the user's data.
    """
    if (found := known(project, home)) is None:
        return None
    url, key = found
    try:
        number = secrets.token_urlsafe(32)
        answer, _ = _post(url, CHALLENGE_PATH, {"number": number})
        studio = msgspec.json.decode(answer, type=Proving)
        if not hmac.compare_digest(studio.proof.encode(), proof(key, "studio", url, number, studio.number).encode()):
            return None
        own = {"number": studio.number, "proof": proof(key, "page", url, number, studio.number)}
        _, cookie = _post(url, RENEW_PATH, own)
        answer, _ = _post(url, "/api/visit", {}, cookie)
        tokens = msgspec.json.decode(answer, type=Visiting)
    except (OSError, ValueError, http.client.HTTPException):
        return None
    return Reached(f"{url}/#token={tokens.token}", f"{url}/#token={tokens.visit}")


def _post(url: str, path: str, body: dict[str, Any], cookie: str = "") -> tuple[bytes, str]:
    """Send a request; return the answer and its cookie. OSError if it is refused."""
    parts = urlsplit(url)
    connection = http.client.HTTPConnection(parts.hostname or "", parts.port, timeout=_ANSWER_TIME_S)
    try:
        headers = {"Origin": url, "X-MotionMind": "studio", "Cookie": cookie}
        connection.request("POST", path, msgspec.json.encode(body), headers)
        answer = connection.getresponse()
        if answer.status != 200:
            raise OSError(f"{path} was answered with {answer.status}")
        return answer.read(_MAX_BYTES), answer.getheader("Set-Cookie", "").partition(";")[0]
    finally:
        connection.close()
