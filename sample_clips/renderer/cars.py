"""Cars as extruded outlines: painted sides, glass, lights, plates, wheels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from renderer.geometry import Array, Face, moved, polygon, rectangle
from renderer.paint import Colour, Generator, Picture, noise, plain, shade, soft_shadow, to_picture

PPM = 110
GLASS = (52, 62, 70)
WHEEL = 0.33


@dataclass(frozen=True)
class Shape:
    """Outline seen from the right, metres: positions are from the tail forward, heights from the road."""

    length: float = 4.4
    half_width: float = 0.9
    roof_half_width: float = 0.66
    sill: float = 0.27
    belt: float = 0.96
    roof: float = 1.46
    tail: float = 0.92
    rear_glass: tuple[float, float] = (0.55, 1.15)
    front_glass: tuple[float, float] = (3.15, 2.45)
    bonnet: float = 0.76
    wheels: tuple[float, float] = (0.85, 3.55)


SEDAN = Shape()
HATCH = Shape(3.9, 0.88, 0.68, 0.27, 0.98, 1.52, 0.98, (0.05, 0.5), (2.75, 2.05), 0.8, (0.7, 3.15))
VAN = Shape(4.9, 1.0, 0.88, 0.32, 1.16, 2.12, 1.16, (0.02, 0.16), (4.1, 3.4), 0.95, (0.95, 3.85))


def car(rng: Generator, shape: Shape, colour: Colour, plate: str, badge: str) -> tuple[Face, ...]:
    """Faces of a car that stands on y = 0 and looks along z, its middle at the origin."""
    s, w, r = shape, shape.half_width, shape.roof_half_width

    def point(z: float, height: float, x: float) -> tuple[float, float, float]:
        return x, -height, z - s.length / 2

    def across(
        a: tuple[float, float, float], b: tuple[float, float, float], picture: Picture, back: bool
    ) -> Face:
        """A strip over the car's width between two stations (position, height, half width), lower first."""
        (za, ha, wa), (zb, hb, wb) = a, b
        sign = 1 if back else -1
        corners = [(za, ha, -sign * wa), (za, ha, sign * wa), (zb, hb, sign * wb), (zb, hb, -sign * wb)]
        return polygon([point(*c) for c in corners], picture)

    def canvas(width: float, height: float, gain: float = 1.0) -> Picture:
        return _bodywork(rng, width, height, shade_colour(colour, gain))

    tail, belt_r, roof_r = (0.0, s.tail, w), (s.rear_glass[0], s.belt, w), (s.rear_glass[1], s.roof, r)
    belt_f, roof_f = (s.front_glass[0], s.belt, w), (s.front_glass[1], s.roof, r)
    nose = (s.length, s.bonnet, w)
    faces = [
        across((0.0, s.sill, w), tail, _tail(canvas(2 * w, s.tail - s.sill, 0.92), plate, badge), True),
        across(belt_r, roof_r, _glass(rng, 2 * w, _slant(belt_r, roof_r), colour, rear=True), True),
        across(roof_r, roof_f, _ribs(canvas(2 * r, roof_f[0] - roof_r[0], 1.15)), True),
        across(belt_f, roof_f, _glass(rng, 2 * w, _slant(belt_f, roof_f), colour, rear=False), False),
        across(nose, belt_f, _ribs(canvas(2 * w, _slant(nose, belt_f), 1.12)), False),
        across((s.length, s.sill, w), nose, _front(canvas(2 * w, s.bonnet - s.sill), plate), False),
    ]
    if belt_r[0] > 0.1:
        faces.append(across(tail, belt_r, canvas(2 * w, _slant(tail, belt_r), 1.1), True))
    for side in (1, -1):
        faces.append(_flank(rng, s, colour, side))
        greenhouse = [point(belt_r[0], s.belt, side * w), point(belt_f[0], s.belt, side * w)]
        greenhouse += [point(roof_f[0], s.roof, side * r), point(roof_r[0], s.roof, side * r)]
        if side < 0:
            greenhouse = [greenhouse[1], greenhouse[0], greenhouse[3], greenhouse[2]]
        width, height = belt_f[0] - belt_r[0], float(np.hypot(s.roof - s.belt, w - r))
        faces.append(polygon(greenhouse, _side_glass(rng, width, height, colour)))
    return tuple(faces) + _underside(s)


def car_shadow(shape: Shape, strength: float = 0.34) -> tuple[Face, ...]:
    """The soft shadow under a car."""
    x, z = shape.half_width + 0.35, shape.length / 2 + 0.35
    return (rectangle((-x, -0.005, z), (2 * x, 0, 0), (0, 0, -2 * z), soft_shadow(strength), closed=False),)


def parked(rng: Generator, shape: Shape, colour: Colour, plate: str, place: Array) -> tuple[Face, ...]:
    """Faces of a car that stays at the pose ``place``."""
    return tuple(moved(face, place) for face in car(rng, shape, colour, plate, "GL"))


def shade_colour(colour: Colour, gain: float) -> Colour:
    """A colour made lighter or darker."""
    return colour[0] * gain, colour[1] * gain, colour[2] * gain


def _slant(a: tuple[float, float, float], b: tuple[float, float, float]) -> float:
    return float(np.hypot(a[0] - b[0], a[1] - b[1]))


def _bodywork(rng: Generator, width: float, height: float, colour: Colour) -> Picture:
    """Paint with what it mirrors softly: lighter above, and a little dirt."""
    h, w = max(int(height * PPM), 8), max(int(width * PPM), 8)
    base = plain(rng, (h, w), colour, 2.5).astype(np.float32)
    ramp = np.linspace(1.12, 0.84, h, dtype=np.float32)[:, None, None]
    return to_picture(base * ramp)


def _ribs(picture: Picture) -> Picture:
    h, w = picture.shape[:2]
    for x in (0.12, 0.88):
        cv2.line(picture, (int(x * w), 0), (int(x * w), h), (35, 35, 38), 3)
    for x in (0.3, 0.7):
        cv2.line(
            picture,
            (int(x * w), h // 8),
            (int(x * w), 7 * h // 8),
            shade(picture, 0.7)[h // 2, w // 2].tolist(),
            2,
        )
    return picture


def _tail(picture: Picture, plate: str, badge: str) -> Picture:
    h, w = picture.shape[:2]
    p = PPM
    cv2.rectangle(picture, (0, h - int(0.24 * p)), (w, h), (44, 45, 48), -1)
    cv2.line(picture, (0, h - int(0.24 * p)), (w, h - int(0.24 * p)), (165, 165, 168), 2)
    for x in (0.1, 0.9):
        cv2.rectangle(picture, (int(x * w) - 8, h - 17), (int(x * w) + 8, h - 11), (205, 60, 40), -1)
    for left in (True, False):
        x0 = 2 if left else w - int(0.3 * p) - 2
        y0, y1 = int(0.07 * p), int(0.33 * p)
        x1 = x0 + int(0.3 * p)
        cv2.rectangle(picture, (x0, y0), (x1, y1), (176, 22, 26), -1)
        cv2.rectangle(picture, (x0 + 4, y0 + (y1 - y0) // 2), (x1 - 4, y1 - 4), (236, 206, 180), -1)
        cv2.rectangle(picture, (x0 + 4, y0 + 4), (x0 + 14, y0 + 12), (240, 120, 60), -1)
        cv2.rectangle(picture, (x0, y0), (x1, y1), (30, 20, 22), 2)
    pw, ph = int(0.52 * p), int(0.13 * p)
    x0, y0 = w // 2 - pw // 2, int(0.22 * p)
    cv2.rectangle(picture, (x0 - 5, y0 - 5), (x0 + pw + 5, y0 + ph + 5), (35, 35, 36), -1)
    cv2.rectangle(picture, (x0, y0), (x0 + pw, y0 + ph), (238, 236, 226), -1)
    cv2.rectangle(picture, (x0, y0), (x0 + 6, y0 + ph), (30, 60, 160), -1)
    cv2.putText(picture, plate, (x0 + 9, y0 + ph - 3), cv2.FONT_HERSHEY_SIMPLEX, 0.42, (18, 18, 22), 2)
    cv2.circle(picture, (w // 2, int(0.09 * p)), int(0.055 * p), (205, 207, 212), -1)
    cv2.circle(picture, (w // 2, int(0.09 * p)), int(0.025 * p), (60, 62, 70), -1)
    cv2.putText(
        picture, badge, (int(0.68 * w), int(0.52 * p)), cv2.FONT_HERSHEY_SIMPLEX, 0.4, (225, 225, 228), 1
    )
    cv2.rectangle(picture, (int(0.2 * w), h - 12), (int(0.2 * w) + 16, h - 5), (120, 118, 116), -1)
    return picture


def _front(picture: Picture, plate: str) -> Picture:
    h, w = picture.shape[:2]
    p = PPM
    cv2.rectangle(picture, (int(0.24 * w), int(0.1 * p)), (int(0.76 * w), int(0.27 * p)), (24, 25, 28), -1)
    for y in range(int(0.12 * p), int(0.27 * p), 5):
        cv2.line(picture, (int(0.25 * w), y), (int(0.75 * w), y), (150, 152, 156), 1)
    cv2.circle(picture, (w // 2, int(0.18 * p)), 8, (215, 216, 220), -1)
    for x in (0.02, 0.79):
        x0, x1 = int(x * w), int((x + 0.19) * w)
        cv2.rectangle(picture, (x0, int(0.06 * p)), (x1, int(0.24 * p)), (232, 236, 240), -1)
        cv2.circle(picture, ((x0 + x1) // 2, int(0.15 * p)), 8, (120, 128, 140), -1)
        cv2.circle(picture, ((x0 + x1) // 2, int(0.15 * p)), 4, (250, 250, 250), -1)
        cv2.rectangle(picture, (x0, int(0.06 * p)), (x1, int(0.24 * p)), (32, 34, 38), 2)
    cv2.rectangle(picture, (0, h - int(0.13 * p)), (w, h), (38, 39, 42), -1)
    x0, y0 = w // 2 - int(0.26 * p), int(0.3 * p)
    cv2.rectangle(picture, (x0, y0), (x0 + int(0.52 * p), y0 + int(0.11 * p)), (238, 236, 226), -1)
    cv2.putText(
        picture, plate, (x0 + 4, y0 + int(0.11 * p) - 2), cv2.FONT_HERSHEY_SIMPLEX, 0.4, (18, 18, 22), 1
    )
    return picture


def _glass(rng: Generator, width: float, height: float, colour: Colour, rear: bool) -> Picture:
    """A front or rear window: frame, gradient, seats behind, wiper, sticker."""
    h, w = max(int(height * PPM), 8), int(width * PPM)
    picture = plain(rng, (h, w), GLASS, 3)
    ramp = np.linspace(60, 0, h, dtype=np.float32)[:, None, None]
    picture = to_picture(picture + ramp)
    for x in (0.3, 0.7):
        cv2.ellipse(
            picture, (int(x * w), int(0.75 * h)), (int(0.07 * w), int(0.3 * h)), 0, 0, 360, (28, 30, 34), -1
        )
        cv2.ellipse(
            picture, (int(x * w), int(0.5 * h)), (int(0.04 * w), int(0.12 * h)), 0, 0, 360, (62, 56, 52), -1
        )
    streak = np.array([[0.42, 0.0], [0.55, 0.0], [0.4, 1.0], [0.27, 1.0]]) * [w, h]
    light = picture.copy()
    cv2.fillPoly(light, [streak.astype(np.int32)], (150, 164, 174))
    picture = to_picture(0.6 * picture.astype(np.float32) + 0.4 * light)
    if rear:
        cv2.line(picture, (w // 2, h - 4), (int(0.68 * w), int(0.55 * h)), (16, 16, 18), 3)
        if rng.random() < 0.5:
            cv2.rectangle(
                picture, (int(0.17 * w), int(0.62 * h)), (int(0.24 * w), int(0.8 * h)), (228, 190, 40), -1
            )
        cv2.rectangle(
            picture, (int(0.44 * w), int(0.1 * h)), (int(0.56 * w), int(0.18 * h)), (190, 30, 30), -1
        )
    edge = max(int(0.055 * PPM), 2)
    top, bottom = shade_colour(colour, 1.1), shade_colour(colour, 0.95)
    cv2.line(picture, (0, edge // 2), (w, edge // 2), top, edge + 2)
    cv2.line(picture, (0, h - edge // 2), (w, h - edge // 2), bottom, edge)
    inset = int(0.24 * PPM)
    for x in (0, w):
        toward = inset if x == 0 else w - inset
        cv2.line(picture, (x, h), (toward, 0), shade_colour(colour, 0.9), int(0.15 * PPM))
    return picture


def _side_glass(rng: Generator, width: float, height: float, colour: Colour) -> Picture:
    h, w = int(height * PPM), int(width * PPM)
    picture = _bodywork(rng, width, height, colour)
    pane = (int(0.08 * h), int(0.9 * h))
    for x0, x1 in ((0.05, 0.3), (0.33, 0.6), (0.63, 0.95)):
        area = picture[pane[0] : pane[1], int(x0 * w) : int(x1 * w)]
        ramp = np.linspace(95, 45, len(area), dtype=np.float32)[:, None, None]
        area[:] = to_picture(ramp + 10 * noise(rng, area.shape[:2], 2.4)[..., None] + np.array([-6, 2, 9]))
        cv2.ellipse(area, (area.shape[1] // 2, len(area)), (12, 26), 0, 0, 360, (30, 30, 34), -1)
        cv2.line(area, (area.shape[1] // 4, 0), (area.shape[1] // 8, len(area)), (165, 175, 182), 5)
    return picture


def _flank(rng: Generator, s: Shape, colour: Colour, side: int) -> Face:
    """Lower body with doors, handles, arches and wheels; what is not car is a hole."""
    height = max(s.belt, s.tail)
    h, w = int(height * PPM), int(s.length * PPM)
    picture = np.dstack([_bodywork(rng, s.length, height, colour)[:h, :w], np.zeros((h, w), np.uint8)])

    def pixel(z: float, y: float) -> tuple[int, int]:
        return int(z * PPM), int((height - y) * PPM)

    line = [(0, s.sill), (0, s.tail), (s.rear_glass[0], s.belt), (s.front_glass[0], s.belt)]
    line += [(s.length, s.bonnet), (s.length, s.sill)]
    body = np.zeros((h, w), np.uint8)
    cv2.fillPoly(body, [np.array([pixel(*p) for p in line], np.int32)], 255)
    rgb = np.ascontiguousarray(picture[..., :3])
    doors = np.linspace(s.rear_glass[1] + 0.1, s.front_glass[0] - 0.05, 3)
    for z in doors:
        cv2.line(rgb, pixel(z, s.belt), pixel(z, s.sill + 0.08), (30, 30, 32), 2)
    for z in doors[1:]:
        cv2.rectangle(rgb, pixel(z - 0.3, s.belt - 0.12), pixel(z - 0.12, s.belt - 0.16), (205, 205, 208), -1)
    cv2.rectangle(rgb, pixel(0, s.sill + 0.1), pixel(s.length, s.sill), (40, 40, 43), -1)
    cv2.line(rgb, pixel(0.1, 0.6), pixel(s.length - 0.1, 0.6), shade_colour(colour, 0.65), 2)
    cv2.rectangle(rgb, pixel(0, s.tail - 0.08), pixel(0.22, s.tail - 0.28), (176, 22, 26), -1)
    cv2.rectangle(
        rgb, pixel(s.length - 0.3, s.bonnet - 0.03), pixel(s.length, s.bonnet - 0.17), (232, 236, 240), -1
    )
    _fender(rgb, pixel, s)
    for z in s.wheels:
        _wheel(rgb, body, pixel(z, WHEEL))
    picture = np.dstack([rgb, body])
    x, z0, z1 = side * s.half_width, -s.length / 2, s.length / 2
    if side > 0:
        return rectangle((x, -height, z0), (0, 0, z1 - z0), (0, height, 0), picture)
    return rectangle(
        (x, -height, z1), (0, 0, z0 - z1), (0, height, 0), np.ascontiguousarray(picture[:, ::-1])
    )


def _fender(rgb: Picture, pixel: Callable[[float, float], tuple[int, int]], s: Shape) -> None:
    """Small parts ahead of the front wheel: indicator, panel gap, reflectors, lamp: corners to hold on to."""
    z = s.length
    cv2.line(rgb, pixel(z - 0.34, s.bonnet), pixel(z - 0.34, s.sill + 0.1), (26, 26, 28), 2)
    cv2.rectangle(rgb, pixel(z - 0.31, s.bonnet - 0.19), pixel(z - 0.02, s.bonnet - 0.25), (238, 136, 30), -1)
    cv2.rectangle(rgb, pixel(z - 0.2, s.sill + 0.2), pixel(z - 0.06, s.sill + 0.12), (226, 226, 222), -1)
    cv2.rectangle(rgb, pixel(z - 0.2, s.sill + 0.08), pixel(z - 0.1, s.sill + 0.02), (206, 60, 36), -1)
    cv2.rectangle(rgb, pixel(z - 0.14, s.bonnet - 0.06), pixel(z - 0.05, s.bonnet - 0.14), (70, 76, 86), -1)
    cv2.rectangle(rgb, pixel(z - 1.3, 0.72), pixel(z - 1.18, 0.67), (238, 136, 30), -1)


def _wheel(rgb: Picture, body: Picture, centre: tuple[int, int]) -> None:
    radius = int(WHEEL * PPM)
    cv2.circle(rgb, centre, int(1.16 * radius), (24, 24, 26), -1)
    for picture, tyre, rim in ((rgb, (34, 34, 36), (172, 174, 178)), (body, 255, 255)):
        cv2.circle(picture, centre, radius - 1, tyre, -1)  # type: ignore[arg-type]
        cv2.circle(picture, centre, int(0.62 * radius), rim, -1)  # type: ignore[arg-type]
    # The spokes stand still: a wheel that rolls would be a motion of its own inside the object.
    for k in range(5):
        a = 2 * np.pi * k / 5 + 0.3
        tip = (int(centre[0] + 0.6 * radius * np.cos(a)), int(centre[1] + 0.6 * radius * np.sin(a)))
        cv2.line(rgb, centre, tip, (70, 72, 76), 4)


def _underside(s: Shape) -> tuple[Face, ...]:
    """Tyres seen from the ends, and the dark below the car."""
    tread = np.full((40, 24, 3), 30, np.uint8)
    tread[::5] = 52
    dark = np.full((16, 64, 3), 26, np.uint8)
    faces = []
    for z in (s.wheels[0] - WHEEL, s.wheels[1] + WHEEL):
        for x in (-s.half_width + 0.02, s.half_width - 0.24):
            faces.append(
                rectangle((x, -0.4, z - s.length / 2), (0.22, 0, 0), (0, 0.4, 0), tread, closed=False)
            )
        width = 2 * s.half_width - 0.5
        faces.append(
            rectangle((-width / 2, -0.36, z - s.length / 2), (width, 0, 0), (0, 0.2, 0), dark, closed=False)
        )
    return tuple(faces)
