"""A dashcam drive on a bending street; a van comes towards us, a car overtakes on the left and cuts in."""

from __future__ import annotations

import numpy as np

from renderer.cars import HATCH, VAN, car, car_shadow
from renderer.film import Scene, bump, smoothstep, wobble
from renderer.geometry import Array, Body, pose
from renderer.road import Course, Strip, ground
from renderer.scenes.block import Side, block, daylight

FPS, FRAMES = 25, 130
SPEED = 13.0
LANES = (-1.75, 1.75, 5.25)


def build() -> Scene:
    """The scene."""
    rng = np.random.default_rng(11)
    course = Course(radius=330.0, limit=0.4)
    strip = Strip((-6.2, 9.2), (-9.0, 11.8), dashes=(3.5,), solid=(-3.6, 7.0), double=(0.0,))
    left = Side(-10.0, trees=-7.6, poles=-6.7, cars=-4.9)
    right = Side(13.0, trees=10.9, poles=9.7, cars=8.1)
    street = block(rng, course, (left, right), (-4.0, 210.0))
    shake = [
        wobble(rng, a, f) for a, f in (((0.0022), (1.3, 2.9, 7.1)), (0.001, (0.9, 5.3)), (0.0015, (1.1, 3.7)))
    ]
    heave = wobble(rng, 0.008, (1.6, 3.3))

    def camera(t: float) -> Array:
        z = SPEED * t
        yaw = course.heading(z) + 0.012 * np.sin(0.9 * t) + shake[1](t)
        pitch = -0.012 + shake[0](t) + bump(t, 1.15, 0.009) + bump(t, 3.6, -0.007)
        x = float(course.offset(z)) + LANES[2] + 0.12 * np.sin(0.7 * t)
        return pose((x, -1.32 + heave(t) - bump(t, 1.15, 0.02), z), yaw, pitch, shake[2](t))

    def oncoming(t: float) -> Array:
        # From 4 m/s it speeds up and swings out; a steady car on a bend could pass for a nearer parked one.
        z = 52.5 - 4.0 * t - 5.5 / 2 * max(t - 0.3, 0.0) ** 2
        step = 0.02
        before, now, after = (
            smoothstep(t + dt, 0.2, 1.1) - smoothstep(t + dt, 1.2, 2.3) for dt in (-step, 0.0, step)
        )
        swing = 1.6
        steer = (after - before) * swing / (2 * step) / 8.0
        return course.at(z, LANES[0] - 0.15 + swing * now, np.pi - float(np.arctan(steer)))

    def overtaking(t: float) -> Array:
        since = t - 1.3
        ahead = -0.5 + 4.8 * since + 0.9 * (1 - np.cos(0.9 * since)) - 0.35 * max(since - 2.5, 0) ** 2
        step = 0.02
        before, now, after = (smoothstep(t + dt, 3.0, 4.9) for dt in (-step, 0.0, step))
        lateral = LANES[1] - 0.1 + (LANES[2] - LANES[1]) * now
        steer = (after - before) * (LANES[2] - LANES[1]) / (2 * step) / (SPEED + 4.5)
        return course.at(SPEED * t + ahead, lateral, float(np.arctan(steer)))

    red = car(rng, VAN, (168, 32, 34), "KX 4071", "1.8i")
    orange = car(rng, HATCH, (224, 112, 26), "MB 2659", "GT")
    bodies = (
        street,
        Body(red, 1, "oncoming van", oncoming, car_shadow(VAN)),
        Body(orange, 2, "overtaking car", overtaking, car_shadow(HATCH)),
        ground(rng, course, strip),
    )
    return Scene(
        "dashcam_drive",
        FRAMES,
        FPS,
        640.0,
        bodies,
        daylight(rng),
        camera,
        lambda t: 1.02 + 0.09 * np.sin(1.1 * t),
        seed=1,
    )
