"""The objects, a row for each in every frame: as a CSV, and as MOTChallenge's text."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import numpy as np

from ifsvideo.objects.history import ObjectTable
from ifsvideo.output.atomic import Outputs
from ifsvideo.types import Floats

HEADER = ",".join(item.name for item in fields(ObjectTable))
_DECIMALS = {"time_s": 4, "scale_rate": 4, "ttc_confidence": 3}
"""Digits after the point; pixels and seconds have 2."""
_FIRST_PIXEL = 1.5
"""MOTChallenge counts pixels from 1 and names the first one in the box; here a box ends between pixels."""


def write_objects(path: Path, table: ObjectTable, outputs: Outputs) -> None:
    """Write the CSV: the columns of `ObjectTable`, empty where nothing can be said.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    columns = [_cells(getattr(table, item.name), _DECIMALS.get(item.name, 2)) for item in fields(table)]
    with outputs.text(path) as file:
        file.write(HEADER + "\n")
        file.write("".join(",".join(row) + "\n" for row in zip(*columns, strict=True)))


def write_mot(path: Path, table: ObjectTable, outputs: Outputs) -> None:
    """Write ``frame,id,left,top,width,height,1,-1,-1,-1``, frames and pixels counted from 1.

    That is the format of MOTChallenge (A. Milan et al., MOT16, arXiv 1603.00831, 2016); the boxes have no
    confidence of their own, so all have 1.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    boxes = (table.left + _FIRST_PIXEL, table.top + _FIRST_PIXEL, table.width, table.height)
    columns = [_cells(table.frame + 1, 0), _cells(table.object, 0), *(_cells(side, 2) for side in boxes)]
    with outputs.text(path) as file:
        file.write("".join(",".join(row) + ",1,-1,-1,-1\n" for row in zip(*columns, strict=True)))


def _cells(column: Floats | np.ndarray, decimals: int) -> list[str]:
    """A column as text; NaN is empty."""
    if np.issubdtype(column.dtype, np.integer):
        return [str(value) for value in column.tolist()]
    # Rounded first, and zero added, so that nothing is written as -0.00.
    rounded = np.round(column.astype(np.float64), decimals) + 0.0
    return ["" if value != value else f"{value:.{decimals}f}" for value in rounded.tolist()]
