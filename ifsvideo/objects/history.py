"""What an object did, frame by frame, and what happened to it: the sink that later outputs are made of."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields

import cv2
import numpy as np
from numpy.typing import NDArray

from ifsvideo.objects.boxes import point_box, steady_boxes
from ifsvideo.objects.contact import contact, stretch
from ifsvideo.objects.kinematics import steps, velocity
from ifsvideo.types import BACKGROUND, Bools, FramePoints, Image, Ints, Scene, VideoInfo

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

    @classmethod
    def empty(cls) -> ObjectTable:
        """A table without a row."""
        columns = [np.empty(0, np.float32) for _ in range(len(fields(cls)) - 4)]
        whole = np.empty(0, np.int32)
        return cls(whole, np.empty(0, np.float64), whole, whole, *columns)

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


@dataclass(frozen=True)
class _Sight:
    """What is measured of one object in one frame; steps and stretch are those since the frame before."""

    frame: int
    time_s: float
    points: int
    box: NDArray[np.float64]
    own: NDArray[np.float64]
    around: NDArray[np.float64]
    stretch: NDArray[np.float64]


class ObjectHistory:
    """Gathers what every object does (a `Sink`); memory grows with objects x frames, not with points.

    Parameters
    ----------
    info : VideoInfo
    thumbnails : bool, optional
        Whether a picture of every object is kept; frames are wanted only then.

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

    def __init__(self, info: VideoInfo, *, thumbnails: bool = False) -> None:
        self.wants_image = thumbnails
        self.thumbnails: dict[int, Image] = {}
        self._info = info
        self._diagonal = float(np.hypot(info.width, info.height))
        self._before = FramePoints(np.empty(0, np.int64), np.empty((0, 2), np.float32))
        self._sights: dict[int, list[_Sight]] = {}
        self._extent: dict[int, float] = {}

    def add(self, scene: Scene, image: Image | None) -> None:
        """See `ifsvideo.types.Sink`."""
        before = self._before.positions(scene.ids)
        known = np.isfinite(before).all(axis=1)
        ground = known & (scene.labels == BACKGROUND)
        for number in np.unique(scene.labels[scene.labels > BACKGROUND]).tolist():
            on_it = scene.labels == number
            both = on_it & known
            own, around = steps(before[both], scene.xy[both], before[ground], scene.xy[ground])
            sight = _Sight(
                scene.frame,
                scene.time_s,
                int(np.count_nonzero(on_it)),
                point_box(scene.xy[on_it], self._diagonal),
                own,
                around,
                stretch(before[both], scene.xy[both]),
            )
            self._sights.setdefault(number, []).append(sight)
            if image is not None and self.wants_image:
                self._keep_thumbnail(number, sight.box, image)
        self._before = FramePoints(scene.ids, scene.xy)

    def finish(self) -> None:
        """Make the table and the events."""
        self.table = _joined(self._rows(number, sights) for number, sights in self._sights.items())
        self.events = ()

    def _rows(self, number: int, sights: list[_Sight]) -> ObjectTable:
        """The table of one object."""
        fps = float(self._info.fps)
        frame = np.array([sight.frame for sight in sights], np.int32)
        own, around, stretched, boxes = (
            np.array([getattr(sight, name) for sight in sights])
            for name in ("own", "around", "stretch", "box")
        )
        # Seen again after a gap, its points may have been seen in the frame before as another's.
        again = np.diff(frame, prepend=-2) > 1
        for steps_since in (own, around, stretched):
            steps_since[again] = np.nan
        size = (self._info.width, self._info.height)
        left, top, right, bottom = steady_boxes(boxes, own, stretched[:, 0], fps, size).T
        vx, vy = velocity(own, around, fps).T
        nearing = contact(stretched, fps)
        box = (left, top, right - left, bottom - top, (left + right) / 2, (top + bottom) / 2)
        measures = (*box, vx, vy, nearing.scale_rate, nearing.ttc_s, nearing.confidence)
        return ObjectTable(
            frame,
            np.array([sight.time_s for sight in sights]),
            np.full(len(sights), number, np.int32),
            np.array([sight.points for sight in sights], np.int32),
            *(measure.astype(np.float32) for measure in measures),
        )

    def _keep_thumbnail(self, number: int, box: NDArray[np.float64], image: Image) -> None:
        """Cut the object out, where it is larger than in the picture of it that is kept."""
        left, top, right, bottom = box.tolist()
        extent = (right - left) * (bottom - top)
        if extent <= _BETTER * self._extent.get(number, 0.0):
            return
        reach = _SURROUNDINGS * max(right - left, bottom - top)
        x0, y0 = (max(0, round(start - reach)) for start in (left, top))
        cut = image[y0 : round(bottom + reach) + 1, x0 : round(right + reach) + 1]
        if cut.size == 0:
            return
        shrink = min(1.0, _THUMBNAIL / max(cut.shape[:2]))
        size = (max(1, round(shrink * cut.shape[1])), max(1, round(shrink * cut.shape[0])))
        self.thumbnails[number] = np.asarray(cv2.resize(cut, size, interpolation=cv2.INTER_AREA), np.uint8)
        self._extent[number] = extent


def _joined(tables: Iterable[ObjectTable]) -> ObjectTable:
    """One table of several, ordered."""
    parts = [ObjectTable.empty(), *tables]
    columns = {
        item.name: np.concatenate([getattr(part, item.name) for part in parts])
        for item in fields(ObjectTable)
    }
    order = np.lexsort((columns["object"], columns["frame"]))
    return ObjectTable(**{name: column[order] for name, column in columns.items()})
