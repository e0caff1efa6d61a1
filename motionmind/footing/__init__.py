"""A body's footing: what bears it and where, its root and balance, its flight, and legs that reach the floor."""
