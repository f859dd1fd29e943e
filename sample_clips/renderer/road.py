"""Roads: the line they follow and the strip of texture that covers the ground to both sides."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from renderer.geometry import Array, Body, Face, pose
from renderer.mipmap import Texture
from renderer.paint import Generator, Picture, noise, speckle, to_picture

PPM = 40  # texels a metre
WHITE = (222, 222, 214)
YELLOW = (214, 176, 66)


@dataclass(frozen=True)
class Course:
    """A road that bends with radius ``radius`` (metres, right positive) until its slope nears ``limit``."""

    radius: float
    limit: float = 0.5

    def offset(self, z: Array | float) -> Array:
        """Sideways position of the centre line at depth z."""
        m = self.limit
        return np.asarray(m * m * self.radius * (np.sqrt(1 + (np.asarray(z) / (m * self.radius)) ** 2) - 1))

    def heading(self, z: float) -> float:
        """Yaw of the road at depth z, radians."""
        x = z / (self.limit * self.radius)
        return float(np.arctan(self.limit * x / np.sqrt(1 + x * x)))

    def at(self, z: float, lateral: float, yaw: float = 0.0) -> Array:
        """Pose (4, 4) of a thing at depth z, ``lateral`` metres right of the centre line, along the road."""
        return pose((float(self.offset(z)) + lateral, 0.0, z), self.heading(z) + yaw)


@dataclass(frozen=True)
class Strip:
    """What lies across a road: edges in metres right of the centre line, from left to right."""

    road: tuple[float, float]
    walk: tuple[float, float]
    dashes: tuple[float, ...]
    solid: tuple[float, ...]
    double: tuple[float, ...] = ()
    half_width: float = 20.0
    period: float = 120.0


def ground(rng: Generator, course: Course, strip: Strip) -> Body:
    """The whole ground plane as one body with a texture that follows the road."""
    texture = Texture.of(_paint(rng, strip), wrap=True)
    edge_u, edge_v = np.array([2 * strip.half_width, 0, 0]), np.array([0, 0, strip.period])
    face = Face(np.array([-strip.half_width, 0.0, 0.0]), edge_u, edge_v, texture, bend=course.offset)
    return Body((face,))


def _paint(rng: Generator, strip: Strip) -> Picture:
    h, w = int(strip.period * PPM), int(2 * strip.half_width * PPM)

    def column(x: float) -> int:
        return round((x + strip.half_width) * PPM)

    fine, coarse = noise(rng, (h, w), 0.5), noise(rng, (h, w), 1.7)
    grass = np.array([104, 116, 66], np.float32) * (1 + 0.15 * fine + 0.13 * coarse)[..., None]
    paving = np.array([158, 152, 143], np.float32) * (1 + 0.05 * fine + 0.06 * coarse)[..., None]
    asphalt = np.array([99, 98, 98], np.float32) * (1 + 0.12 * fine + 0.09 * coarse)[..., None]
    out = grass
    walk, road = (
        slice(column(strip.walk[0]), column(strip.walk[1])),
        slice(column(strip.road[0]), column(strip.road[1])),
    )
    out[:, walk] = paving[:, walk]
    out[:, road] = asphalt[:, road]
    picture = to_picture(out)
    speckle(rng, picture, int(strip.period * 2 * strip.half_width * 3.5), (1, 5), 0.45)
    _slabs(rng, picture, (column(strip.walk[0]), column(strip.road[0])))
    _slabs(rng, picture, (column(strip.road[1]), column(strip.walk[1])))
    _wear(rng, picture, road)
    for x in strip.road:
        side = column(x)
        picture[:, side - 4 : side + 4] = to_picture(picture[:, side - 4 : side + 4] * 0.4 + 110.0)
        for y in range(0, h, PPM):
            picture[y : y + 2, side - 4 : side + 4] = 70
    _markings(rng, picture, strip)
    return picture


def _slabs(rng: Generator, picture: Picture, columns: tuple[int, int]) -> None:
    side = round(0.6 * PPM)
    for y in range(0, len(picture), side):
        for x in range(columns[0], columns[1], side):
            patch = picture[y : y + side, x : min(x + side, columns[1])]
            patch[:] = to_picture(patch * float(1 + 0.07 * rng.standard_normal()))
            patch[:1], patch[:, :1] = 92, 92


def _wear(rng: Generator, picture: Picture, road: slice) -> None:
    """Mended patches with tar edges, cracks, manholes, drains: what a tracker holds on to."""
    h = len(picture)
    for _ in range(h // 90):
        x, y = int(rng.uniform(road.start, road.stop - 60)), int(rng.uniform(0, h - 160))
        dx, dy = int(rng.uniform(15, 60)), int(rng.uniform(25, 150))
        dx = min(dx, road.stop - x)
        patch = picture[y : y + dy, x : x + dx]
        patch[:] = to_picture(patch * float(rng.choice([0.72, 0.82, 1.17])))
        cv2.rectangle(picture, (x, y), (x + dx, y + dy), (52, 51, 52), 2)
    for _ in range(h // 45):
        at = np.array([rng.uniform(road.start, road.stop), rng.uniform(0, h)])
        steps = np.cumsum(rng.normal(0, 7, (int(rng.uniform(6, 26)), 2)) + rng.normal(0, 3, 2), axis=0)
        line = np.clip(at + steps, [road.start, 0], [road.stop - 1, h - 1]).astype(np.int32)
        cv2.polylines(picture, [line], False, (48, 47, 48), int(rng.integers(1, 3)))
    for y in np.arange(PPM * 3, h - PPM, PPM * 7.5):
        x = int(rng.uniform(road.start + 40, road.stop - 40))
        cv2.circle(picture, (x, int(y)), 13, (58, 56, 54), -1)
        cv2.circle(picture, (x, int(y)), 13, (128, 124, 118), 2)
        for k in range(-9, 10, 6):
            cv2.line(picture, (x - 9, int(y) + k), (x + 9, int(y) + k), (112, 108, 104), 2)


def _markings(rng: Generator, picture: Picture, strip: Strip) -> None:
    h = len(picture)
    worn = np.clip(0.93 + 0.16 * noise(rng, (h, 64), 1.1), 0.35, 1.0)

    def band(x: float, colour: tuple[int, int, int], rows: slice) -> None:
        start = round((x + strip.half_width - 0.07) * PPM)
        area = picture[rows, start : start + 6].astype(np.float32)
        k = worn[rows, :6, None]
        picture[rows, start : start + 6] = to_picture(area * (1 - k) + np.asarray(colour, np.float32) * k)

    for x in strip.solid:
        band(x, WHITE, slice(0, h))
    for x in strip.double:
        band(x - 0.16, YELLOW, slice(0, h))
        band(x + 0.16, YELLOW, slice(0, h))
    for x in strip.dashes:
        for y in range(0, h, 10 * PPM):
            band(x, WHITE, slice(y, y + 4 * PPM))
