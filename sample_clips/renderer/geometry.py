"""Planar textured faces, bodies made of them, and rigid poses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from renderer.mipmap import Texture

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]
Bend = Callable[[Array], Array]


@dataclass(frozen=True)
class Face:
    """A parallelogram ``origin + u * edge_u + v * edge_v``, 0 <= u, v <= 1, that carries a texture.

    A texel with less than half opacity is a hole, so any planar outline is a face. Where ``closed`` is
    set the back is never seen and skipped. A face with ``bend`` is unbounded: its edges span one texture
    period, which repeats, and ``bend`` maps z to the sideways shift of the texture (a road that curves).
    """

    origin: Array
    edge_u: Array
    edge_v: Array
    texture: Texture
    closed: bool = False
    bend: Bend | None = None


@dataclass(frozen=True)
class Body:
    """Faces that move together: ``pose(t)`` is object-to-world (4, 4); ``label`` 0 is the static world."""

    faces: tuple[Face, ...]
    label: int = 0
    name: str = ""
    pose: Callable[[float], Array] | None = None
    shadows: tuple[Face, ...] = field(default=())


def pose(position: Sequence[float], yaw: float = 0.0, pitch: float = 0.0, roll: float = 0.0) -> Array:
    """Rigid motion (4, 4): roll (about z), pitch (about x), yaw (about y), then the move; radians, metres.

    Positive yaw turns z towards x (to the right), positive pitch turns z towards -y (upwards).
    """
    cy, sy, cp, sp, cr, sr = (
        np.cos(yaw),
        np.sin(yaw),
        np.cos(pitch),
        np.sin(pitch),
        np.cos(roll),
        np.sin(roll),
    )
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_x = np.array([[1, 0, 0], [0, cp, -sp], [0, sp, cp]])
    about_z = np.array([[cr, -sr, 0], [sr, cr, 0], [0, 0, 1]])
    matrix = np.eye(4)
    matrix[:3, :3] = about_y @ about_x @ about_z
    matrix[:3, 3] = position
    return matrix


def moved(face: Face, by: Array) -> Face:
    """The face after a rigid motion (4, 4)."""
    R = by[:3, :3]
    return Face(
        R @ face.origin + by[:3, 3], R @ face.edge_u, R @ face.edge_v, face.texture, face.closed, face.bend
    )


def rectangle(
    origin: Sequence[float],
    right: Sequence[float],
    down: Sequence[float],
    picture: Picture,
    closed: bool = True,
) -> Face:
    """A whole picture on a parallelogram given by its top-left corner and its two edges."""
    return Face(
        np.asarray(origin, float),
        np.asarray(right, float),
        np.asarray(down, float),
        Texture.of(picture),
        closed,
    )


def polygon(points: Sequence[Sequence[float]], picture: Picture, closed: bool = True) -> Face:
    """A planar polygon cut out of a picture that covers its bounding box.

    ``points`` start with the bottom edge (left, then right, as seen from outside): it gives the picture's x
    axis; the picture's y axis runs down the plane.
    """
    corners = np.asarray(points, float)
    u = corners[1] - corners[0]
    u /= np.linalg.norm(u)
    n = np.cross(u, corners[-1] - corners[0])
    v = np.cross(n / np.linalg.norm(n), u) * -1.0
    flat = np.stack([(corners - corners[0]) @ u, (corners - corners[0]) @ v], axis=1)
    low, size = flat.min(axis=0), np.ptp(flat, axis=0)
    shape = np.array([picture.shape[1], picture.shape[0]])
    cut = np.zeros(picture.shape[:2], np.uint8)
    cv2.fillPoly(cut, [np.round((flat - low) / size * (shape - 1)).astype(np.int32)], 255)
    image = np.dstack([picture[..., :3], cut])
    return Face(corners[0] + low[0] * u + low[1] * v, u * size[0], v * size[1], Texture.of(image), closed)


def box(size: Sequence[float], pictures: dict[str, Picture]) -> tuple[Face, ...]:
    """A box (x, y, z extents, metres) that stands on y = 0, centred in x and z.

    ``pictures`` has any of front (-z), back, left (-x), right, top; ``side`` stands in for an upright one.
    """
    x, h, z = size[0] / 2, size[1], size[2] / 2
    sides = {
        "front": ((-x, -h, -z), (2 * x, 0, 0), (0, h, 0)),
        "back": ((x, -h, z), (-2 * x, 0, 0), (0, h, 0)),
        "left": ((-x, -h, z), (0, 0, -2 * z), (0, h, 0)),
        "right": ((x, -h, -z), (0, 0, 2 * z), (0, h, 0)),
        "top": ((-x, -h, z), (2 * x, 0, 0), (0, 0, -2 * z)),
    }
    faces = []
    for name, (origin, right, down) in sides.items():
        picture = pictures.get(name, pictures.get("side") if name != "top" else None)
        if picture is not None:
            faces.append(rectangle(origin, right, down, picture))
    return tuple(faces)
