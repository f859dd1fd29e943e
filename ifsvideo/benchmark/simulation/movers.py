"""Draws boxes that move: vehicles and walkers on a road, things on a table or a floor."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np

from ifsvideo.benchmark.simulation.geometry import Array, Box, Scene
from ifsvideo.benchmark.simulation.paths import drive, integral, wobble
from ifsvideo.benchmark.simulation.scenes import clear_of
from ifsvideo.types import Bools

_ATTEMPTS = 12
LEAST_SHIFT = 3.0
"""Pixels by which a mover must at some time be away from where it would be had it stood."""
_LEAST_SIDE = 12.0
"""Pixels of the smaller side of a mover's outline in the middle frame: less does not hold five tracks."""
_HALVES = {
    "car": ((0.8, 0.65, 1.8), (1.0, 0.85, 2.5)),
    "van": ((0.9, 0.9, 2.2), (1.1, 1.25, 3.0)),
    "lorry": ((1.15, 1.3, 3.0), (1.3, 1.9, 7.0)),
    "walker": ((0.2, 0.75, 0.15), (0.35, 0.95, 0.3)),
    "cyclist": ((0.25, 0.8, 0.75), (0.35, 0.95, 0.95)),
}
_MANNERS = ("oncoming", "overtaking", "following", "crossing", "turning", "starting", "spinning", "sliding")
_MANNER_SHARES = (0.17, 0.15, 0.25, 0.17, 0.1, 0.08, 0.03, 0.05)


def add_movers(rng: np.random.Generator, scene: Scene, wanted: int) -> Scene:
    """The scene with up to ``wanted`` movers in view; what stands in their way is taken out."""
    movers: list[Box] = []
    propose = _on_table if scene.kind == "hand-held" else _on_road
    for _ in range(_ATTEMPTS * wanted):
        mover = propose(rng, scene)
        if len(movers) < wanted and _fits(scene, mover) and all(_apart(mover, other) for other in movers):
            movers.append(mover)
    still = (box for box in scene.boxes if all(_gives_way(box, mover) for mover in movers))
    return replace(scene, boxes=(*still, *movers))


def shift_against_still(scene: Scene, places: Array, visible: Bools) -> Array:
    """Pixels (P,) between where points (F, P, 3) are seen and where they would be, had they stood still.

    They stand where they were first seen; the largest distance over the frames in which they are seen.
    """
    first = places[visible.argmax(axis=0), np.arange(places.shape[1])]
    gap = np.linalg.norm(scene.camera.project(places) - scene.camera.project(first), axis=2)
    return np.asarray(np.where(visible & np.isfinite(gap), gap, 0).max(axis=0))


def _fits(scene: Scene, mover: Box) -> bool:
    """Whether it is seen for more than half of the window, large enough, and moves; clear of the camera."""
    signs = np.array(list(itertools.product((-1, 1), repeat=3)))
    corners = mover.to_world(signs * mover.half)
    outline = scene.camera.project(corners)
    middle = outline[len(outline) // 2]
    if not (np.isfinite(middle).all() and clear_of(mover, scene.camera.centres, 0.5)):
        return False
    size = np.array(scene.camera.size)
    centre = outline.mean(axis=1)
    inside = ((centre > 0) & (centre < size)).all(axis=1)  # a NaN is not inside
    shift = shift_against_still(scene, corners, np.asarray(np.isfinite(outline).all(axis=2)))
    sides = np.ptp(middle, axis=0)
    fills = (sides / size).min() > 0.9
    return bool(
        inside.mean() > 0.6 and sides.min() > _LEAST_SIDE and not fills and np.median(shift) > LEAST_SHIFT
    )


def _apart(mover: Box, other: Box) -> bool:
    """Whether two movers never come nearer than their half diagonals in the plane."""
    gap = np.linalg.norm((mover.centres - other.centres)[:, [0, 2]], axis=1)
    return bool(gap.min() > np.hypot(*mover.half[[0, 2]]) + np.hypot(*other.half[[0, 2]]))


def _gives_way(box: Box, mover: Box) -> bool:
    """Whether a standing box may stay: what the mover stands on may, what it would drive through may not."""
    below = box.centres[0, 1] - box.half[1] >= mover.centres[0, 1] + mover.half[1] - 1e-6
    return bool(below) or clear_of(box, mover.centres, float(mover.half[[0, 2]].max()))


def _on_road(rng: np.random.Generator, scene: Scene) -> Box:
    """A vehicle or a walker with one of eight manners of moving."""
    camera, frames = scene.camera, len(scene.camera.centres)
    step = 1 / scene.fps
    time = np.arange(frames, dtype=np.float64) * step
    manner = str(rng.choice(_MANNERS, p=_MANNER_SHARES))
    shares = [0.5, 0.15, 0.15, 0.0, 0.2] if manner in ("oncoming", "overtaking", "following") else None
    shape = str(rng.choice(list(_HALVES), p=shares or [0.4, 0.1, 0.1, 0.28, 0.12]))
    low, high = np.array(_HALVES[shape])
    half = low + (high - low) * rng.random(3)
    path = np.gradient(camera.centres, step, axis=0)
    own_speed = np.asarray(np.hypot(path[:, 0], path[:, 2]), dtype=np.float64)
    speed, yaw, slip = _manner(rng, time, manner, own_speed, shape == "walker")
    place = _place_on_road(rng, scene, manner, half)
    place[1] = scene.ground - half[1]
    centres = drive(speed, yaw, step, slip) + place
    texture = rng.uniform(0.3, 1.0)
    return Box(half, centres, yaw, texture, moves=True)


def _manner(
    rng: np.random.Generator, time: Array, manner: str, own_speed: Array, walks: bool
) -> tuple[Array, Array, float]:
    """Speed (F,), heading (F,) and slip angle; the road heads along z in the middle frame."""
    steady, step = np.ones_like(time), float(time[1] - time[0])
    top = rng.uniform(0.8, 2.2) if walks else rng.uniform(2, 18)
    any_heading = rng.uniform(-np.pi, np.pi)
    speed, heading, slip = top * steady, steady * rng.normal(0, 0.04), 0.0
    if manner == "oncoming":
        heading = heading + np.pi
    elif manner == "overtaking":
        speed = np.maximum(own_speed + rng.choice([-1, 1]) * rng.uniform(1, 8), 0.5)
    elif manner == "following":  # at a gap that hardly changes: seen as a far point would be
        speed = np.maximum(own_speed + rng.normal(0, 0.6) + wobble(rng, time, 0.3, 0.2, 1), 0)
        speed = np.maximum(speed, rng.uniform(0, 1.5))
    elif manner == "crossing":
        speed, heading = speed * (1.0 if walks else 0.6), heading + rng.choice([-1, 1]) * np.pi / 2
    elif manner == "turning":
        rate = rng.choice([-1, 1]) * rng.uniform(0.2, 0.8) + wobble(rng, time, 0.1, 0.2, 1)
        speed, heading = speed * 0.5, any_heading + integral(rate, step)
    elif manner == "starting":  # or stopping, with the sign
        change = rng.choice([-1, 1]) * rng.uniform(1.5, 5) * (0.4 if walks else 1.0)
        speed = np.maximum(change * (time - rng.uniform(0, time[-1])), 0)
        heading = heading + rng.choice([0, np.pi, any_heading])
    elif manner == "spinning":
        speed = 0 * steady
        heading = any_heading + integral(rng.choice([-1, 1]) * rng.uniform(0.3, 1.5) * steady, step)
    else:
        slip = rng.uniform(-np.pi, np.pi)
        heading = any_heading + integral(rng.normal(0, 0.3) * steady, step)
    return speed, heading, slip


def _place_on_road(rng: np.random.Generator, scene: Scene, manner: str, half: Array) -> Array:
    """Where a mover is in the middle frame, when the camera is at zero: on its lane, or anywhere in view."""
    away = float(half[2] + rng.uniform(3, 8) + rng.exponential(9))
    if scene.kind == "road" and manner in ("oncoming", "overtaking", "following"):
        lane = rng.normal(0, 0.4) if manner == "following" else rng.choice([-1, 1]) * rng.uniform(2.5, 5)
        return np.array([lane, 0.0, away])
    camera = scene.camera
    pixel = np.array([[rng.uniform(0.1, 0.9) * camera.size[0], camera.size[1] / 2]])
    ray = camera.rays(len(camera.centres) // 2, pixel)[0] * [1, 0, 1]
    return np.asarray(away * ray / np.linalg.norm(ray))


def _on_table(rng: np.random.Generator, scene: Scene) -> Box:
    """A box that slides, turns, or both, on the ground or on any standing box that is wide enough."""
    camera, frames = scene.camera, len(scene.camera.centres)
    step = 1 / scene.fps
    time = np.arange(frames, dtype=np.float64) * step
    pixel = rng.uniform(0.15, 0.85, (1, 2)) * camera.size
    middle = frames // 2
    place = _below(scene, camera.centres[middle], camera.rays(middle, pixel)[0], middle)
    away = float(np.linalg.norm(place - camera.centres[middle]))
    half = rng.uniform(0.35, 1.0, 3) * away * rng.uniform(0.05, 0.16)
    place[1] -= half[1]
    slides, turns = ((True, False), (True, True), (False, True))[rng.integers(3)]
    speed = slides * away * rng.uniform(0.03, 0.3) * np.ones(frames)
    if rng.random() < 0.3:  # pushed, or left to stop
        speed = speed * np.clip(rng.choice([-3, 3]) * (time - rng.uniform(0.2, 0.8) * time[-1]), 0, 1.5)
    rate, aim = rng.choice([-1, 1]) * rng.uniform(0.3, 2.0), rng.uniform(-np.pi, np.pi)
    yaw = aim + integral(turns * rate + turns * wobble(rng, time, 0.2, 0.3, 2), step)
    course = rng.uniform(-np.pi, np.pi) + integral(np.full(frames, rng.normal(0, 0.5)), step)
    centres = drive(speed + wobble(rng, time, 0.05, 0.5, 2) * speed, course, step) + place
    return Box(half, centres, yaw, rng.uniform(0.4, 1.0), moves=True)


def _below(scene: Scene, origin: Array, ray: Array, frame: int) -> Array:
    """Where a ray meets the upper side of a table, or else the ground (at most 8 m away)."""
    down = max(float(ray[1]), 0.05)
    for box in scene.boxes:
        top = box.centres[0, 1] - box.half[1]
        place = origin + ray * (top - origin[1]) / down
        own = np.abs(box.to_own((place - box.centres[frame])[None], frame))[0]
        if top > origin[1] and (own[[0, 2]] < 0.9 * box.half[[0, 2]]).all() and box.half[[0, 2]].min() > 0.3:
            return np.asarray(place)
    reach = min((scene.ground - origin[1]) / down, 8 / float(np.linalg.norm(ray)))
    return np.array([origin[0] + reach * ray[0], scene.ground, origin[2] + reach * ray[2]])
