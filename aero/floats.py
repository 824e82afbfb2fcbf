"""Array of floats, the type of most quantities."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
