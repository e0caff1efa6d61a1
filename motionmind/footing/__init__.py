"""A body's footing: its stances, its flights, the ground under it and its balance."""
