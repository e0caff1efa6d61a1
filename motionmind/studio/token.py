"""The keys of the studio: a token in the URL that the terminal prints, and the cookie that the page gets for it.

The token is in the URL's fragment, which browsers never send to a server. The cookie is another secret, so neither
reveals the other; its name contains the port, because browsers share cookies between ports. It expires with the
browser session or this process.
"""

from __future__ import annotations

import secrets


class Keys:
    """The secrets of one process.

    Attributes:
        token: the secret in the URL.
    """

    def __init__(self) -> None:
        self.token = secrets.token_urlsafe(32)
        self._cookie = secrets.token_urlsafe(32)

    def __repr__(self) -> str:
        return "<Keys>"  # keeps the secrets out of logs

    def admits(self, token: str) -> bool:
        """Return whether a text is the token."""
        return secrets.compare_digest(token.encode("utf-8", "replace"), self.token.encode())

    def is_let_in(self, cookies: str, port: int) -> bool:
        """Return whether the Cookie header of a request contains the cookie."""
        pairs = (part.strip().partition("=") for part in cookies.split(";"))
        own = [value for name, _, value in pairs if name == _name(port)]
        return len(own) == 1 and secrets.compare_digest(own[0].encode("utf-8", "replace"), self._cookie.encode())

    def cookie(self, port: int) -> str:
        """Return the value of the Set-Cookie header."""
        return f"{_name(port)}={self._cookie}; HttpOnly; SameSite=Strict; Path=/"


def _name(port: int) -> str:
    return f"motionmind-{port}"
