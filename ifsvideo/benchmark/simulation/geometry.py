"""A moving camera with a simple lens, and boxes that stand or move: all that a simulated world is made of.

World and camera axes: x right, y down, z forward; metres and seconds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

NEAREST_M = 0.1
"""A point nearer to the camera's plane than this is not projected."""


@dataclass(frozen=True)
class Camera:
    """A camera path over F frames: square pixels, principal point in the middle, one radial lens term.

    Attributes
    ----------
    size : (width, height), pixels
    focal : float, pixels
    k1 : float
        Radial distortion: a point at radius r (in focal lengths) is seen at r (1 + k1 r^2).
    rotations : (F, 3, 3)
        Turns world axes into camera axes.
    centres : (F, 3)
        Where the camera is, metres.
    """

    size: tuple[int, int]
    focal: float
    k1: float
    rotations: Array
    centres: Array

    def project(self, points: Array) -> Array:
        """Pixels (F, P, 2) of places (F, P, 3) or (P, 3); NaN behind the camera and where the lens folds."""
        seen = np.matmul(points - self.centres[:, None], self.rotations.transpose(0, 2, 1))
        depth = np.where(seen[..., 2] > NEAREST_M, seen[..., 2], np.nan)
        plane = seen[..., :2] / depth[..., None]
        square = (plane**2).sum(axis=2)
        stretch = np.where(1 + 3 * self.k1 * square > 0, 1 + self.k1 * square, np.nan)
        return np.asarray(self.focal * plane * stretch[..., None] + self._middle())

    def rays(self, frame: int, xy: Array) -> Array:
        """Directions (N, 3) in the world of pixels (N, 2) of one frame."""
        seen = (xy - self._middle()) / self.focal
        plane = seen.copy()
        for _ in range(20):  # a fixed point: converges wherever the lens does not fold
            plane = seen / (1 + self.k1 * (plane**2).sum(axis=1, keepdims=True))
        return np.asarray(np.column_stack([plane, np.ones(len(xy))]) @ self.rotations[frame])

    def _middle(self) -> Array:
        return (np.array(self.size, dtype=np.float64) - 1) / 2


@dataclass(frozen=True)
class Box:
    """A box that stands on the ground and turns about the vertical.

    Attributes
    ----------
    half : (3,)
        Half width, half height, half length, metres.
    centres : (F, 3)
    yaw : (F,)
        Heading of its length, radians from z towards x.
    texture : float
        Share of the places on it where a corner is found, 0 to 1.
    rough : bool
        Its points lie anywhere in it, as leaves do, not on its faces.
    moves : bool
    """

    half: Array
    centres: Array
    yaw: Array
    texture: float = 0.7
    rough: bool = False
    moves: bool = False

    def to_own(self, vectors: Array, frames: slice | int = slice(None)) -> Array:
        """World vectors (F, P, 3), or (P, 3) for one frame, along the box's own axes."""
        return _about_vertical(vectors, -self.yaw[frames])

    def to_world(self, places: Array) -> Array:
        """Where places of the box (P, 3) are in each frame, (F, P, 3)."""
        everywhere = np.broadcast_to(places, (len(self.yaw), *places.shape))
        return np.asarray(_about_vertical(everywhere, self.yaw) + self.centres[:, None])

    def entry(self, origins: Array, directions: Array, frames: slice | int = slice(None)) -> Array:
        """How many times its direction a ray goes until it enters the box; infinite where it misses.

        Parameters
        ----------
        origins : (F, 1, 3), or (1, 3) for one frame
        directions : (F, P, 3), or (P, 3) for one frame
        """
        start = self.to_own(origins - self.centres[frames][..., None, :], frames)
        along = self.to_own(directions, frames)
        along = np.where(np.abs(along) < 1e-12, 1e-12, along)
        sides = np.sign(along) * self.half
        near = ((-sides - start) / along).max(axis=-1)
        far = ((sides - start) / along).min(axis=-1)
        return np.where((near < far) & (near > 0), near, np.inf)


def _about_vertical(vectors: Array, angle: Array) -> Array:
    """Vectors (F, P, 3) turned by one angle a frame, or (P, 3) by one angle."""
    cos, sin = np.cos(angle)[..., None], np.sin(angle)[..., None]
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    return np.stack(np.broadcast_arrays(cos * x + sin * z, y, cos * z - sin * x), axis=-1)


@dataclass(frozen=True)
class Scene:
    """A camera path, the ground and the boxes.

    Attributes
    ----------
    kind : str
    fps : float
    camera : Camera
    ground : float
        y of the ground, metres.
    ground_texture : float
        As of a box.
    boxes : tuple of Box
    """

    kind: str
    fps: float
    camera: Camera
    ground: float
    ground_texture: float
    boxes: tuple[Box, ...]
