"""Whether a track still sees what it saw at its birth (Shi and Tomasi's affine monitoring, CVPR 1994).

KLT compares neighbouring frames only, so that a point at an object's edge can slide onto the background
without one bad step. Against the patch of its birth, aligned by an affine map, it shows. The alignment is the
inverse compositional one (Baker and Matthews, Lucas-Kanade 20 Years On, IJCV 2004), with brightness and
contrast projected out.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from ifsvideo.tracking.appearance import Patches, correlation, cut, grid, normalise
from ifsvideo.types import Bools, Image, Ints

STEPS = 6
"""Gauss-Newton steps; the start is the map of the last check, a few frames ago."""
STIFFNESS = 1e-3
"""Share of the normal matrix's mean diagonal added to it: a patch of one edge does not fix all parameters."""
LONGEST_STEP = np.array([0.3, 0.3, 3.0, 0.3, 0.3, 3.0])
"""Of the linear parameters and of the two shifts in pixels; a longer one folds the patch."""
SCALES = (0.6, 1.7)
"""Change of area within which a patch is still compared with its birth's; beyond, it is the new reference."""


class Verdict(NamedTuple):
    """How well patches fit their references.

    Attributes
    ----------
    similarity : (N,) float32
        Correlation after the alignment, -1 to 1.
    offset : (N,) float32
        How far the alignment had to move the patch from where the track says it is, pixels.
    warp : (N, 2, 2) float32
        Linear part of the map from the reference to the picture.
    """

    similarity: NDArray[np.float32]
    offset: NDArray[np.float32]
    warp: NDArray[np.float32]


@dataclass
class References:
    """The reference patch of every living track, and how it was last seen warped.

    Attributes
    ----------
    radius : int
        The patches' side is 2 radius + 1 pixels.
    patches : (N, K) float32
    warp : (N, 2, 2) float32
    """

    radius: int
    patches: Patches
    warp: NDArray[np.float32]

    @classmethod
    def none(cls, radius: int) -> References:
        """The references of no tracks."""
        return cls(radius, np.empty((0, (2 * radius + 1) ** 2), np.float32), np.empty((0, 2, 2), np.float32))

    def keep(self, which: Bools | Ints) -> None:
        """Forget all but some."""
        self.patches, self.warp = self.patches[which], self.warp[which]

    def add(self, grey: Image, xy: NDArray[np.float32]) -> None:
        """Take what is seen at new points (M, 2) as their references."""
        self.patches = np.concatenate([self.patches, cut(grey, xy, self.radius)])
        self.warp = np.concatenate([self.warp, np.tile(np.eye(2, dtype=np.float32), (len(xy), 1, 1))])

    def check(self, grey: Image, xy: NDArray[np.float32], which: Ints) -> Verdict:
        """Compare some of the tracks, at xy (len(which), 2), with their references; remember their maps.

        A patch that has come much nearer or gone much farther becomes its own reference: pixels that were not
        there at birth cannot be compared.
        """
        verdict = align(grey, xy, self.patches[which], self.warp[which], self.radius)
        self.warp[which] = verdict.warp
        area = np.abs(np.linalg.det(verdict.warp))
        changed = (area < SCALES[0]) | (area > SCALES[1])
        self.patches[which[changed]] = cut(grey, xy[changed], self.radius)
        self.warp[which[changed]] = np.eye(2, dtype=np.float32)
        return verdict


def align(
    grey: Image, xy: NDArray[np.float32], patches: Patches, warp: NDArray[np.float32], radius: int
) -> Verdict:
    """Fit each reference (N, K) to the picture (H, W) around its point (N, 2), by an affine map."""
    count = len(xy)
    if count == 0:
        return Verdict(np.empty(0, np.float32), np.empty(0, np.float32), warp)
    descent, solve = _prepare(patches, radius)
    maps = np.zeros((count, 2, 3), np.float64)
    maps[:, :, :2] = warp
    best = Verdict(np.full(count, -1, np.float32), np.zeros(count, np.float32), warp.copy())
    for step in range(STEPS + 1):
        seen = _sample(grey, xy, maps, radius)
        similarity = correlation(patches, seen)
        better = similarity > best.similarity
        best.similarity[better] = similarity[better]
        best.offset[better] = np.hypot(*maps[better, :, 2].T)
        best.warp[better] = maps[better, :, :2]
        if step < STEPS:
            error = (seen - patches)[:, None] @ descent
            maps = _compose(maps, (solve @ error.transpose(0, 2, 1))[:, :, 0])
    return best


def _prepare(patches: Patches, radius: int) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Steepest descent images (N, K, 6) of the references, and their inverse normal matrices (N, 6, 6)."""
    side = 2 * radius + 1
    count = len(patches)
    x, y = grid(radius)
    gy, gx = (
        g.reshape(count, side * side) for g in np.gradient(patches.reshape(count, side, side), axis=(1, 2))
    )
    descent = np.stack([gx * x, gx * y, gx, gy * x, gy * y, gy], axis=2)
    # What brightness and contrast can explain is no evidence of a displacement.
    descent -= descent.mean(axis=1, keepdims=True)
    descent -= patches[:, :, None] * np.einsum("nk,nkp->np", patches, descent)[:, None, :]
    normal = np.einsum("nkp,nkq->npq", descent, descent, optimize=True).astype(np.float64)
    # Linear parameters act over the patch's radius: in pixels at its edge all six have one unit.
    unit = np.array([radius, radius, 1, radius, radius, 1], np.float64)
    scaled = normal / (unit[:, None] * unit)
    size = np.trace(scaled, axis1=1, axis2=2)[:, None, None] / 6
    inverse = np.linalg.inv(scaled + (STIFFNESS * size + 1e-12) * np.eye(6))
    return descent, inverse / (unit[:, None] * unit)


def _sample(grey: Image, xy: NDArray[np.float32], maps: NDArray[np.float64], radius: int) -> Patches:
    """The picture around each point, through its map (N, 2, 3)."""
    x, y = grid(radius)
    linear, shift = maps[:, :, :2].astype(np.float32), (maps[:, :, 2] + xy).astype(np.float32)
    place = linear[:, :, :1] * x + linear[:, :, 1:] * y + shift[:, :, None]
    border = cv2.BORDER_REPLICATE
    pixels = cv2.remap(grey, place[:, 0], place[:, 1], cv2.INTER_LINEAR, borderMode=border)
    return normalise(np.asarray(pixels, np.float32))


def _compose(maps: NDArray[np.float64], step: NDArray[np.float64]) -> NDArray[np.float64]:
    """Each map after the inverse of its small step (N, 6); steps that would fold the patch are cut."""
    small = np.clip(step, -LONGEST_STEP, LONGEST_STEP).reshape(-1, 2, 3) + np.eye(2, 3)
    (a, b, _), (c, d, _) = small.transpose(1, 2, 0)
    inverse = np.stack([d, -b, -c, a], axis=1).reshape(-1, 2, 2) / (a * d - b * c)[:, None, None]
    linear = maps[:, :, :2] @ inverse
    return np.concatenate([linear, maps[:, :, 2:] - linear @ small[:, :, 2:]], axis=2)
