"""Modules and compiled code that every worker starts with: loaded once, by the process that workers are forked from.

Importing the engine and its compiled code takes more than a second, which each worker that takes the place of a
cancelled one would spend again.
"""

from contextlib import suppress
from importlib import import_module

from motionmind.codecache import is_all_compiled
from motionmind.errors import MotionMindError
from motionmind.tween.engine import Engine

for name in ("alternatives", "seams", "varied", "worker_loop"):  # where jobs are
    import_module(f"motionmind.studio.{name}")
if is_all_compiled():  # or else it would be compiled here, beside the process that does so
    with suppress(MotionMindError):
        Engine.load("ballet").tween("ballet/arabesque", "ballet/fifth")
