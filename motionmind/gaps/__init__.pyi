from .gaps import Gaps as Gaps
from .gaps import find_gaps as find_gaps

__all__ = ["Gaps", "find_gaps"]
