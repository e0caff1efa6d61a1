"""Modules and compiled code for all workers, loaded once by the process that workers are forked from.

Importing the engine and its compiled code takes more than a second, which every replacement of a cancelled worker would
otherwise spend again.
"""

from contextlib import suppress
from importlib import import_module

from motionmind.codecache import is_all_compiled
from motionmind.errors import MotionMindError
from motionmind.tween.engine import Engine

for name in ("alternatives", "seams", "varied", "worker_loop"):  # they define the jobs
    import_module(f"motionmind.studio.{name}")
if is_all_compiled():  # otherwise another process is compiling it
    with suppress(MotionMindError):
        engine = Engine.load("ballet")
        engine.tween(engine.posture("ballet/arabesque"), engine.posture("ballet/fifth"))
