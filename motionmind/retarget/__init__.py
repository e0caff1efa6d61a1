"""Retargeting: known rigs, mappings of their joints, and movement brought onto human23."""
