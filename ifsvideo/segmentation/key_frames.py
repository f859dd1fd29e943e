"""A few frames that stand for all of a window: motion is smooth, and more of them would tell little."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def key_frames(frames: int, most: int) -> NDArray[np.int64]:
    """At most ``most`` of the frames 0 to frames - 1, evenly spaced, the first and the last among them."""
    return np.unique(np.round(np.linspace(0, frames - 1, min(most, frames)))).astype(np.int64)
