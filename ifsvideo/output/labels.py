"""The label CSV: a row for every track and frame in which it is seen."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ifsvideo.output.atomic import Outputs, output_error
from ifsvideo.types import LabelTable, VideoInfo

HEADER = "frame,time_s,track_id,x,y,label"
_ROW = "{},{},{},{:.2f},{:.2f},{}\n"
_BLOCK = 65536
"""Rows formatted at once: enough to be fast, few enough to need little memory."""


def write_labels(path: Path, table: LabelTable, info: VideoInfo, outputs: Outputs | None = None) -> None:
    """Write the table: frame from 0, time in seconds of the input with 4 decimals, pixels with 2.

    Parameters
    ----------
    path : Path
    table : LabelTable
    info : VideoInfo
        Tells the time of a frame.
    outputs : Outputs, optional
        Group with which the file is placed; alone by default.

    Raises
    ------
    OutputError
        If the file cannot be written, as on a full disk.
    """
    with Outputs() as own:
        unfinished = (outputs or own).add(path)
        try:
            with unfinished.open("w", encoding="ascii", newline="") as file:
                file.write(HEADER + "\n")
                for start in range(0, len(table.frame), _BLOCK):
                    file.write("".join(_rows(table, info, slice(start, start + _BLOCK))))
        except OSError as error:
            raise output_error(path, error) from None


def _rows(table: LabelTable, info: VideoInfo, block: slice) -> Iterator[str]:
    frames, index = np.unique(table.frame[block], return_inverse=True)
    times = [f"{info.time_of(frame):.4f}" for frame in frames.tolist()]
    # Rounded first, and zero added, so that nothing is written as -0.00.
    xy = np.round(table.xy[block].astype(np.float64), 2) + 0.0
    return map(
        _ROW.format,
        table.frame[block].tolist(),
        [times[place] for place in index.tolist()],
        table.ids[block].tolist(),
        xy[:, 0].tolist(),
        xy[:, 1].tolist(),
        table.labels[block].tolist(),
    )
