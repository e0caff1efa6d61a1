"""Serve movement to other programs: a protocol turns poses, waypoints and pins on a timeline into movement."""
