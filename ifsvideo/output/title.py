"""The title: a line of text on a plate, at the lower left."""

from __future__ import annotations

from ifsvideo.output.alpha import alone, blend
from ifsvideo.output.legend import FONT, INK, PANEL, draw_panel, text_width, write
from ifsvideo.types import Image

_SIZE = 0.027
"""Height of a capital letter, share of the diagonal; smaller where the words would not fit."""
_WIDEST = 0.9
"""Most of the picture's width that it takes."""
_OPACITY = 0.7
_FADE_S = 0.4
_LEAST = 5


class Title:
    """Words that stand on the picture for a while.

    Parameters
    ----------
    text : str
        One line; white space is taken together.
    seconds : float
        How long it stands there, fading out; 0: to the end.
    size : (width, height)
        Of what is written, pixels.
    diagonal : float
        Of one picture in it, pixels; letters are as large beside two pictures as on one.
    """

    def __init__(self, text: str, seconds: float, size: tuple[int, int], diagonal: float) -> None:
        self._seconds = seconds
        plate = _plate(" ".join(text.split()), round(_SIZE * diagonal), _WIDEST * size[0])
        edge = round(0.03 * diagonal)
        self._left = max(0, min(edge, size[0] - plate.shape[1]))
        self._top = max(0, size[1] - edge - plate.shape[0])
        self._plate = plate[: size[1], : size[0]]

    def draw(self, canvas: Image, time_s: float) -> None:
        """Lay it over ``canvas`` (H, W, 3 or 4) uint8, which is changed, as it is at a time of the output."""
        # Full from the first picture on: it is the one that players show before they play.
        left = (self._seconds - time_s) / _FADE_S if self._seconds else 1.0
        if left > 0:
            blend(canvas, self._left, self._top, self._plate, min(left, 1.0))


def _plate(text: str, capital: int, room: float) -> Image:
    """The words on their panel, (h, w, 4) uint8, at most ``room`` wide, if need be cut off."""
    while capital > _LEAST and text_width(text, capital, FONT) + 2 * capital > room:
        capital -= 1
    while len(text) > 1 and text_width(text, capital, FONT) + 2 * capital > room:
        text = f"{text.rstrip('…')[:-1]}…"
    shape = (round(2.7 * capital), text_width(text, capital, FONT) + 2 * capital, 3)

    def paint(ground: Image) -> Image:
        draw_panel(ground, (0, 0, shape[1], shape[0]), PANEL, _OPACITY, 0.22)
        write(ground, text, (capital, round(1.85 * capital)), capital, INK, FONT)
        return ground

    return alone(paint, shape)
