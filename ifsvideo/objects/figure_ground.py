"""Figure or ground: does a track lie on the object with which it moves, or on the ground beside it?

KLT follows a window. Where the outline of an object crosses a line of the background, a corner is found a few
pixels outside the object; its window sees the outline and rides along, and by its motion the track cannot be
told from the object's own. The picture can tell: every few frames the object's silhouette is found
(`ifsvideo.objects.sighting`), and each track near it is asked whether it lies there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ifsvideo.objects import parting
from ifsvideo.objects.parting import affine, lengths, middle
from ifsvideo.objects.recent_frames import RecentFrame, RecentFrames
from ifsvideo.objects.sighting import Sighting, around, look_for
from ifsvideo.objects.votes import Votes
from ifsvideo.types import BACKGROUND, Bools, FramePoints, Ints
from ifsvideo.video.picture import Picture

_LAGS_S = tuple(frames / 30 for frames in (1, 2, 3, 4, 6, 8, 10))
"""Seconds between the frame that is looked at and those that are compared with it: the shortest in which
object and ground part, before their looks change; at most so long."""
_KEPT = 3
"""Times the longest of these for which frames are kept: a new object is looked at in those before, too."""
_FEW, _ASTRAY = 3, 1.0
"""Labelled tracks of an object from which on they alone tell where it is, and how far beyond their view the
tracks that joined it may lie, share of the view: a thing does not fall apart."""
_SELDOM_S, _OFTEN_S = 0.134, 0.1
"""Longest and shortest time between two looks at an object of which more is to be told, seconds."""
_RARELY_S, _UNTOLD = 0.4, 0.2
"""Time between two looks, seconds, where nearly all tracks are told, and the share of those on and round the
object that may not be: what is followed for long has few new ones. With a larger share objects that come into
sight lose some of their tracks."""
_CARRIED_S = 0.15
"""How far a silhouette is carried to tracks that are not seen in its frame, seconds: to the next look. Twice
as far it errs more than it finds."""
_LOST = 0.22
"""Share of an object's tracks that may have ended since the last look, before the next one is due early."""
_HELD = 0.7
"""Share of the tracks of which a window has decided that a silhouette must hold. One that holds fewer is that
of a part, or of something else: what was taken for the ground moves with the object."""
_STANDS = 1.0
"""How far the ground's typical track goes at most over the longest of these times before a camera that
stands, pixels."""


@dataclass(frozen=True)
class _Look:
    """When an object was looked at last, and the tracks (T,) that it had."""

    place: int
    tracks: NDArray[np.int64]


class FigureGround:
    """Looks every few frames which tracks lie on an object's silhouette, and lets these looks vote.

    Tracks that move with an object but lie beside it are background. Tracks that are only guessed to be
    background join the object on which they lie, and show from then on where it is: what passes close by goes
    so fast that no track of it lasts long enough for a window to decide. So do those that a window called
    background, if more looks say so: a face of a turning thing may stand still for a while.

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
        self._seldom, self._often, self._rarely = _SELDOM_S * rate, _OFTEN_S * rate, _RARELY_S * rate
        self._carried = min(max(1, round(_CARRIED_S * rate)), self.lags[-1])
        self._recent = RecentFrames(_KEPT * self.lags[-1] + 1)
        self._looks: dict[int, _Look] = {}
        self._known: set[int] = set()
        """Objects that were looked at before."""
        self._votes = Votes(rate)

    def add(self, picture: Picture, points: FramePoints, labels: Ints, ground: Bools, guessed: Bools) -> None:
        """Take the next frame; looks at one for which frames enough are there on both sides.

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
        self._votes.decide(points.ids[(labels > BACKGROUND) & ~guessed])
        self._recent.add(RecentFrame(picture, points, labels, ground, guessed, self._scale))
        if self._recent.count > self.lags[-1]:
            self._look(self._recent.count - 1 - self.lags[-1])

    def finish(self) -> None:
        """Look at the last frames too: no more will come."""
        for place in range(max(0, self._recent.count - self.lags[-1]), self._recent.count):
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
        return self._votes.corrected(ids, labels, guessed)

    def forget(self, gone: NDArray[np.int64]) -> None:
        """Drop what is known of some tracks (T,) that have ended; one that comes again is a new one."""
        self._votes.forget(gone)

    def _labels_in(self, frame: RecentFrame) -> NDArray[np.int64]:
        """Labels (N,) of a frame's points, with what joined so far."""
        return self._votes.joined(frame.points.ids, frame.labels, frame.guessed)

    def _look(self, place: int) -> None:
        """Look at the objects in a frame that have not been looked at for long."""
        here = self._recent[place]
        labels = self._labels_in(here)
        looks, due = {}, []
        for number in np.unique(labels[labels > BACKGROUND]).tolist():
            look, own = self._looks.get(number), labels == number
            if look is None or self._is_due(look, place, number, own):
                look = _Look(place, here.points.ids[own])
                due.append(number)
            looks[number] = look
        # The camera is asked last: in most frames nobody is due.
        if not looks or (not due and looks.keys() == self._looks.keys()) or self._camera_stands(place):
            return
        for number in due:
            self._look_at(place, number, labels == number)
            if number not in self._known:
                self._known.add(number)
                self._look_back(place, number)
        self._looks = looks

    def _look_back(self, place: int, number: int) -> None:
        """Look at a new object in the frames before: it was in sight, but no window knew that it moves."""
        step = max(1, round(self._seldom))
        while (there := self._recent.get(place := place - step)) is not None:
            own = self._labels_in(there) == number
            if np.count_nonzero(own) < _FEW:
                return
            self._look_at(place, number, own)

    def _camera_stands(self, place: int) -> bool:
        """Whether the ground keeps its place.

        Then what lies on it stands by itself; and who walks before it moves his limbs otherwise than himself,
        so that his silhouette would not hold them.
        """
        here, farthest = self._recent[place], self.lags[-1]
        ids, xy = here.points.ids[here.ground], here.points.xy[here.ground]
        for end in (max(0, place - farthest), min(self._recent.count - 1, place + farthest)):
            step = lengths(self._recent[end].points.positions(ids) - xy)
            seen = step[np.isfinite(step)]
            if len(seen) and middle(seen) > _STANDS:
                return False
        return True

    def _is_due(self, look: _Look, place: int, number: int, own: Bools) -> bool:
        """Whether an object, of which some tracks (N,) of a frame are, is to be looked at there again."""
        since = place - look.place
        if since < self._often or since >= self._rarely:
            return since >= self._rarely
        here = self._recent[place]
        near = here.guessed & (here.labels <= BACKGROUND)
        near[near] = around(here, own).contains(here.xy[near])
        told = self._votes.told(here.points.ids[own | near], number)
        if np.count_nonzero(told) >= (1 - _UNTOLD) * len(told):
            return False
        left = np.count_nonzero(np.isin(look.tracks, here.points.ids[own], assume_unique=True))
        return bool(since >= self._seldom or left < (1 - _LOST) * len(look.tracks))

    def _look_at(self, place: int, number: int, own: Bools) -> None:
        """Find the silhouette of an object in a frame, where its own tracks (N,) are known, and count the
        votes of the tracks round it."""
        here = self._recent[place]
        xy, ids, labelled = here.xy, here.points.ids, here.labels == number
        told = labelled if np.count_nonzero(labelled) >= _FEW else own
        astray = own & ~around(here, told).contains(xy, _ASTRAY)
        self._votes.deny(ids[astray], number)
        own = own & ~astray
        seen = look_for(self._recent, place, own, self.lags)
        if seen is None:
            return
        rows = np.flatnonzero(seen.view.contains(xy))
        on = seen.lies_on(xy[rows])
        held = on[(labelled & ~here.guessed)[rows]]
        if np.count_nonzero(held) < _HELD * len(held):
            return
        guessed = here.guessed & (here.labels <= BACKGROUND)
        decided = ~here.guessed & (here.labels == BACKGROUND)
        for asked in (labelled, decided):
            self._votes.cast(ids[rows[asked[rows]]], number, on[asked[rows]])
        free = guessed[rows]
        along = seen.goes_along(xy, rows[free])
        self._votes.cast(ids[rows[free]], number, on[free] & along)
        self._carry(seen, place, number, own)

    def _carry(self, seen: Sighting, place: int, number: int, own: Bools) -> None:
        """Carry a silhouette with its object to the frames next to its own, and count the votes of tracks
        that have ended before it, or begin after: many live for a frame or two."""
        here = self._recent[place]
        ids, xy, known = here.points.ids[own], here.xy[own], here.points.ids
        for lag in range(1, self._carried + 1):
            for other in (self._recent.get(place - lag), self._recent.get(place + lag)):
                if other is None:
                    continue
                free = other.guessed & ((other.labels <= BACKGROUND) | (other.labels == number))
                asked = np.flatnonzero(free & ~np.isin(other.points.ids, known, assume_unique=True))
                there = other.of(ids)
                both = np.isfinite(there[:, 0])
                if not len(asked) or np.count_nonzero(both) < _FEW:
                    continue
                # Each is asked once, where it is nearest in time.
                tracks = other.points.ids[asked]
                known = np.concatenate([known, tracks])
                step = np.asarray(xy[both] - there[both], np.float64)
                carried = np.asarray(other.xy[asked] + affine(there[both], step, other.xy[asked]), np.float32)
                near = seen.view.contains(carried)
                self._votes.cast(tracks[near], number, seen.lies_on(carried[near]))
