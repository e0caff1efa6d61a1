"""Asking for a tween: the request, the problem built from a grammar, and the answer with its certificate and report."""
