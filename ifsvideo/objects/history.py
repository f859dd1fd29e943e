"""What an object did, frame by frame, and what happened to it: the sink that later outputs are made of."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ifsvideo.objects.boxes import point_box, steady_boxes
from ifsvideo.objects.contact import contact, stretch
from ifsvideo.objects.events import Sights, events_of, split
from ifsvideo.objects.kinematics import foot_step, steps, velocity
from ifsvideo.objects.standing import Standing
from ifsvideo.objects.table import Event, ObjectTable
from ifsvideo.types import BACKGROUND, FramePoints, Image, Scene, VideoInfo

__all__ = ["Event", "ObjectHistory", "ObjectTable"]

_THUMBNAIL = 160
"""Longer side of a thumbnail, pixels: a table's row on a screen of twice the usual density."""
_SURROUNDINGS = 0.15
"""What of the picture round the box a thumbnail shows, share of the box."""
_BETTER = 1.2
"""How much larger than the last thumbnail's an object's box must be for a new one to be taken."""


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
    foot: float


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
        self._standing = Standing(float(info.fps))
        self._frames = 0
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
            box = point_box(scene.xy[on_it], self._diagonal)
            grown = stretch(before[both], scene.xy[both])
            foot = foot_step(own, grown[0], scene.xy[both], box, before[ground], scene.xy[ground])
            points = int(np.count_nonzero(on_it))
            sight = _Sight(scene.frame, scene.time_s, points, box, own, around, grown, foot)
            self._sights.setdefault(number, []).append(sight)
            if image is not None and self.wants_image:
                self._keep_thumbnail(number, sight.box, image)
        self._before = FramePoints(scene.ids, scene.xy)
        self._standing.add(scene)
        self._frames += 1

    def finish(self) -> None:
        """Make the table and the events."""
        tables = {number: self._rows(number, sights) for number, sights in self._sights.items()}
        self.table = ObjectTable.joined(tables.values())
        found = [event for number, rows in tables.items() for event in self._events(number, rows)]
        self.events = tuple(sorted(found, key=lambda event: (event.frame, event.object)))

    def _events(self, number: int, rows: ObjectTable) -> Iterator[Event]:
        """What happened to one object."""
        foot = np.array([sight.foot for sight in self._sights[number]])
        around = np.array([np.hypot(*sight.around) for sight in self._sights[number]])
        for stretch_of in split(rows.frame, float(self._info.fps)):
            seen = rows.select(np.arange(len(rows))[stretch_of])
            first, last = (number, int(seen.frame[0])), (number, int(seen.frame[-1]))
            sights = Sights(
                seen,
                foot[stretch_of],
                around[stretch_of],
                self._standing.before.get(first, 0.0),
                self._standing.after.get(last, 0.0),
                again=stretch_of.start > 0,
            )
            yield from events_of(sights, self._info, self._frames)

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
