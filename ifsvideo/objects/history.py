"""What an object did, frame by frame, and what happened to it: the sink that later outputs are made of."""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from ifsvideo.objects.boxes import point_box, steady_boxes
from ifsvideo.objects.contact import contact, stretch
from ifsvideo.objects.events import Sights, events_of, split
from ifsvideo.objects.kinematics import foot_step, steps, velocity
from ifsvideo.objects.margins import Margin, Margins
from ifsvideo.objects.table import Event, ObjectTable
from ifsvideo.types import BACKGROUND, FramePoints, Image, Scene, VideoInfo

__all__ = ["Event", "ObjectHistory", "ObjectTable"]

_THUMBNAIL = 160
"""Longer side of a thumbnail, pixels: a table's row on a screen of twice the usual density."""
_SURROUNDINGS = 0.15
"""What of the picture round the box a thumbnail shows, share of the box."""
_BETTER = 1.2
"""How much larger than the last thumbnail's an object's box must be for a new one to be taken."""


_SIGHT = np.dtype(
    [
        ("frame", float),
        ("time_s", float),
        ("points", float),
        ("box", float, (4,)),
        ("own", float, (2,)),
        ("around", float, (2,)),
        ("stretch", float, (4,)),
        ("foot", float),
    ]
)
"""What is measured of one object in one frame; steps and stretch are those since the frame before."""


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
        self._margins = Margins(float(info.fps))
        self._frames = 0
        self._shots: list[int] = []
        self._sights: dict[int, array[float]] = {}
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
            sight = (scene.frame, scene.time_s, np.count_nonzero(on_it), *box, *own, *around, *grown, foot)
            self._sights.setdefault(number, array("d")).extend(sight)
            if image is not None and self.wants_image:
                self._keep_thumbnail(number, box, image)
        if len(scene.ids) and not known.any():
            self._shots.append(scene.frame)
        self._before = FramePoints(scene.ids, scene.xy)
        self._margins.add(scene)
        self._frames += 1

    def finish(self) -> None:
        """Make the table and the events."""
        self._shots.append(self._frames)
        self._margins.finish()
        tables: list[ObjectTable] = []
        found: list[Event] = []
        for number, numbers in self._sights.items():
            sights = np.frombuffer(numbers, _SIGHT).copy()
            rows = self._rows(number, sights)
            tables.append(rows)
            found += self._events(rows, sights)
        self.table = ObjectTable.joined(tables)
        self.events = tuple(sorted(found, key=lambda event: (event.frame, event.object)))

    def _rows(self, number: int, sights: NDArray[Any]) -> ObjectTable:
        """The table of one object."""
        fps = float(self._info.fps)
        # Seen again after a gap, its points may have been seen in the frame before as another's.
        again = np.diff(sights["frame"], prepend=-2) > 1
        for steps_since in ("own", "around", "stretch"):
            sights[steps_since][again] = np.nan
        size = (self._info.width, self._info.height)
        growth = sights["stretch"][:, 0]
        left, top, right, bottom = steady_boxes(sights["box"], sights["own"], growth, fps, size).T
        vx, vy = velocity(sights["own"], sights["around"], fps).T
        nearing = contact(sights["stretch"], fps)
        box = (left, top, right - left, bottom - top, (left + right) / 2, (top + bottom) / 2)
        measures = (*box, vx, vy, nearing.scale_rate, nearing.ttc_s, nearing.confidence)
        return ObjectTable(
            sights["frame"].astype(np.int32),
            sights["time_s"],
            np.full(len(sights), number, np.int32),
            sights["points"].astype(np.int32),
            *(measure.astype(np.float32) for measure in measures),
        )

    def _events(self, rows: ObjectTable, sights: NDArray[Any]) -> Iterator[Event]:
        """What happened to one object."""
        shots = np.array(self._shots)
        margins, number = self._margins, int(rows.object[0])
        # Tracks that go on all through a gap say that the object did not go.
        bridged = {first: margin.frames for (own, first), margin in margins.before.items() if own == number}
        for part in split(rows.frame, float(self._info.fps), bridged):
            seen = rows.select(np.arange(len(rows))[part])
            first, last = int(seen.frame[0]), int(seen.frame[-1])
            one = Sights(
                seen,
                sights["foot"][part],
                np.hypot(*sights["around"][part].T),
                margins.before.get((number, first), Margin()),
                margins.after.get((number, last), Margin()),
                again=part.start > 0,
                shot=(int(shots[shots <= first][-1]), int(shots[shots > last][0])),
            )
            yield from events_of(one, self._info)

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
