from .joint_mapping import read_joint_mapping as read_joint_mapping

__all__ = ["read_joint_mapping"]
