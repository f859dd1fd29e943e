"""From a scene to frames and their truth: exposure in several instants, shake, drift, sensor noise."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.geometry import Array, Body
from renderer.raster import Backdrop, Canvas

SIZE = (640, 360)
# Five instants of an exposure: sub-pixel offsets that differ in row and column; the middle one is the pixel
# centre at mid-exposure.
INSTANTS = (-0.4, -0.2, 0.0, 0.2, 0.4)
JITTER = ((-0.2, 0.4), (0.4, 0.2), (0.0, 0.0), (-0.4, -0.2), (0.2, -0.4))


@dataclass(frozen=True)
class Scene:
    """A clip: what is in it, and the camera.

    ``camera(t)`` is camera-to-world (4, 4); ``exposure(t)`` a gain near 1; ``shutter`` the part of a
    frame's time that the shutter is open; ``noise`` the sensor's standard deviation in grey values.
    """

    name: str
    frames: int
    fps: int
    focal: float
    bodies: tuple[Body, ...]
    backdrop: Backdrop
    camera: Callable[[float], Array]
    exposure: Callable[[float], float]
    shutter: float = 0.22
    noise: float = 2.0
    seed: int = 0
    crf: int = 24

    @property
    def K(self) -> Array:
        """Camera matrix (3, 3)."""
        w, h = SIZE
        return np.array([[self.focal, 0, (w - 1) / 2], [0, self.focal, (h - 1) / 2], [0, 0, 1.0]])


@dataclass(frozen=True)
class Frame:
    """A picture (H, W, 3) uint8 with the labels (H, W) and depths (H, W, 0 = infinite) of mid-exposure."""

    picture: NDArray[np.uint8]
    labels: NDArray[np.uint8]
    depth: NDArray[np.float32]


def shoot(scene: Scene, every: int = 1) -> Iterator[Frame]:
    """Render the scene's frames in order, ``every`` n-th of them."""
    falloff = _vignette()
    for index in range(0, scene.frames, every):
        rng = np.random.default_rng((scene.seed, index))
        light = np.zeros((SIZE[1], SIZE[0], 3), np.float32)
        for instant, jitter in zip(INSTANTS, JITTER, strict=True):
            t = index / scene.fps + instant * scene.shutter / scene.fps
            canvas = Canvas(scene.K, SIZE, np.linalg.inv(scene.camera(t)), jitter)
            canvas.draw(scene.bodies, t)
            if instant == 0.0:
                labels, w = canvas.labels, canvas.inverse_depth.copy()
            canvas.backdrop(scene.backdrop)
            light += canvas.colour / len(INSTANTS)
        light *= (scene.exposure(index / scene.fps) * falloff)[..., None]
        light += scene.noise * rng.standard_normal(light.shape[:2], np.float32)[..., None]
        light += 0.5 * scene.noise * rng.standard_normal(light.shape, np.float32)
        depth = np.where(w > 0, 1 / np.maximum(w, 1e-6), 0).astype(np.float32)
        yield Frame(np.clip(np.rint(_shoulder(light)), 0, 255).astype(np.uint8), labels, depth)


def wobble(rng: np.random.Generator, amplitude: float, hertz: Sequence[float]) -> Callable[[float], float]:
    """A smooth, never repeating disturbance: a sine a frequency, about ``amplitude`` in all, zero mean."""
    phase = rng.uniform(0, 2 * np.pi, len(hertz))
    weight = amplitude * np.sqrt(2 / len(hertz)) * rng.uniform(0.7, 1.3, len(hertz))
    angular = 2 * np.pi * np.asarray(hertz)
    return lambda t: float(np.sum(weight * np.sin(angular * t + phase)))


def bump(t: float, at: float, size: float, hertz: float = 2.2, decay: float = 3.0) -> float:
    """A car's answer to a bump in the road at time ``at``: a damped oscillation."""
    dt = t - at
    return 0.0 if dt < 0 else float(size * np.exp(-decay * dt) * np.sin(2 * np.pi * hertz * dt))


def smoothstep(t: float, start: float, end: float) -> float:
    """0 before ``start``, 1 after ``end``, with no jump in speed or acceleration between."""
    x = float(np.clip((t - start) / (end - start), 0, 1))
    return x**3 * (x * (6 * x - 15) + 10)


def _vignette() -> NDArray[np.float32]:
    y, x = np.mgrid[-1 : 1 : SIZE[1] * 1j, -1 : 1 : SIZE[0] * 1j]
    return (1 - 0.13 * (x**2 + 0.6 * y**2) ** 1.5).astype(np.float32)


def _shoulder(light: NDArray[np.float32]) -> NDArray[np.float32]:
    # Highlights roll off as in a camera instead of clipping hard.
    return np.where(light < 200, light, 200 + 55 * np.tanh((light - 200) / 70))
