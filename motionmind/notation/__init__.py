"""The score language: text that describes movement, and its reading, checking and playing; see docs/notation.md."""
