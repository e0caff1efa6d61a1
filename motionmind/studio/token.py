"""The keys of the studio: a token in the URL that the terminal prints, and the cookie that it is exchanged for.

The token stands in the URL's fragment, which browsers send to no server. The cookie is another secret, so neither gives
the other away; it is named by the port, since cookies know no ports, and ends with the browser or this process.
"""

from __future__ import annotations

import secrets

_BYTES = 32


class Keys:
    """The secrets of one process.

    Attributes:
        token: the one in the URL.
    """

    def __init__(self) -> None:
        self.token = secrets.token_urlsafe(_BYTES)
        self._cookie = secrets.token_urlsafe(_BYTES)

    def __repr__(self) -> str:
        return "<Keys>"  # which no log shows

    def admits(self, token: str) -> bool:
        """Whether this is the token."""
        return secrets.compare_digest(token.encode("utf-8", "replace"), self.token.encode())

    def is_let_in(self, cookies: str, port: int) -> bool:
        """Whether the header Cookie of a request holds the cookie."""
        pairs = (part.strip().partition("=") for part in cookies.split(";"))
        own = [value for name, _, value in pairs if name == _name(port)]
        return len(own) == 1 and secrets.compare_digest(own[0].encode("utf-8", "replace"), self._cookie.encode())

    def cookie(self, port: int) -> str:
        """Return the header Set-Cookie."""
        return f"{_name(port)}={self._cookie}; HttpOnly; SameSite=Strict; Path=/"


def _name(port: int) -> str:
    return f"motionmind-{port}"
