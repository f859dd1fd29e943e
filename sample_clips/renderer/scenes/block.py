"""Both sides of a street: houses in a row, trees, poles, parked cars. All of it is the static world."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from renderer.cars import HATCH, SEDAN, VAN, car_shadow, parked
from renderer.geometry import Body, Face, moved
from renderer.mipmap import Texture
from renderer.paint import Colour, Generator, panorama
from renderer.raster import Backdrop
from renderer.road import Course
from renderer.street import blob, hedge, house, pole, sign, tree

PAINTS: tuple[Colour, ...] = (
    (150, 34, 36),
    (46, 66, 112),
    (196, 196, 192),
    (70, 74, 78),
    (38, 92, 74),
    (214, 186, 120),
    (112, 118, 124),
)


@dataclass(frozen=True)
class Side:
    """One side of a street; positions in metres right of the centre line, negative to the left.

    ``front`` is the line of the house fronts, ``trees``, ``poles`` and ``cars`` the lines of these.
    """

    front: float
    trees: float | None = None
    poles: float | None = None
    cars: float | None = None
    hedge: float | None = None
    gap: tuple[float, float] = (1.0, 9.0)
    floors: tuple[int, int] = (2, 4)
    car_gap: tuple[float, float] = (2.0, 9.0)
    tree_gap: tuple[float, float] = (9.0, 15.0)


def block(rng: Generator, course: Course, sides: tuple[Side, ...], reach: tuple[float, float]) -> Body:
    """Everything that stands between the depths ``reach``."""
    faces: list[Face] = []
    shadows: list[Face] = []
    for side in sides:
        _houses(rng, course, side, reach, faces)
        if side.trees is not None:
            _trees(rng, course, side, reach, faces, shadows)
        if side.poles is not None:
            _poles(rng, course, side, reach, faces)
        if side.cars is not None:
            _cars(rng, course, side, reach, faces, shadows)
        if side.hedge is not None:
            for z in np.arange(reach[0] + 3, min(reach[1], 110.0), 11.0):
                faces += hedge(rng, 7.0, course.at(float(z), side.hedge))
    return Body(tuple(faces), shadows=tuple(shadows))


def daylight(rng: Generator) -> Backdrop:
    """Blue sky with clouds, and hills."""
    low, high = -0.25, 0.75
    picture = panorama(rng, ((92, 138, 196), (206, 216, 224)), (74, 96, 84), low, high)
    return Backdrop(Texture.of(picture), low, high, (200, 208, 216), 420.0)


def _houses(
    rng: Generator, course: Course, side: Side, reach: tuple[float, float], faces: list[Face]
) -> None:
    z = reach[0]
    turn = np.pi / 2 if side.front > 0 else -np.pi / 2
    while z < reach[1]:
        width = float(rng.uniform(8, 16))
        set_back = float(rng.uniform(0, 1.6)) * np.sign(side.front)
        place = course.at(z + width / 2, side.front + set_back, turn)
        floors = int(rng.integers(side.floors[0], side.floors[1] + 1))
        faces += house(rng, width, float(rng.uniform(7, 10)), floors, place, gable=bool(floors < 3))
        z += width + float(rng.uniform(*side.gap))


def _trees(
    rng: Generator,
    course: Course,
    side: Side,
    reach: tuple[float, float],
    faces: list[Face],
    shadows: list[Face],
) -> None:
    z = reach[0] + float(rng.uniform(2, 8))
    while z < min(reach[1], 120.0):
        place = course.at(z, float(side.trees or 0) + float(rng.uniform(-0.3, 0.3)))
        height = float(rng.uniform(4.8, 7.5))
        faces += tree(rng, height, place)
        shadows.append(blob(0.55 * height, 0.55 * height, place, 0.26))
        z += float(rng.uniform(*side.tree_gap))


def _poles(rng: Generator, course: Course, side: Side, reach: tuple[float, float], faces: list[Face]) -> None:
    at = float(side.poles or 0)
    for k, z in enumerate(np.arange(reach[0] + 6, min(reach[1], 150.0), 22.0)):
        faces += pole(rng, 6.5, course.at(float(z), at), arm=-1.6 * float(np.sign(at)))
        if k % 2:
            text, colour = (("50", (196, 32, 36)), ("30", (196, 32, 36)), ("P", (36, 70, 160)))[
                int(rng.integers(3))
            ]
            faces += sign(rng, course.at(float(z) + 9, at), text, colour)


def _cars(
    rng: Generator,
    course: Course,
    side: Side,
    reach: tuple[float, float],
    faces: list[Face],
    shadows: list[Face],
) -> None:
    z = reach[0] + float(rng.uniform(0, 4))
    while z < min(reach[1], 90.0):
        shape = (SEDAN, HATCH, SEDAN, VAN)[int(rng.integers(4))]
        yaw = float(rng.normal(0, 0.012)) + (np.pi if (side.cars or 0) < 0 else 0)
        place = course.at(z + shape.length / 2, float(side.cars or 0) + float(rng.uniform(-0.1, 0.1)), yaw)
        plate = f"{chr(65 + int(rng.integers(26)))}K {int(rng.integers(1000, 9999))}"
        faces += parked(rng, shape, PAINTS[int(rng.integers(len(PAINTS)))], plate, place)
        shadows += [moved(s, place) for s in car_shadow(shape, 0.3)]
        z += shape.length + float(rng.uniform(*side.car_gap))
