"""The degenerate case: a van ahead drives our way, at a distance that opens and closes."""

from __future__ import annotations

import numpy as np

from renderer.cars import VAN, car, car_shadow
from renderer.film import Scene, bump, wobble
from renderer.geometry import Array, Body, pose
from renderer.road import Course, Strip, ground
from renderer.scenes.block import Side, block, daylight

FPS, FRAMES = 25, 130
SPEED = 11.0
LANE = 1.8


def build() -> Scene:
    """The scene."""
    rng = np.random.default_rng(23)
    course = Course(radius=-210.0, limit=0.5)
    strip = Strip((-3.6, 3.7), (-6.0, 6.2), dashes=(0.0,), solid=(-3.3, 3.4))
    left = Side(-9.0, trees=-5.0, poles=-4.3, hedge=-6.8, gap=(5.0, 14.0), floors=(1, 3))
    right = Side(9.5, trees=5.3, poles=4.5, hedge=7.0, gap=(4.0, 12.0), floors=(1, 3))
    street = block(rng, course, (left, right), (-4.0, 190.0))
    shake = [
        wobble(rng, a, f) for a, f in ((0.0016, (1.7, 3.3, 6.1)), (0.0008, (0.8, 4.7)), (0.0012, (0.9, 2.9)))
    ]
    heave = wobble(rng, 0.006, (1.4, 3.1))

    def camera(t: float) -> Array:
        z = SPEED * t
        pitch = -0.02 + 0.008 * np.sin(2.1 * t + 0.4) + shake[0](t) + bump(t, 2.7, 0.008)
        yaw = course.heading(z + 2.0) + 0.008 * np.sin(1.3 * t) + shake[1](t)
        x = float(course.offset(z)) + LANE + 0.1 * np.sin(0.8 * t + 1)
        return pose((x, -1.34 + heave(t), z), yaw, pitch, shake[2](t))

    def gap(t: float) -> float:
        return 9.6 - 1.9 * np.cos(1.45 * t - 0.25)

    def van(t: float) -> Array:
        lateral = LANE - 0.05 + 0.26 * np.sin(1.7 * t + 0.5)
        steer = 0.26 * 1.7 * np.cos(1.7 * t + 0.5) / SPEED
        place = course.at(SPEED * t + gap(t) + VAN.length / 2, lateral, steer)
        # The body dips and rolls on its springs.
        return place @ pose((0, 0, 0), 0.0, bump(t, 3.4, 0.006), 0.006 * np.sin(2.3 * t))

    body = car(rng, VAN, (196, 148, 58), "RT 8145", "2.0 TDI")
    bodies = (street, Body(body, 1, "followed van", van, car_shadow(VAN)), ground(rng, course, strip))
    return Scene(
        "follow_car",
        FRAMES,
        FPS,
        700.0,
        bodies,
        daylight(rng),
        camera,
        lambda t: 1.0 + 0.07 * np.sin(0.9 * t + 1),
        seed=2,
    )
