"""One least-squares solve that turns a reference movement into one that its feet carry."""
