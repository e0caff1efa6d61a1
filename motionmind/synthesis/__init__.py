"""From a path of states to a motion: its reference, the clock, and the synthesis of a movement on its feet."""
