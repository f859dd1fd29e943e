"""Which objects of a clip count, and their final numbers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ifsvideo.config import ObjectsConfig
from ifsvideo.tracking.trajectories import Trajectories
from ifsvideo.types import BACKGROUND


def settle(trajectories: Trajectories, labels: NDArray[np.int32], config: ObjectsConfig) -> NDArray[np.int32]:
    """Send what lives too short to the background; number the objects in the order in which they appear.

    Parameters
    ----------
    labels : (N,) int32
        Label of every row of the trajectories, any numbers above 0 for objects.

    Returns
    -------
    (N,) int32
        1, 2, ... without gaps in place of these; 0 and -1 stay.
    """
    fps = trajectories.fps or 30.0
    numbers = []
    for number in np.unique(labels[labels > BACKGROUND]).tolist():
        frames = trajectories.frame[labels == number]
        first, last = int(frames.min()), int(frames.max())
        if (last - first + 1) / fps >= config.least_seconds:
            numbers.append((first, number))
    final = {number: k + 1 for k, (_, number) in enumerate(sorted(numbers))}
    table = np.arange(-1, int(labels.max(initial=0)) + 1)
    table[2:] = [final.get(int(number), BACKGROUND) for number in table[2:]]
    return table[labels + 1].astype(np.int32)
