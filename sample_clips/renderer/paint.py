"""Procedural materials: noise, walls, foliage, wood, sky. All pictures are (H, W, 3 or 4) uint8, RGB(A)."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.uint8]
Colour = tuple[float, float, float]
Generator = np.random.Generator


def noise(rng: Generator, shape: tuple[int, int], beta: float) -> NDArray[np.float32]:
    """Periodic noise with spectrum 1 / f^beta, zero mean, unit deviation, of ``shape`` (H, W)."""
    fy = np.fft.fftfreq(shape[0])[:, None] * shape[0]
    fx = np.fft.rfftfreq(shape[1])[None, :] * shape[1]
    f = np.hypot(fy / shape[0], fx / shape[1]) * max(shape)
    f[0, 0] = np.inf
    spectrum = np.fft.rfft2(rng.standard_normal(shape, np.float32)) * f ** (-beta / 2)
    field = np.fft.irfft2(spectrum, shape)
    return (field / field.std()).astype(np.float32)


def to_picture(values: NDArray[np.float32]) -> Picture:
    """Clip to 0..255 and round."""
    return np.clip(np.rint(values), 0, 255).astype(np.uint8)


def plain(
    rng: Generator, shape: tuple[int, int], colour: Colour, grain: float = 4.0, beta: float = 1.2
) -> Picture:
    """A surface of one colour with stains and grain."""
    stain = noise(rng, shape, beta)[..., None]
    return to_picture(np.asarray(colour, np.float32) * (1 + 0.01 * grain * stain))


def shade(picture: Picture, gain: float) -> Picture:
    """The picture made darker or lighter; opacity stays."""
    out = picture.copy()
    out[..., :3] = to_picture(picture[..., :3].astype(np.float32) * gain)
    return out


def speckle(rng: Generator, picture: Picture, count: int, size: tuple[float, float], contrast: float) -> None:
    """Scatter small elliptic stones, leaves and stains over a picture, in place; sizes in pixels."""
    h, w = picture.shape[:2]
    for x, y, a, b, angle, gain in zip(
        rng.uniform(0, w, count),
        rng.uniform(0, h, count),
        rng.uniform(*size, count),
        rng.uniform(*size, count),
        rng.uniform(0, 180, count),
        rng.choice([-1, 1], count) * rng.uniform(0.4, 1, count) * contrast,
        strict=True,
    ):
        colour = picture[int(y), int(x), :3].astype(float) * (1 + gain)
        axes = (max(int(a), 1), max(int(b), 1))
        cv2.ellipse(picture, (int(x), int(y)), axes, angle, 0, 360, [*np.clip(colour, 0, 255), 255], -1)


def bricks(rng: Generator, shape: tuple[int, int], colour: Colour, course: int = 6) -> Picture:
    """A brick wall, ``course`` pixels high each."""
    h, w = shape
    long = 3 * course
    rows, columns = h // course + 2, w // long + 3
    tone = 1 + 0.13 * rng.standard_normal((rows, columns)).astype(np.float32)
    y, x = np.mgrid[0:h, 0:w]
    row = y // course
    shifted = x + (row % 2) * (long // 2)
    joint = (y % course == 0) | (shifted % long == 0)
    gain = tone[row, shifted // long] * (1 + 0.05 * noise(rng, shape, 1.5))
    wall = np.asarray(colour, np.float32) * gain[..., None]
    wall[joint] = 0.5 * wall[joint] + 0.5 * np.array([190, 184, 174])
    return to_picture(wall)


def leaves(rng: Generator, side: int, colour: Colour, fill: float = 0.62) -> Picture:
    """A clump of foliage with a ragged outline (RGBA, square)."""
    picture = np.zeros((side, side, 4), np.uint8)
    picture[..., :3] = to_picture(np.asarray(colour, np.float32) * 0.55)
    count = int(500 * fill)
    radius = 0.46 * side * np.sqrt(rng.uniform(0, 1, count))
    angle = rng.uniform(0, 2 * np.pi, count)
    for k, (r, a) in enumerate(zip(radius, angle, strict=True)):
        x, y = side / 2 + r * np.cos(a), side / 2 + r * np.sin(a)
        light = 0.45 + 0.75 * k / count + 0.25 * (0.5 - y / side) + 0.12 * rng.standard_normal()
        tint = np.clip(np.asarray(colour) * light + rng.normal(0, 5, 3), 0, 255)
        axes = (max(int(side * rng.uniform(0.025, 0.06)), 1), max(int(side * rng.uniform(0.015, 0.035)), 1))
        cv2.ellipse(picture, (int(x), int(y)), axes, rng.uniform(0, 180), 0, 360, [*tint, 255], -1)
    return picture


def wood(rng: Generator, shape: tuple[int, int], colour: Colour, planks: int) -> Picture:
    """Boards along x with grain, knots and dark joints."""
    h, w = shape
    board = h // planks
    grain = cv2.resize(noise(rng, (h, max(w // 12, 8)), 0.7), (w, h), interpolation=cv2.INTER_CUBIC)
    tone = np.repeat(1 + 0.11 * rng.standard_normal(planks + 1), board)[:h, None].astype(np.float32)
    stain = 0.05 * noise(rng, shape, 1.6)
    out = np.asarray(colour, np.float32) * (tone * (1 + 0.09 * grain + stain))[..., None]
    picture = to_picture(out)
    for _ in range(planks * 7):
        centre = (int(rng.uniform(0, w)), int(rng.uniform(0, h)))
        size = rng.uniform(0.05, 0.14) * board
        for ring in (1.0, 0.6, 0.3):
            tint = np.asarray(colour) * (0.35 + 0.35 * ring)
            axes = (max(int(1.8 * size * ring), 1), max(int(size * ring), 1))
            cv2.ellipse(picture, centre, axes, 0, 0, 360, tint, -1, cv2.LINE_AA)
    for k in range(planks + 1):
        cv2.line(picture, (0, k * board), (w, k * board), (45, 32, 22), 2)
        for x in rng.uniform(0, w, 2):
            cv2.line(picture, (int(x), k * board), (int(x), (k + 1) * board), (45, 32, 22), 2)
    return picture


def panorama(rng: Generator, sky: tuple[Colour, Colour], hill: Colour, low: float, high: float) -> Picture:
    """Sky with clouds and two ranges of hills: all round, elevations ``high`` down to ``low``, radians."""
    w = 4096
    h = int(w * (high - low) / (2 * np.pi))
    elevation = np.linspace(high, low, h, dtype=np.float32)[:, None]
    up = np.clip(elevation / 0.5, 0, 1)[..., None]
    top, horizon = (np.asarray(c, np.float32) for c in sky)
    out = horizon + (top - horizon) * up**0.6
    cloud = noise(rng, (512, w), 2.6)[: h if h < 512 else 512]
    cloud = cv2.resize(cloud, (w, h), interpolation=cv2.INTER_CUBIC)
    cover = np.clip((cloud - 0.1) * 0.75, 0, 0.9)[..., None] * np.clip(up * 5, 0, 1)
    out = out + cover * (
        np.array([250, 250, 252], np.float32) - 22 * np.clip(cloud, 0, 2)[..., None] ** 2 - out
    )
    for height, depth, seed_beta in ((0.075, 0.35, 2.2), (0.045, 0.75, 1.8)):
        ridge = height * (1 + 0.35 * noise(rng, (8, w), seed_beta)[0])
        texture = noise(rng, (h, w), 1.6)[..., None]
        tint = horizon + (np.asarray(hill, np.float32) - horizon) * depth
        land = elevation < ridge[None, :]
        out = np.where(land[..., None], tint * (1 + 0.05 * texture), out)
    return to_picture(out)


def soft_shadow(strength: float, side: int = 64) -> Picture:
    """A soft dark blob: only the opacity matters (RGBA, square)."""
    y, x = np.mgrid[-1 : 1 : side * 1j, -1 : 1 : side * 1j]
    edge = np.clip((1 - np.maximum(np.abs(x), np.abs(y))) / 0.35, 0, 1)
    edge = edge * edge * (3 - 2 * edge)
    blob = np.zeros((side, side, 4), np.uint8)
    blob[..., 3] = to_picture((255 * strength * edge).astype(np.float32))
    return blob
