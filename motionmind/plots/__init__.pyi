from .angles import draw_angles as draw_angles
from .attractor import draw_attractor as draw_attractor
from .canvas import Plate as Plate
from .joint_graph import draw_joint_graph as draw_joint_graph

__all__ = ["Plate", "draw_angles", "draw_attractor", "draw_joint_graph"]
