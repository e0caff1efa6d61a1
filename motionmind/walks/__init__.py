"""Walks through a corpus: where they are, between given postures, and the fine detail of the movement they expect."""
