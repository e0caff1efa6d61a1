"""What is measured of MotionMind: a folder a question, a command each. `python -m experiments` lists them."""
