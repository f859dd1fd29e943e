"""Things of a room: printed boxes, books, a shelf, pictures on a wall."""

from __future__ import annotations

import cv2
import numpy as np

from renderer.geometry import Array, Face, box, moved, pose
from renderer.paint import Colour, Generator, Picture, noise, plain, shade, speckle, to_picture

PPM = 700


def carton(rng: Generator, size: tuple[float, float, float], colour: Colour, title: str) -> tuple[Face, ...]:
    """A printed box: title, picture, table of small print, bar code; each side differs."""
    x, y, z = size
    front, back = (_print(rng, x, y, colour, title) for _ in range(2))
    left, right = (_label(rng, z, y, colour) for _ in range(2))
    top = _label(rng, x, z, colour)
    return box(
        size,
        {
            "front": front,
            "back": shade(back, 0.94),
            "left": shade(left, 0.78),
            "right": shade(right, 0.86),
            "top": shade(top, 1.08),
        },
    )


def books(rng: Generator, count: int, place: Array) -> tuple[Face, ...]:
    """A row of standing books, along x from the pose's origin."""
    faces: list[Face] = []
    x = 0.0
    for _ in range(count):
        size = (
            float(rng.uniform(0.022, 0.05)),
            float(rng.uniform(0.19, 0.27)),
            float(rng.uniform(0.14, 0.19)),
        )
        colour = tuple(float(c) for c in rng.uniform(40, 205, 3))
        spine = _spine(rng, size, (colour[0], colour[1], colour[2]))
        cover = plain(rng, (60, 50), (colour[0], colour[1], colour[2]), 5)
        pages = plain(rng, (30, 30), (226, 220, 204), 6, 0.4)
        book = box(
            size, {"front": spine, "left": shade(cover, 0.8), "right": shade(cover, 0.9), "top": pages}
        )
        faces += [moved(f, pose((x + size[0] / 2, 0, 0))) for f in book]
        x += size[0] + 0.002
    return tuple(moved(face, place) for face in faces)


def painting(rng: Generator, width: float, height: float) -> Picture:
    """A framed abstract picture."""
    h, w = int(height * 300), int(width * 300)
    canvas = to_picture(np.array([188, 178, 150]) + 22 * noise(rng, (h, w), 2.2)[..., None])
    speckle(rng, canvas, 26, (8, 34), 0.6)
    for _ in range(14):
        points = rng.uniform(0, 1, (3, 2)) * [w, h]
        cv2.fillPoly(canvas, [points.astype(np.int32)], rng.uniform(30, 220, 3).tolist())
    cv2.rectangle(canvas, (0, 0), (w - 1, h - 1), (52, 38, 28), 16)
    cv2.rectangle(canvas, (10, 10), (w - 11, h - 11), (214, 196, 150), 3)
    return canvas


def wallpaper(rng: Generator, shape: tuple[int, int]) -> Picture:
    """Faintly striped and flowered, with stains."""
    h, w = shape
    wall = plain(rng, shape, (186, 192, 178), 3, 1.7)
    for x in range(0, w, 56):
        wall[:, x : x + 20] = to_picture(wall[:, x : x + 20] * 0.93)
        for y in range((x // 56 % 2) * 30, h, 60):
            at = (x + 38 + int(rng.normal(0, 1.5)), y + int(rng.normal(0, 1.5)))
            cv2.ellipse(wall, at, (6, 3), float(rng.uniform(0, 180)), 0, 360, (138, 118, 106), -1)
            cv2.circle(wall, (at[0], at[1] - 5), 3, (162, 96, 92), -1)
    return wall


def _print(rng: Generator, width: float, height: float, colour: Colour, title: str) -> Picture:
    h, w = int(height * PPM), int(width * PPM)
    picture = plain(rng, (h, w), colour, 2.5)
    picture[: int(0.3 * h)] = to_picture(picture[: int(0.3 * h)] * 0.55)
    scale = min(0.85 * w / (19 * len(title)), 0.16 * h / 22)
    cv2.putText(
        picture, title, (int(0.06 * w), int(0.2 * h)), cv2.FONT_HERSHEY_SIMPLEX, scale, (248, 244, 230), 3
    )
    for _ in range(16):
        at = (int(rng.uniform(0.15, 0.85) * w), int(rng.uniform(0.42, 0.72) * h))
        tint = rng.uniform(20, 245, 3).tolist()
        cv2.ellipse(
            picture,
            at,
            (int(rng.uniform(4, 18)), int(rng.uniform(4, 14))),
            float(rng.uniform(0, 180)),
            0,
            360,
            tint,
            -1,
        )
    for k in range(4):
        y = int((0.8 + 0.045 * k) * h)
        for x in np.arange(0.08 * w, 0.6 * w, 9):
            if rng.random() < 0.8:
                cv2.rectangle(picture, (int(x), y), (int(x + rng.uniform(3, 8)), y + 3), (30, 28, 30), -1)
    cv2.rectangle(
        picture, (int(0.68 * w), int(0.78 * h)), (int(0.94 * w), int(0.96 * h)), (244, 244, 240), -1
    )
    for x in np.arange(0.7 * w, 0.92 * w, 4):
        cv2.line(
            picture, (int(x), int(0.8 * h)), (int(x), int(0.93 * h)), (20, 20, 22), int(rng.integers(1, 3))
        )
    cv2.rectangle(picture, (0, 0), (w - 1, h - 1), (46, 40, 38), 3)
    return picture


def _label(rng: Generator, width: float, height: float, colour: Colour) -> Picture:
    h, w = max(int(height * PPM), 8), max(int(width * PPM), 8)
    picture = plain(rng, (h, w), (colour[0] * 0.85, colour[1] * 0.85, colour[2] * 0.85), 2.5)
    for k in range(4):
        corner = (int(rng.uniform(0.05, 0.6) * w), int((0.06 + 0.23 * k) * h))
        far = (int(corner[0] + rng.uniform(0.2, 0.38) * w), int(corner[1] + 0.15 * h))
        cv2.rectangle(
            picture, corner, far, rng.choice([[240, 238, 228], [40, 40, 46], [232, 190, 60]]).tolist(), -1
        )
        cv2.circle(
            picture,
            ((corner[0] + far[0]) // 2, (corner[1] + far[1]) // 2),
            max(h // 30, 2),
            (170, 40, 44),
            -1,
        )
    cv2.rectangle(picture, (0, 0), (w - 1, h - 1), (46, 40, 38), 3)
    return picture


def _spine(rng: Generator, size: tuple[float, float, float], colour: Colour) -> Picture:
    h, w = int(size[1] * PPM), max(int(size[0] * PPM), 6)
    picture = plain(rng, (h, w), colour, 3)
    for y in rng.uniform(0.05, 0.9, 3):
        cv2.rectangle(
            picture,
            (0, int(y * h)),
            (w, int(y * h) + int(rng.uniform(3, 12))),
            rng.uniform(90, 250, 3).tolist(),
            -1,
        )
    for y in np.arange(0.3 * h, 0.7 * h, 9):
        cv2.rectangle(
            picture, (w // 3, int(y)), (2 * w // 3, int(y + rng.uniform(3, 7))), (240, 236, 222), -1
        )
    cv2.rectangle(picture, (0, 0), (w - 1, h - 1), (28, 26, 26), 2)
    return picture
