from .library import Library as Library
from .library import read_library as read_library
from .library import write_library as write_library
from .naming import name_states as name_states
from .protocol import Discretization as Discretization
from .spec import make_discretization as make_discretization
from .states import StateSpace as StateSpace

__all__ = [
    "Discretization",
    "Library",
    "StateSpace",
    "make_discretization",
    "name_states",
    "read_library",
    "write_library",
]
