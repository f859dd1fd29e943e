"""How a camera and a vehicle go: speeds, bends, pitch and vibration over the frames of a window."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from ifsvideo.benchmark.simulation.geometry import Array


def wobble(rng: np.random.Generator, time: Array, amplitude: float, slowest: float, fastest: float) -> Array:
    """A smooth random course (F,) around zero: four sines between two frequencies (Hz), fast ones weak."""
    frequency = np.exp(rng.uniform(np.log(slowest), np.log(fastest), 4))
    weight = rng.normal(size=4) * np.sqrt(slowest / frequency)
    phase = rng.uniform(0, 2 * np.pi, 4)
    return np.asarray(
        amplitude * (np.sin(2 * np.pi * frequency * time[:, None] + phase) * weight).sum(axis=1) / np.sqrt(2)
    )


def integral(rate: Array, step: float) -> Array:
    """Sum over time of a rate (F, ...), zero in the middle frame."""
    total = np.cumsum(rate, axis=0) * step
    return np.asarray(total - total[len(total) // 2])


def drive(speed: Array, heading: Array, step: float, slip: float = 0.0) -> Array:
    """Places (F, 3) of what goes where it heads (plus ``slip``, radians), the middle one at zero."""
    course = heading + slip
    velocity = np.column_stack([speed * np.sin(course), np.zeros(len(speed)), speed * np.cos(course)])
    return integral(velocity, step)


def orientation(yaw: Array, pitch: Array, roll: Array) -> Array:
    """Rotations (F, 3, 3) from world to camera; yaw to the right, pitch upwards, radians."""
    turns = Rotation.from_euler("YXZ", np.column_stack([yaw, pitch, roll]))
    return np.asarray(turns.as_matrix().transpose(0, 2, 1))
