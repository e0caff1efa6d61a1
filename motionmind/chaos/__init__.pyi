from .flows import Flow as Flow
from .flows import find_flow as find_flow

__all__ = ["Flow", "find_flow"]
