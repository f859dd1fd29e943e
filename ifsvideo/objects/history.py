"""What an object did, frame by frame, and what happened to it: the sink that later outputs are made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields

import cv2
import numpy as np
from numpy.typing import NDArray

from ifsvideo.types import BACKGROUND, Bools, Image, Ints, Scene, VideoInfo

_THUMBNAIL = 160
"""Longer side of a thumbnail, pixels: a table's row on a screen of twice the usual density."""
_SURROUNDINGS = 0.15
"""What of the picture round the box a thumbnail shows, share of the box."""
_BETTER = 1.2
"""How much larger than the last thumbnail's an object's box must be for a new one to be taken."""


@dataclass(frozen=True)
class ObjectTable:
    """One row for every object and frame in which it is seen, ordered by frame, then object.

    Lengths are pixels of the upright picture; NaN where nothing can be said.

    Attributes
    ----------
    frame : (N,) int32, from 0.
    time_s : (N,) float64, seconds of the input.
    object : (N,) int32, number of the object, 1, 2, ...
    points : (N,) int32, points seen on it.
    left, top, width, height : (N,) float32
        Box round the object. Its sides lie between pixels' middles: a box over all of a 640x360 picture has
        left -0.5, top -0.5, width 640, height 360.
    cx, cy : (N,) float32, middle of the box.
    vx, vy : (N,) float32
        Velocity against the background around it, pixels per second.
    scale_rate : (N,) float32
        Growth of its lengths in the picture, 1/s: 0.5 is half as long again per second; below 0 it shrinks.
    ttc_s : (N,) float32
        Time to contact, seconds: until it reaches the camera's plane if it goes on as it does. NaN unless it
        grows beyond noise.
    ttc_confidence : (N,) float32
        How sure it is that it grows, 0 to 1; 0 where ``ttc_s`` is NaN.
    """

    frame: NDArray[np.int32]
    time_s: NDArray[np.float64]
    object: NDArray[np.int32]
    points: NDArray[np.int32]
    left: NDArray[np.float32]
    top: NDArray[np.float32]
    width: NDArray[np.float32]
    height: NDArray[np.float32]
    cx: NDArray[np.float32]
    cy: NDArray[np.float32]
    vx: NDArray[np.float32]
    vy: NDArray[np.float32]
    scale_rate: NDArray[np.float32]
    ttc_s: NDArray[np.float32]
    ttc_confidence: NDArray[np.float32]

    def __post_init__(self) -> None:
        for item in fields(self):
            shape = getattr(self, item.name).shape
            if shape != (len(self.frame),):
                raise ValueError(f"expected {item.name} of shape ({len(self.frame)},), got {shape}")
        if (np.diff(self.frame) < 0).any():
            raise ValueError("rows must be ordered by frame")

    def __len__(self) -> int:
        return len(self.frame)

    @property
    def numbers(self) -> list[int]:
        """The objects' numbers, in order."""
        return [int(number) for number in np.unique(self.object)]

    def of(self, number: int) -> ObjectTable:
        """The rows of one object."""
        return self.select(self.object == number)

    def select(self, rows: Bools | Ints) -> ObjectTable:
        """Some of the rows: a mask (N,) or ascending indices."""
        return ObjectTable(*(getattr(self, item.name)[rows] for item in fields(self)))


@dataclass(frozen=True)
class Event:
    """Something that happened to an object.

    Attributes
    ----------
    frame : int, from 0.
    time_s : float, seconds of the input.
    object : int, number of the object.
    kind : str
        One of `ifsvideo.objects.events.KINDS`.
    text : str
        A sentence for people, without the time: "object 3 overtakes on the left".
    """

    frame: int
    time_s: float
    object: int
    kind: str
    text: str


class ObjectHistory:
    """Gathers what every object does (a `Sink`); memory grows with objects x frames, not with points.

    Parameters
    ----------
    info : VideoInfo

    Attributes
    ----------
    table : ObjectTable
    events : tuple of Event, by time
    thumbnails : mapping of an object's number to (H, W, 3) uint8 RGB, at most 160 pixels long
        From the frame in which it is largest; none where the input is tracks.

    `table` and `events` are there once `finish` was called.
    """

    table: ObjectTable
    events: tuple[Event, ...]

    def __init__(self, info: VideoInfo) -> None:
        self._info = info
        self._rows: list[tuple[float, ...]] = []
        self._thumbnails: dict[int, Image] = {}
        self._extent: dict[int, float] = {}

    @property
    def thumbnails(self) -> Mapping[int, Image]:
        """See the class."""
        return self._thumbnails

    def add(self, scene: Scene, image: Image | None) -> None:
        """Take the next frame."""
        for number in np.unique(scene.labels[scene.labels > BACKGROUND]).tolist():
            xy = scene.xy[scene.labels == number]
            left, top = xy.min(axis=0).tolist()
            width, height = np.ptp(xy, axis=0).tolist()
            self._rows.append((scene.frame, scene.time_s, number, len(xy), left, top, width, height))
            if image is not None:
                self._keep_thumbnail(number, (left, top, width, height), image)

    def finish(self) -> None:
        """Make the table and the events."""
        frame, time_s, number, points, left, top, width, height = (
            np.array(self._rows, np.float64).reshape(-1, 8).T
        )
        unknown = np.full(len(frame), np.nan, np.float32)
        self.table = ObjectTable(
            frame.astype(np.int32),
            time_s,
            number.astype(np.int32),
            points.astype(np.int32),
            left.astype(np.float32),
            top.astype(np.float32),
            width.astype(np.float32),
            height.astype(np.float32),
            cx=(left + width / 2).astype(np.float32),
            cy=(top + height / 2).astype(np.float32),
            vx=unknown,
            vy=unknown,
            scale_rate=unknown,
            ttc_s=unknown,
            ttc_confidence=np.zeros(len(frame), np.float32),
        )
        self.events = ()

    def _keep_thumbnail(self, number: int, box: tuple[float, ...], image: Image) -> None:
        left, top, width, height = box
        if width * height <= _BETTER * self._extent.get(number, 0.0):
            return
        reach = _SURROUNDINGS * max(width, height)
        x0, y0 = (max(0, round(start - reach)) for start in (left, top))
        x1, y1 = round(left + width + reach) + 1, round(top + height + reach) + 1
        cut = image[y0:y1, x0:x1]
        if cut.size == 0:
            return
        shrink = min(1.0, _THUMBNAIL / max(cut.shape[:2]))
        size = (max(1, round(shrink * cut.shape[1])), max(1, round(shrink * cut.shape[0])))
        self._thumbnails[number] = np.asarray(cv2.resize(cut, size, interpolation=cv2.INTER_AREA), np.uint8)
        self._extent[number] = width * height
