"""Gaps of a corpus: which transitions to record next for cheaper tweens with fewer bridges."""
