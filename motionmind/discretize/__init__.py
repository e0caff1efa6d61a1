"""Discretization of orientations into states: four kinds, and one representation, `StateSpace`, once fitted."""

from motionmind.discretize.codebook import Codebook
from motionmind.discretize.expert import ExpertLibrary
from motionmind.discretize.grids import EulerGrid, QuaternionGrid
from motionmind.discretize.library import Library, parse_library, read_library, write_library
from motionmind.discretize.protocol import Discretization
from motionmind.discretize.spec import KINDS, from_spec, make_discretization, to_spec
from motionmind.discretize.states import StateSpace

make = make_discretization  # its former name, which the package's own table of names still has

__all__ = [
    "KINDS",
    "Codebook",
    "Discretization",
    "EulerGrid",
    "ExpertLibrary",
    "Library",
    "QuaternionGrid",
    "StateSpace",
    "from_spec",
    "make_discretization",
    "parse_library",
    "read_library",
    "to_spec",
    "write_library",
]
