from .angles import draw_angles as draw_angles
from .attractor import draw_attractor as draw_attractor
from .canvas import Plate as Plate
from .cleaning import draw_cleaning as draw_cleaning
from .deviation import draw_deviation as draw_deviation
from .floor_plan import draw_floor_plan as draw_floor_plan
from .floor_plan import find_overstep as find_overstep
from .joint_graph import draw_joint_graph as draw_joint_graph

__all__ = [
    "Plate",
    "draw_angles",
    "draw_attractor",
    "draw_cleaning",
    "draw_deviation",
    "draw_floor_plan",
    "draw_joint_graph",
    "find_overstep",
]
