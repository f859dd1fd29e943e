"""What stands beside a road: houses, trees, poles, signs, hedges."""

from __future__ import annotations

import cv2
import numpy as np

from renderer.geometry import Array, Face, box, moved, polygon, pose, rectangle
from renderer.paint import (
    Colour,
    Generator,
    Picture,
    bricks,
    leaves,
    noise,
    plain,
    shade,
    soft_shadow,
    to_picture,
)

WALLS: tuple[Colour, ...] = (
    (158, 96, 74),
    (196, 178, 146),
    (140, 82, 66),
    (206, 200, 188),
    (176, 140, 104),
    (128, 122, 118),
    (190, 150, 130),
)
PPM = 40


def house(
    rng: Generator, width: float, depth: float, floors: int, place: Array, gable: bool = False
) -> tuple[Face, ...]:
    """A house with its front (-z side) at the pose's origin; ``place`` turns and moves it."""
    colour = WALLS[int(rng.integers(len(WALLS)))]
    brick = bool(rng.random() < 0.6)
    height = 3.1 * floors + 0.7
    front = facade(rng, width, height, floors, colour, brick, shop=bool(rng.random() < 0.5))
    side = facade(rng, depth, height, floors, colour, brick, shop=False)
    faces = list(
        box(
            (width, height, depth),
            {"front": front, "back": front, "left": shade(side, 0.8), "right": shade(side, 0.86)},
        )
    )
    tiles = shade(bricks(rng, (int(depth * PPM * 0.6), int(width * PPM)), (120, 74, 60), 10), 0.95)
    if gable:
        ridge, x, z = 0.42 * depth, width / 2, depth / 2
        e = 0.35
        slope = [
            (-x - e, -height + e, -z - e),
            (x + e, -height + e, -z - e),
            (x + e, -height - ridge, 0),
            (-x - e, -height - ridge, 0),
        ]
        faces.append(polygon(slope, tiles, closed=False))
        faces.append(polygon([(px, py, -pz) for px, py, pz in slope], tiles, closed=False))
        end = bricks(rng, (int(ridge * PPM), int(depth * PPM)), colour, 6)
        for px in (-x, x):
            triangle = [(px, -height, -z), (px, -height, z), (px, -height - ridge, 0.0)]
            faces.append(polygon(triangle, shade(end, 0.85), closed=False))
    forward = pose((0, 0, depth / 2))
    return tuple(moved(face, place @ forward) for face in faces)


def facade(
    rng: Generator, width: float, height: float, floors: int, colour: Colour, brick: bool, shop: bool
) -> Picture:
    """A wall with rows of windows, a door or a shop front, a cornice and stains."""
    h, w = int(height * PPM), int(width * PPM)
    wall = bricks(rng, (h, w), colour) if brick else plain(rng, (h, w), colour, 5, 1.4)
    count = max(int(width / rng.uniform(2.3, 3.0)), 1)
    step = w / count
    trim = np.clip(np.asarray(colour) * 1.25 + 20, 0, 255).tolist()
    size = (rng.uniform(1.0, 1.35), rng.uniform(1.45, 1.8))
    for floor in range(floors):
        base = h - int((3.1 * floor + 0.2) * PPM)
        if floor:
            cv2.rectangle(wall, (0, base - 4), (w, base + 5), trim, -1)
            cv2.line(wall, (0, base + 6), (w, base + 6), (70, 62, 56), 2)
        for k in range(count):
            centre = int((k + 0.5) * step)
            if floor == 0 and k == count // 2:
                _door(rng, wall, centre, base + int(0.2 * PPM))
            elif floor == 0 and shop:
                _shop(rng, wall, (int(k * step + 8), int((k + 1) * step - 8)), base)
            else:
                _window(rng, wall, centre, base - int(0.85 * PPM), size)
    cv2.rectangle(wall, (0, 0), (w, int(0.3 * PPM)), trim, -1)
    for x in range(0, w, 18):
        cv2.rectangle(wall, (x, int(0.3 * PPM)), (x + 8, int(0.42 * PPM)), (84, 74, 66), -1)
    dirt = 1 + 0.05 * noise(rng, (h, w), 2.2) - 0.12 * np.linspace(0, 1, h, dtype=np.float32)[:, None] ** 6
    return to_picture(wall * dirt[..., None])


def _window(rng: Generator, wall: Picture, centre: int, sill: int, size: tuple[float, float]) -> None:
    w, h = int(size[0] * PPM), int(size[1] * PPM)
    x0, y0 = centre - w // 2, sill - h
    if y0 < 2 or x0 < 2 or x0 + w + 2 > wall.shape[1]:
        return
    cv2.rectangle(wall, (x0 - 4, y0 - 5), (x0 + w + 4, sill + 2), (222, 216, 204), -1)
    cv2.rectangle(wall, (x0 - 8, sill), (x0 + w + 8, sill + 5), (186, 178, 166), -1)
    cv2.line(wall, (x0 - 8, sill + 6), (x0 + w + 8, sill + 6), (60, 54, 50), 2)
    pane = wall[y0:sill, x0 : x0 + w]
    tone = rng.uniform(38, 78)
    ramp = np.linspace(tone + 42, tone, h, dtype=np.float32)[:, None, None]
    pane[:] = to_picture(ramp + 9 * noise(rng, (h, w), 2.2)[..., None] + np.array([-7, 1, 8]))
    if rng.random() < 0.6:
        curtain = np.clip(rng.normal(200, 22, 3), 120, 240)
        part = int(w * rng.uniform(0.15, 0.32))
        pane[:, :part] = to_picture(0.75 * curtain + 0.25 * pane[:, :part])
        pane[:, w - part :] = to_picture(0.75 * curtain + 0.25 * pane[:, w - part :])
    if rng.random() < 0.35:
        pane[: int(h * rng.uniform(0.2, 0.6))] = to_picture(np.array([205, 200, 186]) + rng.normal(0, 4, 3))
    for x in (0, w // 2, w - 3):
        pane[:, x : x + 3] = (228, 224, 214)
    for y in (0, int(0.35 * h), h - 3):
        pane[y : y + 3] = (228, 224, 214)
    if rng.random() < 0.3:
        for _ in range(26):
            at = (int(rng.uniform(x0, x0 + w)), int(sill - rng.uniform(-3, 9)))
            tint = rng.choice([[190, 50, 70], [70, 120, 50], [80, 140, 60], [230, 190, 60]])
            cv2.circle(wall, at, 3, tint.tolist(), -1)


def _door(rng: Generator, wall: Picture, centre: int, base: int) -> None:
    w, h = int(1.1 * PPM), int(2.3 * PPM)
    tint = rng.choice([[46, 74, 60], [120, 40, 36], [44, 56, 96], [92, 62, 38]]).tolist()
    x0 = centre - w // 2
    cv2.rectangle(wall, (x0 - 6, base - h - 6), (x0 + w + 6, base), (206, 200, 190), -1)
    cv2.rectangle(wall, (x0, base - h), (x0 + w, base), tint, -1)
    for y in (0.08, 0.55):
        corner = (x0 + 7, base - h + int(y * h))
        cv2.rectangle(wall, corner, (x0 + w - 7, corner[1] + int(0.38 * h)), [c * 0.7 for c in tint], 2)
    cv2.rectangle(wall, (x0 + 9, base - h + 12), (x0 + w - 9, base - h + 30), (150, 168, 178), -1)
    cv2.circle(wall, (x0 + w - 8, base - h // 2), 3, (220, 190, 90), -1)


def _shop(rng: Generator, wall: Picture, columns: tuple[int, int], base: int) -> None:
    x0, x1 = columns
    y0, y1 = base - int(2.2 * PPM), base - int(0.35 * PPM)
    cv2.rectangle(wall, (x0, y0), (x1, y1), (44, 46, 50), -1)
    for _ in range(14):
        at = (int(rng.uniform(x0 + 6, x1 - 16)), int(rng.uniform(y0 + 20, y1 - 14)))
        far = (min(at[0] + int(rng.uniform(6, 24)), x1 - 4), min(at[1] + int(rng.uniform(6, 30)), y1 - 4))
        cv2.rectangle(wall, at, far, _muted(rng, 60, 230), -1)
    cv2.rectangle(wall, (x0, y0), (x1, y1), (210, 206, 196), 3)
    board = rng.choice([[150, 36, 40], [30, 84, 76], [36, 52, 110], [216, 170, 60]]).tolist()
    cv2.rectangle(wall, (x0 - 4, y0 - 16), (x1 + 4, y0 + 6), board, -1)
    name = str(rng.choice(["CAFE", "BOOKS", "BAKERY", "TAILOR", "FLOWERS", "OPTIK"]))
    cv2.putText(wall, name, (x0 + 6, y0 + 1), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (244, 240, 228), 2)


def tree(rng: Generator, height: float, place: Array) -> tuple[Face, ...]:
    """A trunk of two crossed boards and a crown of leafy clumps that face all ways; nothing of it sways."""
    trunk_h, radius = 0.45 * height, 0.27 * height
    bark = plain(rng, (120, 24), (92, 74, 58), 16, 0.8)
    bark[rng.integers(0, 120, 26), :] = (58, 46, 38)
    r = 0.022 * height + 0.04
    faces = list(box((2 * r, trunk_h + 0.8, 2 * r), {"side": bark}))
    green = np.array([86, 112, 52]) * rng.uniform(0.85, 1.15) + rng.normal(0, 6, 3)
    pictures = [leaves(rng, 160, (green[0], green[1], green[2])) for _ in range(3)]
    for k in range(13):
        direction = rng.normal(0, 1, 3)
        direction /= np.linalg.norm(direction)
        centre = np.array([0, -(trunk_h + 0.75 * radius), 0]) + direction * radius * rng.uniform(
            0.25, 0.72
        ) * [1, 0.85, 1]
        size = radius * rng.uniform(0.95, 1.35)
        gain = 0.72 + 0.4 * (0.5 - 0.5 * direction[1])
        clump = rectangle(
            (-size / 2, -size / 2, 0), (size, 0, 0), (0, size, 0), shade(pictures[k % 3], gain), closed=False
        )
        faces.append(
            moved(clump, pose(centre, rng.uniform(0, np.pi), rng.normal(0, 0.35), rng.uniform(0, 6)))
        )
    return tuple(moved(face, place) for face in faces)


def pole(rng: Generator, height: float, place: Array, arm: float = 0.0) -> tuple[Face, ...]:
    """A lamp post with bills and bands stuck to it."""
    picture = plain(rng, (int(height * 40), 24), (112, 116, 118), 6)
    for y in rng.integers(0, len(picture) - 30, int(height * 2)):
        cv2.rectangle(picture, (0, int(y)), (23, int(y) + int(rng.uniform(4, 26))), _muted(rng, 60, 220), -1)
    faces = list(box((0.16, height, 0.16), {"side": picture}))
    if arm:
        beam = box((abs(arm), 0.1, 0.1), {"side": picture[:48].copy(), "top": picture[:48].copy()})
        lamp = box((0.5, 0.14, 0.24), {"side": shade(picture[:48], 1.5)})
        faces += [moved(f, pose((arm / 2, -height + 0.1, 0))) for f in beam]
        faces += [moved(f, pose((arm, -height + 0.16, 0))) for f in lamp]
    return tuple(moved(face, place) for face in faces)


def sign(rng: Generator, place: Array, text: str, colour: Colour) -> tuple[Face, ...]:
    """A round traffic sign on a thin post."""
    side = 96
    disc = np.zeros((side, side, 4), np.uint8)
    cv2.circle(disc, (side // 2, side // 2), side // 2 - 2, (*colour, 255), -1)
    cv2.circle(disc, (side // 2, side // 2), side // 2 - 14, (240, 240, 236, 255), -1)
    cv2.putText(
        disc, text, (side // 2 - 11 * len(text), 62), cv2.FONT_HERSHEY_SIMPLEX, 1.1, (20, 20, 24, 255), 4
    )
    faces = [*box((0.07, 2.6, 0.07), {"side": plain(rng, (200, 12), (150, 152, 154), 8)})]
    faces.append(rectangle((-0.35, -2.9, -0.06), (0.7, 0, 0), (0, 0.7, 0), disc, closed=False))
    return tuple(moved(face, place) for face in faces)


def hedge(rng: Generator, length: float, place: Array) -> tuple[Face, ...]:
    """A clipped hedge along z."""
    h, w = 60, int(length * 50)
    green = (
        np.array([72, 98, 48], np.float32)
        * (1 + 0.3 * noise(rng, (h, w), 0.5) + 0.1 * noise(rng, (h, w), 1.6))[..., None]
    )
    picture = to_picture(green)
    faces = box(
        (0.7, 1.2, length),
        {
            "left": picture,
            "right": picture,
            "front": picture[:, :50].copy(),
            "back": picture[:, :50].copy(),
            "top": shade(picture, 1.15),
        },
    )
    return tuple(moved(face, place) for face in faces)


def _muted(rng: Generator, low: float, high: float) -> list[float]:
    """A colour that is not far from grey."""
    tint: list[float] = (0.65 * rng.uniform(low, high) + 0.35 * rng.uniform(low, high, 3)).tolist()
    return tint


def blob(width: float, length: float, place: Array, strength: float = 0.3) -> Face:
    """A still, soft shadow on the ground."""
    face = rectangle(
        (-width / 2, -0.005, length / 2), (width, 0, 0), (0, 0, -length), soft_shadow(strength), closed=False
    )
    return moved(face, place)
