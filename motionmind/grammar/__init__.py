"""What is learned from a corpus: joint graphs, and how joints coordinate."""
