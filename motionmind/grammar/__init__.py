"""The grammar learned from a corpus: joint graphs, bridges between states, and the coordination of joints."""
