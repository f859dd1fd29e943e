"""Textures with all their mip levels in one picture, so that one remap reads every level at once."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

PAD = 2
COLUMNS = 256  # remap wants a picture: a list of points is folded into rows of this many


@dataclass(frozen=True, eq=False)
class Texture:
    """RGBA levels in ``atlas``; level i starts at row ``top[i]``, ``size[i]`` is (width, height)."""

    atlas: NDArray[np.uint8]
    top: NDArray[np.float32]
    size: NDArray[np.float32]
    wrap: bool

    @classmethod
    def of(cls, picture: NDArray[np.uint8], wrap: bool = False) -> Texture:
        """From a picture (H, W, 3 or 4) uint8; ``wrap`` repeats it along both axes."""
        level = picture
        if picture.shape[2] == 3:
            level = np.dstack([picture, np.full(picture.shape[:2], 255, np.uint8)])
        width = picture.shape[1] + 2 * PAD
        border = cv2.BORDER_WRAP if wrap else cv2.BORDER_REPLICATE
        rows, tops, sizes = [], [], []
        while True:
            h, w = level.shape[:2]
            padded = cv2.copyMakeBorder(level, PAD, PAD, PAD, PAD, border)
            tops.append(sum(len(r) for r in rows) + PAD)
            sizes.append((w, h))
            rows.append(np.pad(padded, ((0, 0), (0, width - padded.shape[1]), (0, 0))))
            if min(h, w) <= 2 * PAD:
                break
            level = cv2.resize(level, ((w + 1) // 2, (h + 1) // 2), interpolation=cv2.INTER_AREA)
        return cls(
            np.ascontiguousarray(np.concatenate(rows)),
            np.array(tops, np.float32),
            np.array(sizes, np.float32),
            wrap,
        )

    def sample(
        self, u: NDArray[np.float32], v: NDArray[np.float32], footprint: NDArray[np.float32]
    ) -> NDArray[np.uint8]:
        """Colours (N, 4) at ``u``, ``v``; ``footprint``: squared side of a pixel, in level 0 texels."""
        level = np.rint(0.5 * np.log2(np.maximum(footprint, 1e-6)))
        level = np.clip(level, 0, len(self.top) - 1).astype(np.intp)
        if self.wrap:
            u, v = u - np.floor(u), v - np.floor(v)
        n = len(u)
        rows = -(-n // COLUMNS)
        x = np.zeros((rows, COLUMNS), np.float32)
        y = np.zeros((rows, COLUMNS), np.float32)
        x.ravel()[:n] = u * self.size[level, 0] + (PAD - 0.5)
        y.ravel()[:n] = v * self.size[level, 1] + (self.top[level] - 0.5)
        return cv2.remap(self.atlas, x, y, cv2.INTER_LINEAR).reshape(-1, 4)[:n]  # type: ignore[return-value]
