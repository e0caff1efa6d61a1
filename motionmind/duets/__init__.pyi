from .tweening import DuetTween as DuetTween
from .tweening import tween_duet as tween_duet

__all__ = ["DuetTween", "tween_duet"]
