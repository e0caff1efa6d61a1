"""The array types of every signature, each named once; shapes are in the docstrings."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Bools = NDArray[np.bool_]
Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Ints = NDArray[np.int64]
Int32s = NDArray[np.int32]
Int16s = NDArray[np.int16]
Int8s = NDArray[np.int8]
Indices = NDArray[np.intp]
Pixels = NDArray[np.uint8]  # RGB [H, W, 3], or what else is told by bytes
Bytes = NDArray[np.uint8]  # text, UTF-8 [B]

States = Int32s  # of joint chains: indices into a joint's states
