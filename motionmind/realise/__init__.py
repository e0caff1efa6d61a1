"""Realising a path of states as a motion: timeline, walks through the corpus, detail, root and feet."""
