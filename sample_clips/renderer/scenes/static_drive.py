"""A drive past houses, trees and parked cars, looking half to the right; nothing moves by itself."""

from __future__ import annotations

import numpy as np

from renderer.film import Scene, bump, wobble
from renderer.geometry import Array, pose
from renderer.road import Course, Strip, ground
from renderer.scenes.block import Side, block, daylight

FPS, FRAMES = 30, 135
SPEED = 8.0


def build() -> Scene:
    """The scene."""
    rng = np.random.default_rng(37)
    course = Course(radius=600.0, limit=0.3)
    strip = Strip((-3.8, 5.6), (-6.4, 8.4), dashes=(0.0,), solid=(3.5,))
    left = Side(-7.5, trees=-5.2, poles=-4.4, gap=(1.0, 6.0))
    right = Side(
        9.4, trees=7.3, poles=6.1, cars=4.6, gap=(2.0, 9.0), car_gap=(1.5, 6.0), tree_gap=(7.0, 12.0)
    )
    street = block(rng, course, (left, right), (-4.0, 170.0))
    shake = [
        wobble(rng, a, f) for a, f in ((0.002, (1.5, 3.1, 6.7)), (0.0012, (1.0, 4.9)), (0.0015, (0.8, 3.3)))
    ]
    heave = wobble(rng, 0.01, (1.3, 2.9))

    def camera(t: float) -> Array:
        z = SPEED * t
        yaw = course.heading(z) + 0.27 + 0.05 * np.sin(0.8 * t) + shake[1](t)
        pitch = -0.015 + shake[0](t) + bump(t, 1.8, 0.007)
        x = float(course.offset(z)) + 1.7 + 0.1 * np.sin(0.9 * t)
        return pose((x, -1.4 + heave(t), z), yaw, pitch, shake[2](t))

    bodies = (street, ground(rng, course, strip))
    return Scene(
        "static_drive",
        FRAMES,
        FPS,
        500.0,
        bodies,
        daylight(rng),
        camera,
        lambda t: 1.0 + 0.1 * np.sin(1.2 * t),
        seed=3,
    )
