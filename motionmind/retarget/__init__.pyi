from .joint_mapping import read_joint_mapping as read_joint_mapping
from .retarget import to_human23 as to_human23

__all__ = ["read_joint_mapping", "to_human23"]
