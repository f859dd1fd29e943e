"""Tracks by their ids in order: what numpy's functions for sets sort anew is searched by halves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def places(ids: NDArray[np.int64], among: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Where ids are among others.

    Parameters
    ----------
    ids : (N,) int64
        In any order.
    among : (M,) int64
        In order, each once.

    Returns
    -------
    place : (N,) int64
        Index into ``among``; of an id that is not there it means nothing.
    there : (N,) bool
        Whether an id is there.
    """
    if not len(among):
        return np.zeros(len(ids), np.int64), np.zeros(len(ids), bool)
    place = np.minimum(np.searchsorted(among, ids), len(among) - 1)
    return place, np.asarray(among[place] == ids, np.bool_)
