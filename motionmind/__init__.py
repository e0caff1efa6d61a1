"""MotionMind: movement between two postures in the style of a corpus, with a proof of how good it is."""
