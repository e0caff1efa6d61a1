"""From a path of states to movement."""
