"""The studio: a page in which a choreographer works, and the server that it talks to, on this computer alone."""
