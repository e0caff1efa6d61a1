"""Learning from a corpus, and saving, loading and summarising the result."""
