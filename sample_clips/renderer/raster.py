"""One instant of a scene, drawn with a depth buffer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.geometry import Array, Body, Face
from renderer.mipmap import Texture

NEAR = 0.05
FAR = 900.0
TAPS = 4.0  # the jittered exposures of a frame stand in for this many taps along the long axis of a footprint
Floats = NDArray[np.float32]


@dataclass(frozen=True)
class Backdrop:
    """Sky and hills at infinity: a panorama of ``span`` radians of azimuth, and the haze that depth adds."""

    panorama: Texture
    low: float
    high: float
    haze: tuple[float, float, float]
    reach: float


class Canvas:
    """Colour, inverse depth and label of every pixel, for one camera at one instant."""

    def __init__(self, K: Array, size: tuple[int, int], camera: Array, jitter: tuple[float, float]) -> None:
        self.width, self.height = size
        self.K = K.copy()
        self.K[:2, 2] -= jitter  # the pixel looks at a point shifted by the jitter
        self.camera = camera
        self.colour: Floats = np.zeros((self.height, self.width, 3), np.float32)
        self.inverse_depth: Floats = np.zeros((self.height, self.width), np.float32)
        self.labels = np.zeros((self.height, self.width), np.uint8)

    def draw(self, bodies: Sequence[Body], t: float) -> None:
        """Draw all bodies, nearest faces first (what lies behind is then cheap), then the shadows."""
        todo: list[tuple[float, Face, Array, int]] = []
        dark: list[tuple[Face, Array]] = []
        for body in bodies:
            to_camera = self.camera if body.pose is None else self.camera @ body.pose(t)
            if not body.faces:
                continue
            frames = _in_camera(body.faces, to_camera)
            centre = frames[:, :, 2] + 0.5 * (frames[:, :, 0] + frames[:, :, 1])
            facing = np.einsum("ni,ni->n", np.cross(frames[:, :, 0], frames[:, :, 1]), frames[:, :, 2]) > 0
            for face, frame, c, seen in zip(body.faces, frames, centre, facing, strict=True):
                if seen or not face.closed:
                    todo.append((1e9 if face.bend else float(np.linalg.norm(c)), face, frame, body.label))
            if body.shadows:
                dark += list(zip(body.shadows, _in_camera(body.shadows, to_camera), strict=True))
        for _, face, frame, label in sorted(todo, key=lambda item: item[0]):
            self._face(face, frame, label)
        for face, frame in dark:
            self._shadow(face, frame)

    def backdrop(self, sky: Backdrop) -> None:
        """Fill what nothing covers with the panorama, and add haze with depth to the rest."""
        w = self.inverse_depth
        covered = w > 0
        fog = np.zeros_like(w)
        fog[covered] = 1.0 - np.exp(-1.0 / (sky.reach * w[covered]))
        self.colour += fog[..., None] * (np.array(sky.haze, np.float32) - self.colour)
        index = np.flatnonzero(~covered)
        if not len(index):
            return
        pixel = np.stack([index % self.width, index // self.width, np.ones(len(index))])
        ray = self.camera[:3, :3].T @ np.linalg.solve(self.K, pixel)
        azimuth = np.arctan2(ray[0], ray[2]) / (2 * np.pi) + 0.5
        elevation = np.arctan2(-ray[1], np.hypot(ray[0], ray[2]))
        v = np.clip((sky.high - elevation) / (sky.high - sky.low), 0, 0.9999)
        per_pixel = sky.panorama.size[0, 0] / (2 * np.pi) / self.K[0, 0]
        footprint = np.full(len(index), (0.7 * per_pixel) ** 2, np.float32)
        rgba = sky.panorama.sample(azimuth.astype(np.float32), v.astype(np.float32), footprint)
        self.colour.reshape(-1, 3)[index] = rgba[:, :3]

    def _region(self, face: Face, frame: Array) -> tuple[int, int, int, int] | None:
        """Pixels that a face can cover: x0, y0, x1, y1, or None."""
        if face.bend is not None:
            return 0, 0, self.width, self.height
        u, v, o = frame.T
        corners = _clip_near(np.array([o, o + u, o + u + v, o + v]))
        if len(corners) < 3:
            return None
        xy = corners @ self.K.T
        xy = xy[:, :2] / xy[:, 2:]
        x0, y0 = np.maximum(np.floor(xy.min(axis=0)), 0).astype(int)
        x1 = int(min(np.ceil(xy[:, 0].max()) + 1, self.width))
        y1 = int(min(np.ceil(xy[:, 1].max()) + 1, self.height))
        return (int(x0), int(y0), x1, y1) if x1 > x0 and y1 > y0 else None

    def _hits(
        self, face: Face, frame: Array, bias: float = 1.0
    ) -> tuple[NDArray[np.intp], Floats, Floats, Floats, Floats] | None:
        """Pixels where the face is nearest: index, inverse depth, u, v, footprint (all (N,)).

        With H = K [edge_u edge_v origin], H^-1 (x, y, 1) = (u, v, 1) / z: all three in one.
        """
        region = self._region(face, frame)
        if region is None:
            return None
        x0, y0, x1, y1 = region
        H = self.K @ frame
        if abs(np.linalg.det(H)) < 1e-9:
            return None
        a, b, c = np.linalg.inv(H)
        x = np.arange(x0, x1, dtype=np.float64)[None, :]
        y = np.arange(y0, y1, dtype=np.float64)[:, None]
        w = (c[0] * x + (c[1] * y + c[2])).astype(np.float32)
        inside = (w * bias > self.inverse_depth[y0:y1, x0:x1]) & (w < 1 / NEAR) & (w > 1 / FAR)
        nu = (a[0] * x + (a[1] * y + a[2])).astype(np.float32)
        nv = (b[0] * x + (b[1] * y + b[2])).astype(np.float32)
        if face.bend is None:
            inside &= (nu >= 0) & (nu <= w) & (nv >= 0) & (nv <= w)
        hit = np.flatnonzero(inside)
        if not len(hit):
            return None
        w = w.ravel()[hit]
        z = 1 / w
        u, v = nu.ravel()[hit] * z, nv.ravel()[hit] * z
        size = face.texture.size[0]
        dx = ((a[0] - u * c[0]) * (z * size[0])) ** 2 + ((b[0] - v * c[0]) * (z * size[1])) ** 2
        dy = ((a[1] - u * c[1]) * (z * size[0])) ** 2 + ((b[1] - v * c[1]) * (z * size[1])) ** 2
        footprint = np.maximum(0.6 * np.minimum(dx, dy), np.maximum(dx, dy) / TAPS**2).astype(np.float32)
        row, column = np.divmod(hit, x1 - x0)
        return (row + y0) * self.width + column + x0, w, u.astype(np.float32), v.astype(np.float32), footprint

    def _face(self, face: Face, frame: Array, label: int) -> None:
        hits = self._hits(face, frame)
        if hits is None:
            return
        index, w, u, v, footprint = hits
        if face.bend is not None:
            u = (u - face.bend(v * np.linalg.norm(face.edge_v)) / np.linalg.norm(face.edge_u)).astype(
                np.float32
            )
        rgba = face.texture.sample(u, v, footprint)
        solid = rgba[:, 3] >= 128
        index = index[solid]
        self.colour.reshape(-1, 3)[index] = rgba[solid, :3]
        self.inverse_depth.ravel()[index] = w[solid]
        self.labels.ravel()[index] = label

    def _shadow(self, face: Face, frame: Array) -> None:
        # A shadow lies on the ground: the bias lets it pass the depth test there, but not behind things.
        hits = self._hits(face, frame, bias=1.01)
        if hits is None:
            return
        index, w, u, v, footprint = hits
        on_ground = self.inverse_depth.ravel()[index] < w * 1.01
        index = index[on_ground]
        rgba = face.texture.sample(u[on_ground], v[on_ground], footprint[on_ground])
        self.colour.reshape(-1, 3)[index] *= 1.0 - rgba[:, 3:].astype(np.float32) / 255


def _in_camera(faces: Sequence[Face], to_camera: Array) -> Array:
    """(N, 3, 3): columns edge_u, edge_v, origin of every face in camera axes."""
    frames = np.array([np.stack([f.edge_u, f.edge_v, f.origin], axis=1) for f in faces])
    frames = to_camera[:3, :3] @ frames
    frames[:, :, 2] += to_camera[:3, 3]
    return frames


def _clip_near(corners: Array) -> Array:
    """A polygon (N, 3) cut at the near plane."""
    depth = corners[:, 2] - NEAR
    if (depth > 0).all():
        return corners
    kept = []
    for i, j in zip(range(len(corners)), [*range(1, len(corners)), 0], strict=True):
        if depth[i] > 0:
            kept.append(corners[i])
        if depth[i] * depth[j] < 0:
            kept.append(corners[i] + (corners[j] - corners[i]) * depth[i] / (depth[i] - depth[j]))
    return np.array(kept)
