"""Draws a world that stands still and a camera that goes through it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ifsvideo.benchmark.simulation.geometry import Array, Box, Camera, Scene
from ifsvideo.benchmark.simulation.paths import drive, integral, orientation, wobble

KINDS = ("road", "rest", "hand-held", "sideways")
"""Drive forward; camera at rest or nearly; pan or walk near clutter; drive past with a look aside."""
_KIND_SHARES = (0.4, 0.15, 0.25, 0.2)
_SIZES = ((1242, 375), (1280, 720), (640, 360), (960, 540), (720, 480), (640, 480), (854, 480), (1920, 1080))


@dataclass(frozen=True)
class Window:
    """What is drawn first: the clock and the lens."""

    time: Array
    fps: float
    size: tuple[int, int]
    focal: float
    k1: float

    @property
    def step(self) -> float:
        """Seconds from frame to frame."""
        return 1 / self.fps


def draw_scene(rng: np.random.Generator) -> Scene:
    """A world without movers, seen over 20 to 30 frames."""
    window = _draw_window(rng)
    kind = str(rng.choice(KINDS, p=_KIND_SHARES))
    if kind == "hand-held":
        return _hand_held(rng, window)
    return _street(rng, window, kind)


def _draw_window(rng: np.random.Generator) -> Window:
    fps = float(rng.choice([25.0, 30.0, 30000 / 1001]))
    size = _SIZES[rng.integers(len(_SIZES))]
    focal = rng.uniform(0.6, 1.3) * max(size)
    corner = (size[0] ** 2 + size[1] ** 2) / (2 * focal) ** 2
    # A short lens cannot bend as much: below this the picture's corners would show nothing.
    k1 = max(rng.uniform(-0.25, 0.05), -0.12 / corner)
    return Window(np.arange(rng.integers(20, 31)) / fps, fps, size, focal, k1)


def _camera(window: Window, centres: Array, yaw: Array, pitch: Array, roll: Array) -> Camera:
    return Camera(window.size, window.focal, window.k1, orientation(yaw, pitch, roll), centres)


def standing(
    frames: int,
    place: tuple[float, float, float],
    half: tuple[float, float, float],
    yaw: float = 0.0,
    texture: float = 0.7,
    rough: bool = False,
) -> Box:
    """A box that does not move."""
    centres = np.broadcast_to(np.array(place), (frames, 3))
    return Box(np.array(half), centres, np.full(frames, yaw), texture, rough)


def _street(rng: np.random.Generator, window: Window, kind: str) -> Scene:
    """Road, camera at rest in a street, or a look aside while driving; the camera's height is 0."""
    time, frames = window.time, len(window.time)
    rest, sideways = kind == "rest", kind == "sideways"
    speed = rng.choice([rng.uniform(0, 6), rng.uniform(4, 14), rng.uniform(10, 25)])
    speed = 0.0 if rest else (0.6 * speed + 1.5 if sideways else speed)
    bend = rng.normal(0, 0.12) * (rng.random() < 0.6) * (not rest)
    rough = 0.1 if rest else rng.uniform(0.3, 1.2)
    rough *= not (rest and rng.random() < 0.3)  # some cameras stand on a tripod
    heading = integral(np.full(frames, bend) + wobble(rng, time, 0.02 * rough, 0.2, 1), window.step)
    speeds = np.maximum(speed + rng.normal(0, 1.5) * (time - time.mean()) * (speed > 1), 0)
    centres = drive(speeds, heading, window.step)
    centres[:, 1] = wobble(rng, time, 0.01 * rough, 0.8, 3)
    degree = np.deg2rad(1)
    pitch = wobble(rng, time, 0.25 * degree * rough, 0.8, 2.5) + wobble(
        rng, time, 0.06 * degree * rough, 4, 12
    )
    roll = wobble(rng, time, 0.1 * degree * rough, 0.8, 6)
    aside = rng.choice([-1, 1]) * rng.uniform(50, 110) if sideways else rng.normal(0, 15 if rest else 2)
    height = rng.uniform(1.2, 5) if rest else rng.uniform(1.2, 1.8)
    tilt = -rng.uniform(0, 5) * (height - 1.2) + rng.normal(0, 2)
    yaw = heading + aside * degree + wobble(rng, time, 0.05 * degree * rough, 1, 8)
    camera = _camera(window, centres, yaw, pitch + tilt * degree, roll)
    furniture = _facades(rng, frames, height, sideways) + _roadside(rng, frames, height, sideways)
    furniture += _skyline(rng, frames, height, aside * degree)
    boxes = tuple(box for box in furniture if clear_of(box, centres, 0.8))
    return Scene(kind, window.fps, camera, height, rng.uniform(0.05, 0.5), boxes)


def clear_of(box: Box, path: Array, margin: float) -> bool:
    """Whether a path (F, 3) keeps away from the box in the plane, by its outline and a margin (metres)."""
    own = np.abs(box.to_own((path - box.centres)[:, None]))[:, 0]
    return bool((own[:, [0, 2]] > box.half[[0, 2]] + margin).any(axis=1).all())


def _facades(rng: np.random.Generator, frames: int, ground: float, sideways: bool) -> list[Box]:
    """Rows of houses along the road, with gaps."""
    boxes = []
    for side in (-1, 1):
        if rng.random() < 0.25:
            continue
        away, z = rng.uniform(6 if sideways else 4, 20), rng.uniform(-70, -50) if sideways else -10.0
        while z < 90:
            length, high, deep = rng.uniform(8, 25), rng.uniform(3, 15), rng.uniform(3, 6)
            if rng.random() < 0.8:
                place = (side * (away + deep + rng.uniform(0, 2)), ground - high / 2, z + length / 2)
                half = (deep, high / 2, length / 2)
                boxes.append(standing(frames, place, half, 0.0, rng.uniform(0.3, 0.95)))
            z += length + rng.choice([0.0, 0.0, rng.uniform(2, 12)])
    return boxes


def _roadside(rng: np.random.Generator, frames: int, ground: float, sideways: bool) -> list[Box]:
    """Poles, trees, hedges and parked cars on both sides, at 3 to 80 m."""
    boxes: list[Box] = []
    kinds = rng.choice(["pole", "tree", "hedge", "car"], size=rng.integers(0, 22), p=[0.3, 0.25, 0.15, 0.3])
    for kind in kinds:
        side = rng.choice([-1, 1]) * rng.uniform(3, 7)
        ahead = rng.uniform(-25, 25) if sideways else rng.uniform(3, 10) + rng.exponential(18)
        turn = rng.normal(0, 0.05)
        if kind == "pole":
            high = rng.uniform(2, 7)
            half = (rng.uniform(0.05, 0.2), high / 2, 0.1)
            boxes.append(standing(frames, (side, ground - high / 2, ahead), half, turn, 0.9))
        elif kind == "tree":
            high, crown = rng.uniform(1.5, 3), rng.uniform(0.7, 2.2)
            boxes.append(standing(frames, (side, ground - high / 2, ahead), (0.15, high / 2, 0.15), 0, 0.8))
            half = (crown, crown * rng.uniform(0.8, 1.5), crown)
            boxes.append(standing(frames, (side, ground - high - half[1], ahead), half, turn, 0.9, True))
        else:
            wide, high, long = (0.5, 0.5, 4.0) if kind == "hedge" else (0.9, 0.75, 2.2)
            half = (wide, high * rng.uniform(0.8, 1.2), long * rng.uniform(0.8, 1.2))
            place = (side + np.sign(side) * wide, ground - half[1], ahead)
            boxes.append(standing(frames, place, half, turn, 0.8, kind == "hedge"))
    return boxes


def _skyline(rng: np.random.Generator, frames: int, ground: float, towards: float) -> list[Box]:
    """Something far away in most directions of view: woods, houses, hills."""
    boxes = []
    for angle in towards + np.linspace(-0.9, 0.9, 7) + rng.normal(0, 0.05, 7):
        if rng.random() < 0.3:
            continue
        away, high = rng.uniform(90, 350), rng.uniform(4, 40)
        place = (away * np.sin(angle), ground - high / 2, away * np.cos(angle))
        half = (away * rng.uniform(0.1, 0.2), high / 2, 5.0)
        boxes.append(standing(frames, place, half, float(angle), rng.uniform(0.3, 0.9)))
    return boxes


def _hand_held(rng: np.random.Generator, window: Window) -> Scene:
    """A room or a yard: walls, a table, boxes on both, seen by somebody who pans, sways or walks."""
    time, frames, degree = window.time, len(window.time), np.deg2rad(1)
    shake = rng.uniform(0.1, 1.0)
    pan = rng.choice([0.0, rng.uniform(-25, 25)]) * degree
    turn = integral(np.full(frames, pan), window.step) + wobble(rng, time, 0.8 * shake * degree, 0.4, 4)
    pitch = -rng.uniform(5, 28) * degree + wobble(rng, time, 0.7 * shake * degree, 0.4, 5)
    walk = rng.choice([0.0, rng.uniform(0, 0.3), rng.uniform(0.3, 1.4)])
    centres = drive(np.full(frames, walk), np.full(frames, rng.uniform(-np.pi, np.pi)), window.step)
    sway = [wobble(rng, time, 0.015 * shake, 0.5, 3) for _ in range(3)]
    centres = centres + np.column_stack(sway)
    camera = _camera(window, centres, turn, pitch, wobble(rng, time, 0.5 * shake * degree, 0.4, 5))
    ground, furniture = rng.uniform(1.1, 1.7), []
    back = rng.uniform(2.5, 6)
    if rng.random() < 0.85:
        furniture.append(
            standing(frames, (0, 0, back + 0.1), (8, 3, 0.1), rng.normal(0, 0.2), rng.uniform(0.2, 0.9))
        )
    for side in (-1, 1):
        if rng.random() < 0.4:
            place = (side * rng.uniform(1.5, 4), 0.0, 0.0)
            furniture.append(standing(frames, place, (0.1, 3, 8), rng.normal(0, 0.1), rng.uniform(0.2, 0.9)))
    if rng.random() < 0.7:
        furniture += _table(rng, frames, ground)
    furniture += _clutter(rng, frames, ground, (0.0, 0.6 * back + 0.8), (2.0, 0.35 * back), 0.6)
    boxes = tuple(box for box in furniture if clear_of(box, centres, 0.35))
    return Scene("hand-held", window.fps, camera, ground, rng.uniform(0.1, 0.6), boxes)


def _table(rng: np.random.Generator, frames: int, ground: float) -> list[Box]:
    """A table (a block down to the ground) at 1 to 3 m, with things on it."""
    top, ahead = rng.uniform(0.35, 0.75), rng.uniform(1.2, 2.6)
    half = (rng.uniform(0.5, 1.2), (ground - top) / 2, rng.uniform(0.35, 0.7))
    place = (rng.normal(0, 0.3), (ground + top) / 2, ahead)
    table = standing(frames, place, half, rng.normal(0, 0.3), rng.uniform(0.2, 0.9))
    return [table, *_clutter(rng, frames, top, (place[0], ahead), (0.7 * half[0], 0.7 * half[2]), 0.15)]


def _clutter(
    rng: np.random.Generator,
    frames: int,
    support: float,
    middle: tuple[float, float],
    reach: tuple[float, float],
    largest: float,
) -> list[Box]:
    """Boxes that stand about on a support at height ``support``."""
    boxes = []
    for _ in range(rng.integers(0, 8)):
        half = rng.uniform(0.25, 1, 3) * largest * rng.uniform(0.4, 1)
        x, z = np.array(middle) + rng.uniform(-1, 1, 2) * reach
        place = (float(x), float(support - half[1]), float(z))
        boxes.append(
            standing(frames, place, (half[0], half[1], half[2]), rng.uniform(-2, 2), rng.uniform(0.4, 1))
        )
    return boxes
