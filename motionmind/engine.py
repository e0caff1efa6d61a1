"""The one door: learn from clips, load, tween."""
