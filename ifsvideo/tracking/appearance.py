"""What the picture looks like around a point, and whether two such patches show the same."""

from __future__ import annotations

from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from ifsvideo.types import Image

Patches = NDArray[np.float32]
"""(N, K) float32: the pixels of N patches, each of mean 0 and length 1 (0 where there is no contrast)."""


@cache
def grid(radius: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Offsets x and y (K,) of a patch's pixels from its centre, row by row."""
    y, x = np.mgrid[-radius : radius + 1, -radius : radius + 1].reshape(2, -1).astype(np.float32)
    return x, y


def cut(grey: Image, xy: NDArray[np.float32], radius: int) -> Patches:
    """Patches of side 2 radius + 1 around points (N, 2), between pixels by bilinear interpolation."""
    if len(xy) == 0:
        return np.empty((0, (2 * radius + 1) ** 2), np.float32)
    x, y = grid(radius)
    pixels = cv2.remap(
        grey, xy[:, :1] + x, xy[:, 1:] + y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    ).astype(np.float32)
    return normalise(pixels)


def normalise(pixels: NDArray[np.float32]) -> Patches:
    """Rows (N, K) with their mean taken out and their length made 1, so that exposure does not matter."""
    centred = pixels - pixels.mean(axis=1, keepdims=True)
    length = np.sqrt(np.einsum("ij,ij->i", centred, centred))
    return np.asarray(centred / np.maximum(length, 1e-6)[:, None], np.float32)


def correlation(a: Patches, b: Patches) -> NDArray[np.float32]:
    """Normalised cross-correlation of each pair of patches (N,), -1 to 1."""
    return np.asarray(np.einsum("ij,ij->i", a, b), np.float32)
