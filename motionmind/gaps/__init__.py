"""Gaps of a corpus: what to record next, so that tweens are cheaper and have fewer bridges."""
