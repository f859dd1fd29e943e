"""Figure or ground: does a track lie on the object with which it moves, or on the ground beside it?

KLT follows a window. Where the outline of an object crosses a line of the background, a corner is found a few
pixels outside the object; its window sees the outline and rides along, and by its motion the track cannot be
told from the object's own. The picture can tell: every few frames the object's silhouette is found
(`ifsvideo.objects.silhouette`), and each track near it is asked whether it lies there.
"""

from __future__ import annotations

import math
from collections import Counter, deque
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from ifsvideo.objects import parting
from ifsvideo.objects.parting import NODES, PARTED, Motions, how_far_parted, lengths, middle
from ifsvideo.objects.silhouette import Flow, Parted, View, find_silhouette
from ifsvideo.tracking.tracker import shrunk, tracked_size
from ifsvideo.types import BACKGROUND, Bools, FramePoints, Image, Ints
from ifsvideo.video.picture import Picture

_LAGS_S = tuple(frames / 30 for frames in (1, 2, 3, 4, 6, 8, 10))
"""Seconds between the frame that is looked at and those that are compared with it: the shortest in which
object and ground part, before their looks change; at most so long."""
_COMPARED = 2
"""Frames that are compared, on each side."""
_ACCELERATION = 0.7
"""Share of the time that two motions need to part, told by a shorter one, before which it is not tried."""
_GROWTH, _MARGIN = 0.1, 10.0
"""How far beyond its tracks an object may reach, share of their box and pixels. With half of the box false
objects spread over what moves nearly alike."""
_FEW, _ASTRAY = 3, 1.0
"""Labelled tracks of an object from which on they alone tell where it is, and how far beyond their view the
tracks that joined it may lie, share of the view: a thing does not fall apart."""
_SMALLEST = 8
"""Least side of a view, pixels: in a smaller one there is no outline."""
_TOUCHED, _GROWN = 0.1, 0.4
"""Share of a side of its view that a silhouette covers where the object goes on beyond it, and how much
farther is looked then, share of the view."""
_SELDOM_S, _OFTEN_S = 0.134, 0.034
"""Longest and shortest time between two looks at an object, seconds."""
_LOST = 0.22
"""Share of an object's tracks that may have ended since the last look: so each track is asked some four times
in its life."""
_LEAVES, _SURE_LEAVES = 1, 2
"""Looks by which a track must have lain beside its object more often than on it: one that is guessed to be
the object's, and one of which a window has decided."""
_SLOW = 20.0
"""Frames a second below which it takes one look more: pictures that are a tenth of a second apart differ by
more than two motions. Without this a fiftieth of what moves in KT3DMoSeg goes to the background."""
_HELD = 0.7
"""Share of the tracks of which a window has decided that a silhouette must hold. One that holds fewer is that
of a part, or of something else: what was taken for the ground moves with the object."""
_STANDS = 1.0
"""How far the ground's typical track goes at most over the longest of these times before a camera that
stands, pixels."""


class _Seen:
    """A frame among the last: its points, in pixels of the picture as it is tracked, and what they are."""

    def __init__(
        self, picture: Picture, points: FramePoints, labels: Ints, ground: Bools, guessed: Bools, scale: float
    ) -> None:
        self.points = points
        self.labels, self.ground, self.guessed = labels, ground, guessed
        self._picture = picture
        self._scale = scale

    # Made when first asked for: where nothing moves, nobody does.
    @cached_property
    def grey(self) -> Image:
        """(H, W) the picture in the size in which it is tracked."""
        return shrunk(self._picture.grey, *self.size)

    @cached_property
    def size(self) -> tuple[int, int]:
        """(W, H) in which it is tracked."""
        return tracked_size(*self._picture.size, self._scale)

    @cached_property
    def _per_pixel(self) -> NDArray[np.float64]:
        """Pixels of this size per pixel of the coordinates, along x and y."""
        return np.array(self.size) / self._picture.size

    def colours_of(self, view: View) -> Image:
        """(height, width, 3) the colours of a view's box, in that size."""
        if self.size == self._picture.size:
            return self._picture.rgb_of(view.left, view.top, view.width, view.height)
        return view.box(np.asarray(cv2.resize(self._picture.rgb, self.size), np.uint8))

    @cached_property
    def xy(self) -> NDArray[np.float32]:
        """(N, 2) the points."""
        return self._scaled(self.points.xy)

    def of(self, ids: NDArray[np.int64]) -> NDArray[np.float32]:
        """Where tracks are (M, 2); NaN where one is not seen."""
        return self._scaled(self.points.positions(ids))

    def _scaled(self, xy: NDArray[np.float32]) -> NDArray[np.float32]:
        return np.asarray((xy + 0.5) * self._per_pixel - 0.5, np.float32)


@dataclass(frozen=True)
class _Look:
    """When an object was looked at last, and the tracks (T,) that it had."""

    place: int
    tracks: NDArray[np.int64]


@dataclass(frozen=True)
class _Sight:
    """A silhouette (rows, columns) in its view, and the frames that told it, with the tracks (N, 2) there."""

    view: View
    silhouette: Bools
    others: list[tuple[Parted, NDArray[np.float32]]]


class FigureGround:
    """Looks every few frames which tracks lie on an object's silhouette, and lets these looks vote.

    Tracks that move with an object but lie beside it are background. Tracks that are only guessed to be
    background join the object on which they lie, and show from then on where it is: what passes close by goes
    so fast that no track of it lasts long enough for a window to decide.

    Of the frames only the last few are kept, and of every track the votes.

    Parameters
    ----------
    scale : float
        Share of the picture's size in which it was tracked.
    fps : float, optional
        Frames a second; 30 where nobody told.

    Examples
    --------
    ::

        check = FigureGround()
        for picture, points, labels in frames:
            check.add(picture, points, labels, labels == 0, guessed)
        check.finish()
        labels = check.corrected(points.ids, labels, guessed)
    """

    def __init__(self, scale: float = 1.0, fps: float | None = None) -> None:
        rate = fps or 30.0
        self._scale = scale
        self.lags = parting.lags(rate, _LAGS_S)
        """Frames between two pictures that are compared."""
        self._seldom, self._often = _SELDOM_S * rate, _OFTEN_S * rate
        self._patience = int(rate < _SLOW)
        self._recent: deque[_Seen] = deque(maxlen=2 * self.lags[-1] + 1)
        self._frames = 0
        self._looks: dict[int, _Look] = {}
        self._votes: Counter[tuple[int, int]] = Counter()
        """Of each track and object: looks in which it lay there, less those in which it did not."""
        self._decided: set[int] = set()
        """Tracks that windows have decided to be an object's."""

    def add(self, picture: Picture, points: FramePoints, labels: Ints, ground: Bools, guessed: Bools) -> None:
        """Take the next frame; looks at the one in the middle of those that are kept.

        Parameters
        ----------
        picture : Picture, in the size of the coordinates.
        points : FramePoints, ordered by id.
        labels : (N,) int
            0 background, 1, 2, ... moving, -1 undecided.
        ground : (N,) bool
            Which tracks show how the ground moves.
        guessed : (N,) bool
            Which labels are but guesses: of tracks seen so shortly that they only follow their neighbours,
            or of which windows do not agree.
        """
        self._decided.update(points.ids[(labels > BACKGROUND) & ~guessed].tolist())
        self._recent.append(_Seen(picture, points, labels, ground, guessed, self._scale))
        self._frames += 1
        if self._frames > self.lags[-1]:
            self._look(self._frames - 1 - self.lags[-1])

    def finish(self) -> None:
        """Look at the last frames too: no more will come."""
        for place in range(max(0, self._frames - self.lags[-1]), self._frames):
            self._look(place)

    def corrected(self, ids: NDArray[np.int64], labels: Ints, guessed: Bools) -> NDArray[np.int64]:
        """Labels (N,) of some observations by all looks so far.

        Parameters
        ----------
        ids : (N,) int64
            Their tracks.
        labels : (N,) int
        guessed : (N,) bool
        """
        result = labels.astype(np.int64)
        beside: dict[int, list[int]] = {}
        for (track, number), vote in self._votes.items():
            needed = self._patience + (_SURE_LEAVES if track in self._decided else _LEAVES)
            if vote <= -needed:
                beside.setdefault(number, []).append(track)
        for number, tracks in beside.items():
            result[(labels == number) & np.isin(ids, tracks)] = BACKGROUND
        free = guessed & (labels <= BACKGROUND)
        result[free] = self._joined(ids[free], labels[free])
        return result

    def _joined(self, ids: NDArray[np.int64], labels: Ints) -> NDArray[np.int64]:
        """Labels (N,) of tracks that are guessed to be background, those that lay on an object by it."""
        number_of = {track: number for (track, number), vote in self._votes.items() if vote > 0}
        known = zip(ids.tolist(), labels.tolist(), strict=True)
        return np.array([number_of.get(track, label) for track, label in known], np.int64)

    def forget(self, gone: NDArray[np.int64]) -> None:
        """Drop what is known of some tracks (T,) that have ended; one that comes again is a new one."""
        ended = set(gone.tolist())
        for key in [key for key in self._votes if key[0] in ended]:
            del self._votes[key]
        self._decided -= ended

    def _look(self, place: int) -> None:
        """Look at the objects in a frame that have not been looked at for long."""
        here = self._recent[place - self._frames]
        free = here.guessed & (here.labels <= BACKGROUND)
        labels = here.labels.astype(np.int64)
        labels[free] = self._joined(here.points.ids[free], labels[free])
        looks, due = {}, []
        for number in np.unique(labels[labels > BACKGROUND]).tolist():
            look = self._looks.get(number)
            tracks = here.points.ids[labels == number]
            if look is None or self._is_due(look, place, tracks):
                look = _Look(place, tracks)
                due.append(number)
            looks[number] = look
        # The camera is asked last: in most frames nobody is due.
        if not looks or (not due and looks.keys() == self._looks.keys()) or self._camera_stands(here):
            return
        for number in due:
            self._look_at(here, number, labels == number, place)
        self._looks = looks

    def _camera_stands(self, here: _Seen) -> bool:
        """Whether the ground keeps its place.

        Then what lies on it stands by itself; and who walks before it moves his limbs otherwise than himself,
        so that his silhouette would not hold them.
        """
        ids, xy = here.points.ids[here.ground], here.points.xy[here.ground]
        for other in (self._recent[0], self._recent[-1]):
            step = lengths(other.points.positions(ids) - xy)
            seen = step[np.isfinite(step)]
            if len(seen) and middle(seen) > _STANDS:
                return False
        return True

    def _is_due(self, look: _Look, place: int, tracks: NDArray[np.int64]) -> bool:
        since = place - look.place
        if since >= self._seldom:
            return True
        if since < self._often:
            return False
        left = np.count_nonzero(np.isin(look.tracks, tracks, assume_unique=True))
        return bool(left < (1 - _LOST) * len(look.tracks))

    def _look_at(self, here: _Seen, number: int, own: Bools, place: int) -> None:
        """Find the silhouette of an object in a frame, where its own tracks (N,) are known, and count the
        votes of the tracks round it."""
        xy, labelled = here.xy, here.labels == number
        told = labelled if np.count_nonzero(labelled) >= _FEW else own
        astray = own & ~View.around(xy[told], _GROWTH, _MARGIN, here.size).contains(xy, _ASTRAY)
        for track in here.points.ids[astray].tolist():
            self._votes[track, number] = min(self._votes[track, number], 0) - 1
        own = own & ~astray
        seen = self._find(here, own, place, View.around(xy[own], _GROWTH, _MARGIN, here.size))
        if seen is None:
            return
        wider = seen.view.grown_beyond(seen.silhouette, _TOUCHED, _GROWN, here.size)
        if wider != seen.view:
            seen = self._find(here, own, place, wider) or seen
        rows = np.flatnonzero(seen.view.contains(xy))
        on = _lies_on(seen.silhouette, seen.view, xy[rows])
        held = on[(labelled & ~here.guessed)[rows]]
        if np.count_nonzero(held) < _HELD * len(held):
            return
        tracks = here.points.ids[rows].tolist()
        for k in np.flatnonzero(labelled[rows]).tolist():
            self._votes[tracks[k], number] += 1 if on[k] else -1
        free = np.flatnonzero((here.guessed & (here.labels <= BACKGROUND))[rows])
        along = _go_along(rows[free], xy, seen.view, seen.others)
        for k, goes in zip(free.tolist(), (on[free] & along).tolist(), strict=True):
            self._votes[tracks[k], number] += 1 if goes else -1

    def _find(self, here: _Seen, own: Bools, place: int, view: View) -> _Sight | None:
        """The silhouette of an object in a view; None where its motion or the ground's is not known, or they
        have not parted."""
        ground = here.ground & ~own
        motions = Motions(view, here.xy, own, ground, here.guessed, math.hypot(*here.size) / 800)
        if not motions.known or min(view.width, view.height) < _SMALLEST:
            return None
        sides = [self._parted(motions, here.points.ids, place, way) for way in (-1, 1)]
        if not any(sides):
            return None
        parted = [[one for one, _ in side] for side in sides]
        silhouette = find_silhouette(view, here.grey, here.colours_of(view), parted)
        return _Sight(view, silhouette, [pair for side in sides for pair in side])

    def _parted(
        self, motions: Motions, ids: NDArray[np.int64], place: int, way: int
    ) -> list[tuple[Parted, NDArray[np.float32]]]:
        """The nearest frames before (-1) or after (1) in which object and ground have parted, and where the
        tracks (N, 2) are there."""
        found: list[tuple[Parted, NDArray[np.float32]]] = []
        least = 0.0
        for lag in self.lags:
            back = self._frames - (place + way * lag)
            if not 0 < back <= len(self._recent) or len(found) == _COMPARED:
                break
            if lag < least:
                continue
            other = self._recent[-back]
            there = other.of(ids)
            flows = motions.to(there)
            if flows is None:
                break
            parts = how_far_parted(*flows)
            if parts >= PARTED:
                found.append((Parted(other.grey, *flows), there))
            else:
                # No fit for times in which they cannot have parted yet.
                least = _ACCELERATION * lag * PARTED / max(parts, 1e-6)
        return found


def _lies_on(silhouette: Bools, view: View, xy: NDArray[np.float32]) -> Bools:
    """Whether points (N, 2) in a view lie on a silhouette."""
    rows, columns = silhouette.shape
    column, row = np.rint(view.places(xy, columns, rows)).astype(int).T
    return np.asarray(silhouette[row.clip(0, rows - 1), column.clip(0, columns - 1)], bool)


def _go_along(
    tracks: NDArray[np.intp],
    xy: NDArray[np.float32],
    view: View,
    others: list[tuple[Parted, NDArray[np.float32]]],
) -> Bools:
    """Whether tracks move rather as the object than as the ground; so those do that are seen once."""
    lead = np.zeros(len(tracks))
    if not len(tracks):
        return lead >= 0
    place = view.places(xy[tracks], NODES, NODES)
    for parted, there in others:
        step = there[tracks] - xy[tracks]
        to_object, to_ground = (
            lengths(step - _at(flow, place)) for flow in (parted.with_object, parted.with_ground)
        )
        lead += np.nan_to_num(to_ground - to_object)
    return np.asarray(lead >= 0, bool)


def _at(flow: Flow, place: NDArray[np.float32]) -> NDArray[np.float32]:
    """The flow (N, 2) at places (N, 2) in pixels of its nodes, bilinear between them."""
    # Not cv2.remap: it takes 32766 points at most, and a tracker of one's own may give more.
    x, y = place.T
    return np.stack(
        [
            map_coordinates(one, [y, x], np.float32, order=1, mode="nearest")
            for one in np.moveaxis(flow, 2, 0)
        ],
        axis=1,
    )
