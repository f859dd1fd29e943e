"""The label CSV: a row for every track and frame in which it is seen."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ifsvideo.output.atomic import Outputs
from ifsvideo.types import Image, Scene

HEADER = "frame,time_s,track_id,x,y,label"


class LabelSink:
    """Writes the labels as they come: time in seconds of the input with 4 decimals, pixels with 2.

    Parameters
    ----------
    path : Path
    outputs : Outputs
        Group with which the file is placed.

    Raises
    ------
    OutputError
        Here and later, if the file cannot be written, as on a full disk.
    """

    wants_image = False

    def __init__(self, path: Path, outputs: Outputs) -> None:
        self._file = outputs.text(path)
        self._file.write(HEADER + "\n")

    def add(self, scene: Scene, image: Image | None) -> None:
        """See `ifsvideo.types.Sink`."""
        # Rounded first, and zero added, so that nothing is written as -0.00.
        x, y = (np.round(scene.xy.astype(np.float64), 2) + 0.0).T.tolist()
        row = f"{scene.frame},{scene.time_s:.4f},{{}},{{:.2f}},{{:.2f}},{{}}\n".format
        self._file.write("".join(map(row, scene.ids.tolist(), x, y, scene.labels.tolist())))

    def finish(self) -> None:
        """See `ifsvideo.types.Sink`."""
        self._file.close()
