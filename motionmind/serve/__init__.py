"""Movement for other programs: poses, waypoints and pins on a time line become movement, over a protocol."""
