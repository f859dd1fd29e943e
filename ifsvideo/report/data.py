"""What the page's script is given: objects, events, and columns of numbers, packed and bounded in size."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import imageio.v3 as iio
import numpy as np
from numpy.typing import NDArray

from ifsvideo.objects.history import ObjectHistory, ObjectTable
from ifsvideo.output.palette import object_colour
from ifsvideo.report.page import embedded, packed
from ifsvideo.report.pairs import Pairs
from ifsvideo.report.shapes import steady
from ifsvideo.types import Floats, Image, VideoInfo

MOST_ROWS = 40_000
"""Rows of objects over time; where there are more, only every second, fourth, ... sample is kept. With the
other bounds a page stays below 5 MB without its video."""
MOST_PAIR_VALUES = 100_000
MOST_THUMBNAIL_BYTES = 600_000
_GRID = 65534.0
"""Positions are told in this many steps of the picture's longer side."""
_JPEG_QUALITY = 75


def page_data(
    info: VideoInfo,
    frames: int,
    history: ObjectHistory,
    shapes: tuple[int, Floats],
    pairs: tuple[int, Pairs],
) -> dict[str, Any]:
    """All of it, ready for JSON.

    Parameters
    ----------
    info : VideoInfo
        Of the input.
    frames : int
        Number of frames.
    history : ObjectHistory
        Finished.
    shapes : tuple
        Every how many frames outlines were taken, and these: (N, 2 + DIRECTIONS), as of
        `ifsvideo.report.shapes.outline`, by frame, then object.
    pairs : tuple
        Every how many frames pairs were measured, and these.
    """
    every, outlines = shapes
    table = history.table.select(history.table.frame % every == 0)
    if len(table) != len(outlines):
        raise ValueError(f"{len(outlines)} outlines for {len(table)} rows of objects")
    outlines = _steady_outlines(table, outlines)
    while len(table) > MOST_ROWS:
        every *= 2
        kept = table.frame % every == 0
        table, outlines = table.select(kept), outlines[kept]
    order = np.lexsort((table.frame, table.object))
    series = pairs[1].series(MOST_PAIR_VALUES)
    grid = _GRID / max(info.width, info.height)
    return {
        "fps": float(info.fps),
        "frames": frames,
        "start": info.start,
        "width": info.width,
        "height": info.height,
        "aspect": float(info.sample_aspect),
        "every": every,
        "grid": grid,
        "objects": _objects(history, table.object),
        "columns": {name: packed(column[order], *how) for name, column, *how in _columns(table, every, grid)}
        | _packed_outlines(outlines[order], grid),
        "pairsEvery": pairs[0],
        "pairs": [[item.first, item.second, len(item.sample)] for item in series],
        "pairColumns": {
            "sample": packed(_joined([item.sample for item in series]), "u4"),
            "shear": packed(_joined([item.shear for item in series]), "u2", 100.0),
            "stretch": packed(_joined([item.stretch for item in series]), "u2", 20.0),
        },
    }


def _steady_outlines(table: ObjectTable, outlines: Floats) -> Floats:
    found = np.empty_like(outlines)
    boxes = np.stack([table.left, table.top, table.width, table.height], axis=1)
    for number in table.numbers:
        rows = table.object == number
        found[rows] = steady(outlines[rows], boxes[rows])
    return found


def _columns(table: ObjectTable, every: int, grid: float) -> list[tuple[Any, ...]]:
    """Name, values, type and scale of each column."""
    right, bottom = table.left + table.width, table.top + table.height
    return [
        ("sample", table.frame // every, "u4"),
        ("left", table.left, "i2", grid / 2),
        ("top", table.top, "i2", grid / 2),
        ("right", right, "i2", grid / 2),
        ("bottom", bottom, "i2", grid / 2),
        ("growth", table.scale_rate, "i2", 1000.0),
        ("contact", table.ttc_s, "u2", 100.0),
        ("sure", table.ttc_confidence, "u1", 200.0),
    ]


def _packed_outlines(outlines: Floats, grid: float) -> dict[str, str]:
    """Middle point and greatest reach on the grid, the distances as shares of the reach."""
    distances = outlines[:, 2:]
    reach = distances.max(axis=1, initial=1.0)
    return {
        "x": packed(outlines[:, 0], "i2", grid / 2),
        "y": packed(outlines[:, 1], "i2", grid / 2),
        "reach": packed(reach, "u2", grid),
        "shape": packed(distances / reach[:, None], "u1", 254.0),
    }


def _objects(history: ObjectHistory, sampled: NDArray[np.int32]) -> list[dict[str, Any]]:
    """One entry for every object, by number; ``rows`` of the columns are its own."""
    table, numbers = history.table, history.table.numbers
    pictures = _thumbnails(history.thumbnails, sorted(numbers, key=lambda n: -int((table.object == n).sum())))
    found = []
    for number in numbers:
        rows = table.of(number)
        contact = rows.ttc_s[np.isfinite(rows.ttc_s)]
        happened = [event for event in history.events if event.object == number]
        found.append(
            {
                "number": number,
                "colour": "#" + bytes(object_colour(number)).hex(),
                "first": round(float(rows.time_s[0]), 3),
                "last": round(float(rows.time_s[-1]), 3),
                "points": int(np.median(rows.points)),
                "contact": round(float(contact.min()), 2) if len(contact) else None,
                "events": [[round(event.time_s, 3), event.kind, event.text] for event in happened],
                "picture": pictures.get(number, ""),
                "rows": int((sampled == number).sum()),
            }
        )
    return found


def _thumbnails(pictures: Mapping[int, Image], order: Sequence[int]) -> dict[int, str]:
    """Addresses of the objects' pictures, as many as there is room for."""
    room, found = MOST_THUMBNAIL_BYTES, {}
    for number in order:
        if number in pictures:
            jpeg = iio.imwrite("<bytes>", pictures[number], extension=".jpg", quality=_JPEG_QUALITY)
            room -= len(jpeg)
            if room < 0:
                break
            found[number] = embedded(jpeg, "image/jpeg")
    return found


def _joined(columns: Sequence[NDArray[Any]]) -> NDArray[Any]:
    return np.concatenate([np.empty(0), *columns])
