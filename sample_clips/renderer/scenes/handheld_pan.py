"""A hand-held pan over a table; two printed boxes turn and slide, each its own way."""

from __future__ import annotations

import numpy as np

from renderer.film import Scene, smoothstep, wobble
from renderer.geometry import Array, Body, Face, moved, pose, rectangle
from renderer.mipmap import Texture
from renderer.paint import Generator, plain, shade, wood
from renderer.raster import Backdrop
from renderer.room import books, carton, painting, wallpaper
from renderer.street import blob

FPS, FRAMES = 30, 150
TABLE = 0.0  # the table top is the plane y = 0; the room's floor lies below it


def build() -> Scene:
    """The scene."""
    rng = np.random.default_rng(53)
    tea, rice = (
        carton(rng, (0.26, 0.36, 0.13), (196, 92, 48), "CRISPS"),
        carton(rng, (0.28, 0.21, 0.2), (60, 112, 158), "TEA"),
    )

    def tall_box(t: float) -> Array:
        go = smoothstep(t, 0.1, 4.6)
        return pose((-0.42 + 0.36 * go, TABLE, 1.32 - 0.1 * go), 0.75 - 1.5 * t * 0.42)

    def low_box(t: float) -> Array:
        go = smoothstep(t, 0.4, 4.9)
        return pose((0.5 - 0.2 * go, TABLE, 1.62 - 0.42 * go), -0.5 + 0.5 * t + 0.25 * np.sin(1.7 * t))

    shake = [
        wobble(rng, a, f)
        for a, f in ((0.006, (0.7, 1.9, 4.3)), (0.006, (0.9, 2.3, 5.1)), (0.009, (0.6, 1.7, 3.9)))
    ]
    drift = [wobble(rng, a, f) for a, f in ((0.02, (0.4, 1.3)), (0.012, (0.6, 1.7)), (0.02, (0.5, 1.1)))]

    def camera(t: float) -> Array:
        pan = smoothstep(t, 0.2, 4.8)
        position = (-0.12 + 0.22 * pan + drift[0](t), -0.56 + drift[1](t), drift[2](t))
        return pose(
            position,
            -0.2 + 0.36 * pan + shake[0](t),
            -0.24 + 0.03 * np.sin(1.2 * t) + shake[1](t),
            shake[2](t),
        )

    bodies = (
        Body(tea, 1, "tall box", tall_box, (blob(0.4, 0.27, np.eye(4), 0.3),)),
        Body(rice, 2, "low box", low_box, (blob(0.42, 0.35, np.eye(4), 0.3),)),
        _room(rng),
    )
    backdrop = Backdrop(Texture.of(plain(rng, (64, 128), (120, 116, 110))), -1.5, 1.5, (150, 148, 140), 400.0)
    return Scene(
        "handheld_pan",
        FRAMES,
        FPS,
        560.0,
        bodies,
        backdrop,
        camera,
        lambda t: 1.0 + 0.06 * np.sin(1.4 * t),
        shutter=0.4,
        seed=4,
    )


def _room(rng: Generator) -> Body:
    faces: list[Face] = [
        rectangle((-1.6, TABLE, 2.35), (3.2, 0, 0), (0, 0, -2.2), wood(rng, (1100, 1600), (158, 110, 70), 9)),
        rectangle((-1.6, TABLE, 0.15), (3.2, 0, 0), (0, 0.05, 0), plain(rng, (32, 900), (110, 74, 48))),
        rectangle((-4, -2.2, 3.3), (8, 0, 0), (0, 2.95, 0), wallpaper(rng, (900, 2400))),
        rectangle((-4, 0.75, 3.3), (8, 0, 0), (0, 0, -3.2), wood(rng, (700, 1700), (96, 74, 56), 8)),
    ]
    for x, y, w, h in (
        (-1.5, -1.25, 0.8, 0.6),
        (-0.35, -1.35, 0.55, 0.75),
        (0.55, -1.2, 0.9, 0.6),
        (1.75, -1.3, 0.6, 0.7),
    ):
        faces.append(rectangle((x, y, 3.28), (w, 0, 0), (0, h, 0), painting(rng, w, h)))
    faces += books(rng, 13, pose((-0.62, TABLE, 2.1), 0.05))
    faces += books(rng, 9, pose((0.35, TABLE, 2.2), -0.1))
    still = (
        ((0.16, 0.1, 0.12), (70, 128, 84), "SALT", (-0.08, 0, 1.82), 0.4),
        ((0.1, 0.22, 0.1), (172, 60, 74), "COCOA", (0.16, 0, 1.95), -0.3),
        ((0.24, 0.06, 0.17), (206, 176, 92), "DOMINO", (-0.3, 0, 0.98), 0.5),
        ((0.13, 0.2, 0.08), (98, 84, 140), "SOAP", (-0.78, 0, 1.6), -0.4),
        ((0.22, 0.09, 0.15), (210, 202, 186), "CHESS", (0.42, 0, 0.96), -0.35),
        ((0.15, 0.25, 0.12), (64, 132, 140), "OATS", (0.82, 0, 1.75), 0.35),
    )
    shadows = []
    for size, colour, title, at, yaw in still:
        place = pose(at, yaw)
        faces += [moved(f, place) for f in carton(rng, size, colour, title)]
        shadows.append(blob(size[0] + 0.08, size[2] + 0.08, place, 0.28))
    paper = shade(painting(rng, 0.3, 0.4), 1.1)
    faces.append(
        moved(rectangle((-0.15, -0.002, 0.2), (0.3, 0, 0), (0, 0, -0.4), paper), pose((0.05, 0, 1.05), 0.3))
    )
    return Body(tuple(faces), shadows=tuple(shadows))
