"""What moves in real clips, marked by hand: coordinates only, the clips themselves are not in the package.

The file ``marks/NAME.toml`` belongs to the clip, or the folder, of that name. All boxes are [left, top,
width, height], pixels of the upright picture.

clip, masks    where frames and masks (``.png``, one for each frame, 0 for what stands) lie below the folder
border         points so near to a mask's border are not counted, pixels
[[frame]]      number (from 0), moving (boxes that hold what moves), uncounted (boxes; they win over moving)
[[passing]]    what, frames, boxes (one for each of these frames, linear between them): what moves outside the
               masks and is not counted

Where there are masks every frame is judged, otherwise those that are listed.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from ifsvideo.errors import InputError
from ifsvideo.types import LabelTable

MOVES, STANDS, UNCOUNTED = 1, 0, -1
"""What a point is in truth."""
Box = tuple[float, float, float, float]
"""Left, top, width, height, pixels."""
_FOLDER = Path(__file__).with_name("marks")


@dataclass(frozen=True)
class FrameMarks:
    """Boxes of one frame."""

    number: int
    moving: tuple[Box, ...] = ()
    uncounted: tuple[Box, ...] = ()


@dataclass(frozen=True)
class Passing:
    """Something that moves outside the masks: a box at each of some frames, linear between them."""

    what: str
    frames: tuple[int, ...]
    boxes: tuple[Box, ...]

    def __post_init__(self) -> None:
        if len(self.frames) != len(self.boxes) or (np.diff(self.frames) <= 0).any():
            raise ValueError(f"{self.what}: expected a box for each frame, frames ascending")

    def at(self, frame: int) -> Box | None:
        """Its box in a frame, None before the first and after the last."""
        if not self.frames[0] <= frame <= self.frames[-1]:
            return None
        left, top, width, height = (
            np.interp(frame, self.frames, side) for side in zip(*self.boxes, strict=True)
        )
        return float(left), float(top), float(width), float(height)


@dataclass(frozen=True)
class Marks:
    """What moves in one clip; see above."""

    clip: str = ""
    masks: str = ""
    border: int = 0
    frame: tuple[FrameMarks, ...] = ()
    passing: tuple[Passing, ...] = ()

    def truth(self, table: LabelTable, place: Path) -> NDArray[np.int8]:
        """What each row of the labels of the clip is: `MOVES`, `STANDS` or `UNCOUNTED`.

        Parameters
        ----------
        table : LabelTable
        place : Path
            Clip or folder that the marks belong to.

        Raises
        ------
        InputError
            If masks are not as many as frames, one cannot be read, or the clip ends before a marked frame.
        """
        truth = np.full(len(table.frame), UNCOUNTED, dtype=np.int8)
        if self.masks:
            for frame, mask in enumerate(_masks(place / self.masks, table.frames)):
                rows = table.at(frame)
                truth[rows] = self._under_mask(table.xy[rows], frame, mask)
        for marks in self.frame:
            if marks.number >= table.frames:
                raise InputError(
                    f"{place}: has {table.frames} frames, frame {marks.number} is marked; give all"
                )
            rows = table.at(marks.number)
            truth[rows] = np.where(_inside(table.xy[rows], marks.moving), MOVES, STANDS)
            truth[rows][_inside(table.xy[rows], marks.uncounted)] = UNCOUNTED
        return truth

    def _under_mask(self, xy: NDArray[np.float32], frame: int, mask: NDArray[np.uint8]) -> NDArray[np.int8]:
        """What points (N, 2) of one frame are; a point just outside the picture takes the border's."""
        limit = np.array(mask.shape[::-1]) - 1
        column, row = np.rint(xy).clip(0, limit).astype(np.intp).T
        moves = mask[row, column] > 0
        truth = np.where(moves, MOVES, STANDS).astype(np.int8)
        boxes = [box for thing in self.passing if (box := thing.at(frame))]
        truth[~moves & _inside(xy, boxes)] = UNCOUNTED
        if self.border:
            reach = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * self.border + 1, 2 * self.border + 1))
            near = cv2.dilate(mask, reach) != cv2.erode(mask, reach)
            truth[near[row, column]] = UNCOUNTED
        return truth


def marks_of(place: Path) -> Marks:
    """The marks of a clip or folder, by its name.

    Raises
    ------
    InputError
        If nobody marked a clip of that name.
    """
    file = _FOLDER / f"{place.name if place.is_dir() else place.stem}.toml"
    if not file.is_file():
        known = ", ".join(sorted(each.stem for each in _FOLDER.glob("*.toml")))
        raise InputError(f"{place}: nobody marked a clip of that name; there are marks of {known}")
    return read_marks(file)


def read_marks(file: Path) -> Marks:
    """Read a file of marks."""
    content: dict[str, Any] = tomllib.loads(file.read_text(encoding="utf-8"))
    frames = tuple(
        FrameMarks(one["number"], _boxes(one.get("moving", [])), _boxes(one.get("uncounted", [])))
        for one in content.pop("frame", [])
    )
    passing = tuple(
        Passing(one["what"], tuple(one["frames"]), _boxes(one["boxes"])) for one in content.pop("passing", [])
    )
    return Marks(**content, frame=frames, passing=passing)


def _boxes(lists: list[list[float]]) -> tuple[Box, ...]:
    return tuple((left, top, width, height) for left, top, width, height in lists)


def _inside(xy: NDArray[np.float32], boxes: tuple[Box, ...] | list[Box]) -> NDArray[np.bool_]:
    """Whether points (N, 2) lie in one of the boxes; a box ends half a pixel beyond its outermost ones."""
    within = np.zeros(len(xy), dtype=bool)
    for left, top, width, height in boxes:
        low = np.array([left, top]) - 0.5
        high = low + np.array([width, height])
        within |= ((xy >= low) & (xy < high)).all(axis=1)
    return within


def _masks(folder: Path, frames: int) -> list[NDArray[np.uint8]]:
    """The masks (H, W) of a folder, as many as there are frames."""
    files = sorted(folder.glob("*.png"))
    if len(files) != frames:
        raise InputError(
            f"{folder}: holds {len(files)} masks for {frames} frames; give the clip with its masks"
        )
    return [_mask(file) for file in files]


def _mask(file: Path) -> NDArray[np.uint8]:
    image = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)
    if image is None:
        raise InputError(f"{file}: is no picture; fetch the clip with its masks again")
    return image.astype(np.uint8, copy=False)
