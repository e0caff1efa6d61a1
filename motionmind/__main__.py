"""`python -m motionmind`: the command line."""

from motionmind.cli import main

main()
