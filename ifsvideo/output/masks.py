"""A mask for every frame: indexed PNGs with the palette of DAVIS."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image as Pillow

from ifsvideo.output import hull
from ifsvideo.output.atomic import Outputs, output_error
from ifsvideo.types import BACKGROUND, Image, Scene, VideoInfo

OWN_FILES = r"\d+\.png"
"""What a folder of masks may hold to be replaced."""
_LARGEST = 255
"""Highest number that an indexed PNG holds."""
_REACH, _MARGIN = 0.045, 0.004
"""Distance between points that is bridged, and from the outermost to the outline; shares of the diagonal."""


def davis_palette() -> NDArray[np.uint8]:
    """Colours (256, 3) of the numbers, as PASCAL VOC and DAVIS have them: the bits of a number, dealt in turn
    to red, green and blue from the highest bit down.

    F. Perazzi et al., A Benchmark Dataset and Evaluation Methodology for Video Object Segmentation, CVPR
    2016.
    """
    number = np.arange(256)
    dealt = [sum(((number >> (3 * k + part)) & 1) << (7 - k) for k in range(3)) for part in range(3)]
    return np.stack(dealt, axis=1).astype(np.uint8)


class MaskSink:
    """Fills the outlines of the objects with their numbers, the larger ones first; a PNG a frame.

    A pixel is 0 on the background, k on object k; objects above 255 have no place in an indexed PNG and are
    left out, which `warnings` tells.

    Parameters
    ----------
    path : Path
        Folder; the files are 00000.png and so on.
    info : VideoInfo
        Size of the masks.
    outputs : Outputs
        Group with which the folder is placed.

    Raises
    ------
    OutputError
        Here and later, if it cannot be written.
    """

    wants_image = False

    def __init__(self, path: Path, info: VideoInfo, outputs: Outputs) -> None:
        self.warnings: tuple[str, ...] = ()
        self._path = path
        self._folder = outputs.add_folder(path)
        self._size = info.height, info.width
        self._diagonal = float(np.hypot(info.width, info.height))
        self._palette = davis_palette().tobytes()

    def add(self, scene: Scene, image: Image | None) -> None:
        """See `ifsvideo.types.Sink`."""
        mask = np.zeros(self._size, np.uint8)
        for number, polygons in self._outlines(scene):
            corners = [hull.fixed_point(polygon) for polygon in polygons]
            cv2.fillPoly(mask, corners, (number,), cv2.LINE_8, hull.SUBPIXEL_BITS)
        picture = Pillow.fromarray(mask).convert("L")
        picture.putpalette(self._palette)
        try:
            picture.save(self._folder / f"{scene.frame:05d}.png", compress_level=1)
        except OSError as error:
            raise output_error(self._path, error) from None

    def finish(self) -> None:
        """See `ifsvideo.types.Sink`."""

    def _outlines(self, scene: Scene) -> list[tuple[int, list[NDArray[np.float32]]]]:
        """Outlines of the objects in sight, the larger objects first."""
        numbers = np.unique(scene.labels[scene.labels > BACKGROUND])
        if not self.warnings and (numbers > _LARGEST).any():
            self.warnings = (f"{self._path}: objects above {_LARGEST} are left out; PNGs hold no more",)
        found = []
        for number in numbers[numbers <= _LARGEST].tolist():
            points = scene.xy[scene.labels == number]
            found.append((number, hull.outlines(points, _REACH * self._diagonal, _MARGIN * self._diagonal)))
        return sorted(found, key=lambda item: -cv2.contourArea(item[1][0]))
