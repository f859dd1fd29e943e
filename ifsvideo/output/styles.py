"""Styles of the overlay: which of its parts are drawn, and on how much of the picture."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ifsvideo.config import OverlayConfig

_VALUES = ("trail_s", "hull_opacity", "picture_brightness", "picture_colour")


@dataclass(frozen=True)
class Look:
    """What a style draws.

    Attributes
    ----------
    ground : bool
        The points of the background and those without a decision.
    dots, trails : bool
        An object's points, and where they were.
    area, outline : bool
        What an object covers, and the line round it.
    numbers : bool
        The number beside an object.
    bands : int
        Parts of a trail that differ in opacity.
    trail_s, hull_opacity, picture_brightness, picture_colour : float
        As in `ifsvideo.config.OverlayConfig`.
    """

    ground: bool = True
    dots: bool = True
    trails: bool = True
    area: bool = True
    outline: bool = True
    numbers: bool = True
    bands: int = 3
    trail_s: float = 0.3
    hull_opacity: float = 0.2
    picture_brightness: float = 0.7
    picture_colour: float = 0.55


_LOOKS = {
    # Long enough to show where a point goes, short enough not to tangle; pale colours still stand out on a
    # white sky, a red car is not taken for a label, and the object itself is seen through its colour.
    "full": Look(),
    # The picture is left a little brighter: nothing but the dots must stand out.
    "dots": Look(trails=False, area=False, outline=False, trail_s=0.0, picture_brightness=0.8),
    # A second of movers' paths on a dark, pale picture, as light trails in a photograph by night.
    "trails": Look(
        ground=False,
        area=False,
        outline=False,
        bands=8,
        trail_s=1.0,
        picture_brightness=0.5,
        picture_colour=0.3,
    ),
    "hulls": Look(
        ground=False, dots=False, trails=False, trail_s=0.0, hull_opacity=0.35, picture_brightness=0.8
    ),
    # Grey and dim but for the movers, which are shown as they are.
    "spotlight": Look(
        ground=False,
        dots=False,
        trails=False,
        outline=False,
        numbers=False,
        trail_s=0.0,
        hull_opacity=0.0,
        picture_brightness=0.45,
        picture_colour=0.0,
    ),
}


def look_of(config: OverlayConfig) -> Look:
    """The style that is asked for, and over it the values that the configuration names."""
    told = {name: getattr(config, name) for name in _VALUES if getattr(config, name) is not None}
    return replace(_LOOKS[config.style], **told)
