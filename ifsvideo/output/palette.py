"""Colours of objects: told apart by colour-blind eyes, and on a darkened picture."""

from __future__ import annotations

Colour = tuple[int, int, int]
"""Red, green, blue, 0 to 255."""

# Okabe and Ito, "Color Universal Design" (2008), without black and with neighbours in number far apart in
# hue; their blue (0, 114, 178) is lifted, or it would drown in the darkened picture.
_OKABE_ITO: tuple[Colour, ...] = (
    (230, 159, 0),
    (86, 180, 233),
    (240, 228, 66),
    (204, 121, 167),
    (0, 178, 127),
    (232, 104, 24),
    (48, 128, 220),
)
# Every further round of the seven is mixed with white, then with black: (share, towards).
_ROUNDS: tuple[tuple[float, int], ...] = ((0.0, 0), (0.5, 255), (0.4, 0), (0.75, 255))

BACKGROUND_COLOUR: Colour = (188, 193, 198)
BACKGROUND_TRAIL: Colour = (142, 146, 150)
UNDECIDED_COLOUR: Colour = (118, 120, 124)


def object_colour(label: int) -> Colour:
    """Colour of a moving object, by its number (1, 2, ...); it repeats after 28 objects."""
    red, green, blue = _OKABE_ITO[(label - 1) % len(_OKABE_ITO)]
    share, towards = _ROUNDS[(label - 1) // len(_OKABE_ITO) % len(_ROUNDS)]
    return _mix(red, towards, share), _mix(green, towards, share), _mix(blue, towards, share)


def label_colour(label: int) -> Colour:
    """Colour of any label: objects, background (0), undecided (-1)."""
    if label > 0:
        return object_colour(label)
    return BACKGROUND_COLOUR if label == 0 else UNDECIDED_COLOUR


def ink_on(colour: Colour) -> Colour:
    """Nearly black or white, whichever is read better on the colour."""
    luma = 0.299 * colour[0] + 0.587 * colour[1] + 0.114 * colour[2]
    return (16, 18, 20) if luma > 110 else (250, 250, 250)


def _mix(value: int, towards: int, share: float) -> int:
    return round(value + share * (towards - value))
