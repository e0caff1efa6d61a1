"""The least differences that a viewer notices: thresholds for warnings of visible faults."""

NOTICEABLE_M = 0.01
NOTICEABLE_DEG = 3.0
NOTICEABLE_MPS2 = 9.0  # moves a body by a centimetre within a frame, at 30 frames a second
NOTICEABLE_SHARE = 0.05  # of a speed, an acceleration or a second
NOTICEABLE_SPAN_SHARE = 0.006  # of a body's span: a centimetre on a person, and in proportion on others
NOTICEABLE_BRIDGE_DEG = 30.0  # a turn that no clip shows, while the whole body moves
