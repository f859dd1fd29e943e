"""A drive over a flat road with one object on it, as points: what sinks are told, with the truth known."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

import numpy as np

from ifsvideo.objects.history import ObjectHistory
from ifsvideo.types import Scene, VideoInfo

FPS = 25
INFO = VideoInfo(640, 360, Fraction(FPS))
FOCAL, HEIGHT = 500.0, 1.3

Pose = tuple[float, float, float]
"""Where an object's middle stands, metres right of and ahead of the camera's start, and its turn, radians."""


def box(width: float = 1.8, high: float = 1.5, length: float = 4.0) -> np.ndarray:
    """Points (N, 3) on the sides of a car; its middle is the origin, y down, standing on y = 0."""
    x, y, z = (np.linspace(-0.5, 0.5, 7) * width, -np.linspace(0.05, 1, 5) * high, np.linspace(-0.5, 0.5, 9))
    ends = [[a, b, c * length] for a in x for b in y for c in (-0.5, 0.5)]
    sides = [[a * width, b, c * length] for a in (-0.5, 0.5) for b in y for c in z]
    return np.array(ends + sides)


def drive(
    pose: Callable[[float], Pose],
    seconds: float = 4.0,
    speed: float = 12.0,
    *,
    label: Callable[[float], int] = lambda t: 1,
    hidden: Callable[[float], bool] = lambda t: False,
    noise: float = 0.1,
    points: np.ndarray | None = None,
) -> list[Scene]:
    """The scenes of a drive straight ahead at ``speed``; tracks of the object have ids from 100000 on.

    ``label`` is that of the object's points and ``hidden`` whether they are out of sight, by time.
    """
    rng = np.random.default_rng(5)
    length = speed * seconds + 80.0
    ground = np.column_stack(
        [rng.uniform(-14, 14, 4000), np.full(4000, HEIGHT), rng.uniform(-4, length, 4000)]
    )
    body = box() if points is None else points
    scenes = []
    for frame in range(round(seconds * FPS)):
        t = frame / FPS
        x, z, turn = pose(t)
        c, s = np.cos(turn), np.sin(turn)
        placed = body @ np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]) + [x, HEIGHT, z]
        world = np.concatenate([ground, placed]) - [0, 0, speed * t]
        ids = np.concatenate([np.arange(4000), 100_000 + np.arange(len(body))])
        labels = np.concatenate([np.zeros(4000, int), np.full(len(body), label(t))])
        shown = (world[:, 2] > 0.6) & ~(hidden(t) & (ids >= 100_000))
        near = np.where(shown, world[:, 2], 1.0)
        xy = FOCAL * world[:, :2] / near[:, None] + [319.5, 150.0] + rng.normal(0, noise, (len(world), 2))
        shown &= ((xy > 7) & (xy < [632, 352])).all(axis=1)
        scenes.append(
            Scene(
                frame, t, ids[shown], xy[shown].astype(np.float32), labels[shown].astype(np.int32), xy[None]
            )
        )
    return scenes


def history(scenes: list[Scene]) -> ObjectHistory:
    """What is gathered of these scenes."""
    found = ObjectHistory(INFO)
    for scene in scenes:
        found.add(scene, None)
    found.finish()
    return found
