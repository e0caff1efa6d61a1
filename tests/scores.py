"""A score that tests bring: two bends of the knees."""

BENDS = """body   human23
legs
  stand = stand out 10 turn 8
  bend = stand out 10 turn 8, bend 30
clip bends: Down and up
  start | stand
  1     | bend
  1     | stand
"""
TITLED = f"title  Two bends of the knees\n{BENDS}"
