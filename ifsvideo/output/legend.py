"""Text on the picture: the number beside an object, the legend, and what they are written with."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from ifsvideo.output.palette import Colour, ink_on
from ifsvideo.types import Image

FONT = cv2.FONT_HERSHEY_SIMPLEX
BOLD = cv2.FONT_HERSHEY_DUPLEX
# Height of a capital letter at scale 1, pixels.
_CAPITAL = 21.0
_DIGIT = re.compile(r"\d")
PANEL: Colour = (18, 20, 24)
PANEL_OPACITY = 0.62
INK: Colour = (240, 242, 244)

Box = tuple[int, int, int, int]
"""Left, top, right, bottom in pixels; right and bottom are outside."""


def clock(seconds: float) -> str:
    """Time as it is written in the legend: 1:02.50, or 1:00:02.50 from an hour on."""
    hundredths = round(max(seconds, 0.0) * 100)
    minutes, rest = divmod(hundredths, 6000)
    hours, minutes = divmod(minutes, 60)
    tail = f"{rest // 100:02d}.{rest % 100:02d}"
    return f"{hours}:{minutes:02d}:{tail}" if hours else f"{minutes}:{tail}"


def draw_legend(canvas: Image, time_s: float, frame: int, objects: int, capital: int) -> list[Box]:
    """Write time, frame and number of objects into the top left corner; shorter where the picture is narrow.

    Parameters
    ----------
    canvas : (H, W, 3) uint8, drawn on
    capital : int
        Height of a capital letter, pixels.

    Returns
    -------
    list of Box
        The place it took; none where there is no room at all.
    """
    noun = "object" if objects == 1 else "objects"
    versions = (
        f"{clock(time_s)}   frame {frame}   {objects} {noun}",
        f"{clock(time_s)}  {objects} {noun}",
        f"{clock(time_s)}",
        f"{objects}",
    )
    height, width = canvas.shape[:2]
    pad = max(2, round(0.75 * capital))
    edge = pad
    for text in versions:
        wide = text_width(text, capital, FONT)
        box = (edge, edge, edge + wide + 2 * pad, edge + capital + 2 * pad)
        if box[2] <= width - edge and box[3] <= height // 2:
            draw_panel(canvas, box, PANEL, PANEL_OPACITY)
            write(canvas, text, (edge + pad, edge + pad + capital), capital, INK, FONT)
            return [box]
    return []


def draw_number(
    canvas: Image,
    number: int,
    anchor: tuple[float, float],
    colour: Colour,
    capital: int,
    taken: Sequence[Box],
) -> Box:
    """Write an object's number on a plate of its colour, its lower edge at the anchor; the place it took.

    The plate stays inside the picture, and moves up or down where another one is.
    """
    height, width = canvas.shape[:2]
    pad = max(2, round(0.4 * capital))
    text = str(number)
    wide = text_width(text, capital, BOLD)
    size = (max(wide, capital) + 2 * pad, capital + 2 * pad)
    left = int(np.clip(round(anchor[0] - size[0] / 2), 0, max(0, width - size[0])))
    wanted = round(anchor[1]) - size[1]
    box = (left, 0, left + size[0], size[1])
    for step in (0, -1, 1, -2, 2, 3, 4):
        top = int(np.clip(wanted + step * (size[1] + 1), 0, max(0, height - size[1])))
        box = (left, top, left + size[0], top + size[1])
        if not any(_overlap(box, other) for other in taken):
            break
    draw_panel(canvas, box, colour, 0.92)
    start = (box[0] + (size[0] - wide) // 2, box[1] + pad + capital)
    write(canvas, text, start, capital, ink_on(colour), BOLD)
    return box


def _overlap(a: Box, b: Box) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def text_width(text: str, capital: int, font: int) -> int:
    """Width of a line whose capitals are ``capital`` pixels high, pixels."""
    return _width(_DIGIT.sub("0", text), capital, font)


@lru_cache(maxsize=64)
def _width(text: str, capital: int, font: int) -> int:
    """`text_width`, kept: it takes as long as to write the text, and all digits are equally wide."""
    return int(cv2.getTextSize(text, font, capital / _CAPITAL, _thickness(capital))[0][0])


def write(canvas: Image, text: str, start: tuple[int, int], capital: int, ink: Colour, font: int) -> None:
    """Write a line; ``start`` is the left end of its baseline."""
    cv2.putText(canvas, text, start, font, capital / _CAPITAL, ink, _thickness(capital), cv2.LINE_AA)


def _thickness(capital: int) -> int:
    return max(1, round(capital / 14))


def draw_panel(canvas: Image, box: Box, colour: Colour, opacity: float, corner: float = 0.3) -> None:
    """Blend a plate into the canvas; its corners are round, ``corner`` is their radius in heights."""
    height, width = canvas.shape[:2]
    left, top, right, bottom = max(box[0], 0), max(box[1], 0), min(box[2], width), min(box[3], height)
    if right <= left or bottom <= top:
        return
    share = opacity * _plate(right - left, bottom - top, corner)
    region = canvas[top:bottom, left:right]
    ink = np.empty(region.shape, np.uint8)
    cv2.rectangle(ink, (0, 0), (right, bottom), colour, cv2.FILLED)
    cv2.blendLinear(ink, region, share, 1.0 - share, dst=region)


@lru_cache(maxsize=64)
def _plate(width: int, height: int, corner: float) -> NDArray[np.float32]:
    """How much a plate covers of each of its pixels (H, W), 0 to 1; kept, as most frames ask for the same."""
    # Drawn four times as large and averaged: OpenCV has no round rectangle with smooth corners.
    fine = 4
    mask = np.zeros((height * fine, width * fine), dtype=np.uint8)
    radius = max(1, round(corner * fine * min(width, height)))
    low, high = (0, 0), (mask.shape[1] - 1, mask.shape[0] - 1)
    cv2.rectangle(mask, (low[0] + radius, low[1]), (high[0] - radius, high[1]), (255,), -1)
    cv2.rectangle(mask, (low[0], low[1] + radius), (high[0], high[1] - radius), (255,), -1)
    for x in (low[0] + radius, high[0] - radius):
        for y in (low[1] + radius, high[1] - radius):
            cv2.circle(mask, (x, y), radius, (255,), -1)
    weight = cv2.resize(mask, (width, height), interpolation=cv2.INTER_AREA)
    return weight.astype(np.float32) / np.float32(255.0)
