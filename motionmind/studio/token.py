"""The keys of the studio: a token in the URL that the terminal prints, and the cookie that the page gets for it.

Other users see the URL with which a command starts the browser. So that URL has another token, for one visit soon. If
somebody else was first, the browser's visit fails and makes a new cookie, so the stolen one is worthless. (A private
file that redirects would not do: browsers in a sandbox, such as snaps, cannot read it.)

The token is in the URL's fragment, which browsers never send to a server. The cookie is another secret, so neither
reveals the other; its name contains the port, because browsers share cookies between ports. It expires with the
browser session or this process; after a restart, a page gets the new one by `studio.renewal`.

A look-only link has a key of its own, and a cookie that follows from it, so that both outlive a restart, until the
owner replaces the key. A program that takes the port meanwhile could read that cookie, and with it look at the piece.
"""

from __future__ import annotations

import hmac
import secrets
from time import monotonic

from motionmind.studio.renewal import Link, Renewal

_VISIT_S = 60.0


class Keys:
    """The secrets of one process.

    Attributes:
        token: the secret in the URL.
        renewal: lets pages in again after a restart; None if the connection is not private to this computer.
        link: the key of the look-only link; None if there is none.
    """

    def __init__(self, renewal: Renewal | None = None, link: Link | None = None) -> None:
        """Make new secrets, and take over what lets pages in again, and what lets others look."""
        self.renewal, self.link = renewal, link
        self.token = secrets.token_urlsafe(32)
        self._cookie = secrets.token_urlsafe(32)
        self._visit, self._visit_end, self._is_visited = "", 0.0, False

    def __repr__(self) -> str:
        return "<Keys>"  # keeps the secrets out of logs

    def visit(self) -> str:
        """Return a token that admits once, within a minute."""
        self._visit, self._visit_end, self._is_visited = secrets.token_urlsafe(32), monotonic() + _VISIT_S, False
        return self._visit

    def admits(self, token: str) -> bool:
        """Return whether a text is the token, or one for a first visit; a second visit invalidates all else."""
        given = token.encode("utf-8", "replace")
        if secrets.compare_digest(given, self.token.encode()):
            return True
        if not secrets.compare_digest(given, self._visit.encode()) or monotonic() > self._visit_end:
            return False
        if self._is_visited:
            self._cookie, self._visit_end = secrets.token_urlsafe(32), 0.0
            if self.renewal:
                self.renewal.replace()
            return False
        self._is_visited = True
        return True

    def lets_look(self, token: str) -> bool:
        """Return whether a text is the key of the look-only link."""
        link = self.link
        return link is not None and secrets.compare_digest(token.encode("utf-8", "replace"), link.key.encode())

    def is_let_in(self, cookies: str, port: int) -> bool:
        """Return whether the Cookie header of a request contains the owner's cookie."""
        return _has(cookies, _name(port), self._cookie)

    def is_looking(self, cookies: str, port: int) -> bool:
        """Return whether the Cookie header of a request contains the cookie of the look-only link."""
        return self.link is not None and _has(cookies, _looking_name(port), _looking_cookie(self.link))

    def cookie(self, port: int) -> str:
        """Return the value of the Set-Cookie header for the owner."""
        return _set(_name(port), self._cookie)

    def looking_cookie(self, port: int) -> str:
        """Return the value of the Set-Cookie header for the look-only link, which must be there."""
        assert self.link is not None
        return _set(_looking_name(port), _looking_cookie(self.link))


def _has(cookies: str, name: str, secret: str) -> bool:
    """Return whether a Cookie header has a cookie of this name once, with this secret."""
    pairs = (part.strip().partition("=") for part in cookies.split(";"))
    own = [value for key, _, value in pairs if key == name]
    return len(own) == 1 and secrets.compare_digest(own[0].encode("utf-8", "replace"), secret.encode())


def _set(name: str, value: str) -> str:
    return f"{name}={value}; HttpOnly; SameSite=Strict; Path=/"


def _name(port: int) -> str:
    return f"motionmind-{port}"


def _looking_name(port: int) -> str:
    return f"motionmind-look-{port}"  # of its own: the owner may try the link in the same browser


def _looking_cookie(link: Link) -> str:
    return hmac.new(link.key.encode(), b"cookie", "sha256").hexdigest()
