"""The search for the best sequence of states, and the proof of how good it is."""
