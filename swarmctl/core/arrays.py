"""Names for the array types that kernels take."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Records = NDArray[Any]  # a structured array; its dtype is named in core/state.py
