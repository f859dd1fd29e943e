"""Labels of one shot, from its first frame to its last, as they become final."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ifsvideo.config import ObjectsConfig
from ifsvideo.objects.camera_fixed import CameraFixed
from ifsvideo.objects.figure_ground import FigureGround
from ifsvideo.objects.linked import LinkedWindow
from ifsvideo.objects.linking import Linker
from ifsvideo.objects.numbering import Numbers
from ifsvideo.objects.still_objects import still_objects
from ifsvideo.objects.windows import Bounds, WindowLabels, Windows, WindowSize, gather, long_enough
from ifsvideo.types import BACKGROUND, UNDECIDED, Bools, FramePoints, Tracks
from ifsvideo.video.picture import Picture


class Promise(Protocol):
    """Labels of a window that are being made."""

    def done(self) -> bool:
        """Whether they are there."""
        ...

    def value(self) -> WindowLabels:
        """The labels, once they are there."""
        ...


BeginWindow = Callable[[Tracks], Promise]
"""Begins to label the tracks of a window."""

_UNDER_WAY = 2
"""Windows that may be under way before the next frame has to wait."""


@dataclass(eq=False)
class Frame:
    """One frame on its way to its labels.

    Attributes
    ----------
    place : int
        Frames of the clip before it.
    points : FramePoints, ordered by id.
    picture : Picture or None
    shown : int
        How often it is shown, one time after the other.
    labels : (N,) int
        Final once the frame comes out of a `Shot`.
    guessed : (N,) bool
        Whether the label is but a guess: the window that labels the frame could not decide of the point's
        track, for it is too short, or it calls it background and another window does not.
    """

    place: int
    points: FramePoints
    picture: Picture | None = None
    shown: int = 1
    labels: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    guessed: Bools = field(default_factory=lambda: np.empty(0, np.bool_))


@dataclass(frozen=True)
class _Window:
    """A window that is being labelled, and the tracks that were known to be fixed to the camera when that
    began."""

    bounds: Bounds
    tracks: Tracks
    fixed: NDArray[np.int64]
    labels: Promise


class Shot:
    """Collects frames, has their windows labelled, links these, checks borders, and numbers the objects.

    Whether an observation moves is what the window says whose centre is nearest in time, but for one that
    those before and after deny; with which object, what most windows say of its track. A frame comes out when
    the second window after that one is linked: so its labels rest on what is seen up to there, less than two
    windows later, and on nothing beyond, however long the labelling of a window takes.

    Parameters
    ----------
    label : callable
        Begins to label a window.
    numbers : Numbers
    config : ObjectsConfig
    size : (width, height) of the picture, or None where nobody told.
    fps : float or None
    scale : float
        Share of the picture's size in which it was tracked.
    """

    def __init__(
        self,
        label: BeginWindow,
        numbers: Numbers,
        config: ObjectsConfig,
        size: tuple[int, int] | None,
        fps: float | None,
        scale: float = 1.0,
    ) -> None:
        self._label = label
        self._numbers = numbers
        self._config = config
        self._size, self._fps = size, fps
        self._window_size = WindowSize.at(fps, config)
        self._windows = Windows(self._window_size)
        self._fixed = CameraFixed(size, fps, config)
        self._fixed_ids = self._fixed.ids
        """What was known of them when the last window that is linked was asked for: later frames may have
        told more by now, or not, depending on who was faster."""
        self._still: set[int] = set()
        """Objects that are fixed to the camera as a whole, as the linker numbers them."""
        self._borders = FigureGround(scale, fps)
        longest_loss = config.longest_loss_s * (fps or 30.0)
        self._linker = Linker(config.least_shared, config.least_windows, longest_loss)
        self._least_windows = config.least_windows
        self._frames: list[Frame] = []
        self._gone = 0
        """Frames that came out; the first of the others has this number in the shot."""
        self._under_way: deque[_Window] = deque()
        self._linked: deque[LinkedWindow] = deque()
        """Windows that are linked and label no frames yet."""
        self._before: LinkedWindow | None = None
        """The window before these."""
        self._linked_to = 0
        """End of the last window that is linked."""
        self._blocks: deque[int] = deque()
        """Ends of the blocks of frames, each labelled by one window, that wait for the next to be."""

    def add(self, frame: Frame) -> Iterator[Frame]:
        """Take the next frame; yields those whose labels are final now."""
        self._frames.append(frame)
        self._fixed.add(frame.points)
        bounds = self._windows.complete(self._gone + len(self._frames))
        if bounds is not None:
            self._ask(bounds)
        while self._under_way and (self._under_way[0].labels.done() or len(self._under_way) > _UNDER_WAY):
            yield from self._take(self._under_way.popleft())

    @property
    def last(self) -> Frame | None:
        """The frame that came in last."""
        return self._frames[-1] if self._frames else None

    def finish(self) -> Iterator[Frame]:
        """Yield the rest: no more frames will come."""
        frames = self._gone + len(self._frames)
        bounds = self._windows.end(frames)
        if bounds is not None:
            self._ask(bounds)
        self._least_windows = min(self._config.least_windows, self._windows.count)
        while self._under_way:
            yield from self._take(self._under_way.popleft())
        if self._linked:
            self._prepare(frames)
        self._borders.finish()
        while self._blocks:
            yield from self._release()

    def _ask(self, bounds: Bounds) -> None:
        """Have a window labelled; without the tracks that are fixed to the camera."""
        self._fixed.update()
        start, stop = (place - self._gone for place in bounds)
        stride = self._window_size.stride
        rate = self._fps / stride if self._fps else None
        tracks = gather([frame.points for frame in self._frames[start:stop:stride]], self._size, rate)
        fixed = self._fixed.ids
        tracks = tracks.select(~np.isin(tracks.ids, fixed, assume_unique=True))
        self._under_way.append(_Window(bounds, tracks, fixed, self._label(tracks)))

    def _take(self, window: _Window) -> Iterator[Frame]:
        """Link a window; that makes the labels of earlier frames final."""
        stride, self._fixed_ids = self._window_size.stride, window.fixed
        decided = long_enough(window.tracks, self._config)
        said = window.labels.value()
        found = self._linker.link(
            window.tracks, said.labels, decided, said.confidence, start=window.bounds[0], stride=stride
        )
        self._linked.append(LinkedWindow(window.bounds, window.tracks.ids, found, decided))
        self._linked_to = window.bounds[1]
        if len(self._linked) > 1:
            self._prepare((self._linked[0].bounds[1] + self._linked[1].bounds[0]) // 2)
        if len(self._blocks) > 1:
            yield from self._release()

    def _prepare(self, stop: int) -> None:
        """Label the frames up to ``stop`` by the first of the linked windows, and look at their borders."""
        window = self._linked.popleft()
        after = self._linked[0] if self._linked else None
        start = self._blocks[-1] if self._blocks else self._gone
        self._blocks.append(stop)
        block = self._frames[start - self._gone : stop - self._gone]
        movers, before = self._linker.movers(), self._before
        deniers = None
        if before is not None and after is not None and window.is_denied_by(before, after):
            deniers = (before, after)
        for place, frame in enumerate(block, start):
            ids = frame.points.ids
            if deniers is None:
                frame.labels, frame.guessed = window.say_of(ids, before, after)
            else:
                first, second = deniers
                nearest = first if 2 * place < first.bounds[1] + second.bounds[0] else second
                frame.labels, frame.guessed = nearest.say_of(ids)
            frame.guessed |= (frame.labels == BACKGROUND) & np.isin(ids, movers)
        self._before = window if deniers is None else None
        if not self._config.check_borders:
            return
        labels, corrected = self._labels_now(block), self._labels_now(block, corrected=True)
        for frame, plain, better in zip(block, labels, corrected, strict=True):
            if frame.picture is not None:
                # Neither what is called moving nor what only seems to is ground.
                ground = (frame.labels == BACKGROUND) & (better == BACKGROUND)
                self._borders.add(frame.picture, frame.points, plain, ground, frame.guessed)

    def _release(self) -> Iterator[Frame]:
        """The frames of the first block, their labels final."""
        known = self._frames[: self._blocks[-1] - self._gone]
        wanted = self._blocks.popleft() - self._gone
        labels = self._labels_now(known, corrected=self._config.check_borders)
        unit = float(np.hypot(*self._size)) / 800 if self._size else 1.0
        self._still |= still_objects([frame.points for frame in known], labels, unit, self._config)
        for frame_labels in labels:
            frame_labels[np.isin(frame_labels, list(self._still))] = UNDECIDED
        final = self._numbers.settle(labels, [frame.place for frame in known], wanted)
        for frame, own in zip(known, final, strict=False):
            frame.labels = own.astype(np.int64)
        del self._frames[:wanted]
        self._gone += wanted
        # Not what later frames show: how many there are by now depends on who was faster.
        going_on = self._frames[: self._linked_to - self._gone]
        gone = np.setdiff1d(_ids_of(known[:wanted]), _ids_of(going_on), assume_unique=True)
        for part in (self._borders, self._linker):
            part.forget(gone)
        yield from known[:wanted]

    def _labels_now(self, frames: Sequence[Frame], corrected: bool = False) -> list[NDArray[np.int64]]:
        """Labels (N,) of each frame as far as is known by now; objects as the linker numbers them.

        What windows found too seldom or were not sure of is background. ``corrected`` takes what lies on an
        object for that, and what lies beside it for background.
        """
        if not frames:
            return []
        ids = np.concatenate([frame.points.ids for frame in frames])
        labels = np.concatenate([frame.labels for frame in frames])
        moving = labels > BACKGROUND
        tracks, place = np.unique(ids[moving], return_inverse=True)
        linker = self._linker
        numbers = np.array([linker.number_of(track) or BACKGROUND for track in tracks.tolist()], np.int64)
        counts = [self._counts(number) for number in numbers.tolist()]
        numbers[~np.array(counts, bool)] = BACKGROUND
        labels[moving] = numbers[place]
        if corrected:
            guessed = np.concatenate([frame.guessed for frame in frames])
            labels = self._borders.corrected(ids, labels, guessed)
        labels[np.isin(ids, self._fixed_ids)] = UNDECIDED
        return np.split(labels, np.cumsum([len(frame.labels) for frame in frames])[:-1])

    def _counts(self, number: int) -> bool:
        """Whether an object was found by enough windows that were sure enough, or by one that was surer than
        that."""
        together = self._linker.surest(number, self._least_windows)
        alone = self._linker.surest(number)
        return together >= self._config.least_confidence or alone >= self._config.alone_confidence


def _ids_of(frames: Sequence[Frame]) -> NDArray[np.int64]:
    """Tracks (T,) that are seen in some frames, ordered."""
    return np.unique(np.concatenate([np.empty(0, np.int64), *(frame.points.ids for frame in frames)]))
