"""What travels between the stages: small frozen dataclasses that check themselves.

Coordinates are pixels of the upright picture, x right and y down; the centre of the top-left pixel is (0, 0).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from ifsvideo.ordered import places

if TYPE_CHECKING:
    from ifsvideo.objects.history import Event, ObjectTable

BACKGROUND = 0
"""Label of the static world."""
UNDECIDED = -1
"""Label of a point without a decision, or fixed to the camera."""

Image = NDArray[np.uint8]
Floats = NDArray[np.floating[Any]]
Ints = NDArray[np.integer[Any]]
Bools = NDArray[np.bool_]

Progress = Callable[[str, int, "int | None"], None]
"""``progress(stage, done, total)``; ``total`` is None where it is not known."""


@dataclass(frozen=True)
class VideoInfo:
    """What is known of a video before it is decoded.

    Attributes
    ----------
    width, height : int
        Size of the upright picture (rotation applied), pixels.
    fps : Fraction
        Frames per second, exact; the nominal constant rate of a variable one.
    frames : int or None
        Frames that the container promises; None where it says nothing. Never relied on.
    sample_aspect : Fraction
        Width of a pixel over its height, of the upright picture.
    has_audio : bool
        Whether the input carries sound.
    start : float
        Time of the first frame read, seconds of the input (``--start``).
    jump : (int, int), optional
        Where frames are left out (``--preview``): of how many, from the first on, that number is read.
    """

    width: int
    height: int
    fps: Fraction
    frames: int | None = None
    sample_aspect: Fraction = Fraction(1)
    has_audio: bool = False
    start: float = 0.0
    jump: tuple[int, int] | None = None

    def __post_init__(self) -> None:
        if self.width < 1 or self.height < 1:
            raise ValueError(f"a picture has at least one pixel, got {self.width}x{self.height}")
        if self.fps <= 0:
            raise ValueError(f"fps must be positive, got {self.fps}")

    def time_of(self, frame: int) -> float:
        """Time of a frame, seconds of the input."""
        if self.jump is not None:
            read, out_of = self.jump
            frame = frame // read * out_of + frame % read
        return self.start + float(frame / self.fps)


@dataclass(frozen=True)
class FramePoints:
    """The points that are seen in one frame.

    Attributes
    ----------
    ids : (N,) int64
        Track of each point; a track keeps its id while it lives, ids are never used again.
    xy : (N, 2) float32
        Position, pixels.
    """

    ids: NDArray[np.int64]
    xy: NDArray[np.float32]

    def __post_init__(self) -> None:
        if self.xy.shape != (len(self.ids), 2):
            raise ValueError(f"expected xy of shape ({len(self.ids)}, 2), got {self.xy.shape}")

    def positions(self, ids: NDArray[np.int64]) -> NDArray[np.float32]:
        """Where some tracks are, (M, 2); NaN where one is not seen. These points must be ordered by id."""
        found = np.full((len(ids), 2), np.nan, dtype=np.float32)
        place, there = places(ids, self.ids)
        found[there] = self.xy[place[there]]
        return found


@dataclass(frozen=True)
class Tracks:
    """Trajectories of P points over the F frames of one window.

    Attributes
    ----------
    xy : (F, P, 2) float
        Position, pixels; NaN where not visible.
    visible : (F, P) bool
        Whether the point was measured in the frame.
    ids : (P,) int64
        Name of each track.
    size : (width, height) of the picture, pixels, or None where nobody told (the points' extent stands in).
    fps : frames per second, or None where nobody told.
    """

    xy: NDArray[np.float64]
    visible: Bools
    ids: NDArray[np.int64]
    size: tuple[int, int] | None = None
    fps: float | None = None

    def __post_init__(self) -> None:
        if self.xy.ndim != 3 or self.xy.shape[2] != 2:
            raise ValueError(f"expected xy of shape (F, P, 2), got {self.xy.shape}")
        if self.visible.shape != self.xy.shape[:2]:
            raise ValueError(f"expected visible of shape {self.xy.shape[:2]}, got {self.visible.shape}")
        if self.ids.shape != (self.xy.shape[1],):
            raise ValueError(f"expected ids of shape ({self.xy.shape[1]},), got {self.ids.shape}")
        if not np.isfinite(self.xy[self.visible]).all():
            raise ValueError("a visible point has a coordinate that is not finite")

    @classmethod
    def from_array(
        cls,
        xy: Any,
        visible: Any = None,
        ids: Any = None,
        size: tuple[int, int] | None = None,
        fps: float | None = None,
    ) -> Tracks:
        """Tracks from plain arrays: (F, P, 2), NaN or a mask (F, P) where a point is not seen."""
        coordinates = np.array(xy, dtype=np.float64)
        if coordinates.ndim != 3 or coordinates.shape[2] != 2:
            raise ValueError(f"expected xy of shape (F, P, 2), got {coordinates.shape}")
        seen = np.asarray(np.isfinite(coordinates).all(axis=2), dtype=bool)
        if visible is not None:
            mask = np.asarray(visible, dtype=bool)
            if mask.shape != seen.shape:
                raise ValueError(f"expected visible of shape {seen.shape}, got {mask.shape}")
            seen = np.logical_and(seen, mask)
        coordinates[~seen] = np.nan
        names = np.arange(coordinates.shape[1]) if ids is None else np.asarray(ids)
        return cls(coordinates, seen, names.astype(np.int64), size, fps)

    @property
    def frames(self) -> int:
        """Number of frames F."""
        return int(self.xy.shape[0])

    @property
    def points(self) -> int:
        """Number of points P."""
        return int(self.xy.shape[1])

    @cached_property
    def planes(self) -> NDArray[np.float64]:
        """x and y (2, F, P): with the points last, what is done to many of them is one run through
        memory."""
        return np.ascontiguousarray(self.xy.transpose(2, 0, 1))

    @property
    def W(self) -> NDArray[np.float64]:
        """Trajectory matrix (2F, P), rows 2f and 2f+1 hold x and y of frame f (thesis eq. 1.1).

        Raises
        ------
        ValueError
            If a point is not visible in every frame; select such points first.
        """
        if not self.visible.all():
            raise ValueError("W needs every point in every frame; use select(tracks.visible.all(axis=0))")
        return np.ascontiguousarray(self.xy.transpose(0, 2, 1).reshape(2 * self.frames, self.points))

    def select(self, points: Bools | Ints) -> Tracks:
        """The tracks of some of the points: a mask (P,) or indices."""
        return Tracks(self.xy[:, points], self.visible[:, points], self.ids[points], self.size, self.fps)


@dataclass(frozen=True)
class Segmentation:
    """Labels of one window, and what each stage found on the way.

    Attributes
    ----------
    labels : (P,) int64
        0 background, 1, 2, ... moving, -1 undecided or fixed to the camera.
    background : (P,) bool
        Stage 1: what the epipolar split took for background.
    segments : (P,) int64
        Stage 4: the over-segmentation, -1 where a point was not part of it.
    confidence : (P,) float64
        How sure the label is: 0 (a guess) to 1. An object of which no window is sure enough is none
        (`ifsvideo.config.ObjectsConfig.least_confidence`).
    details : mapping
        Whatever else the stages kept for looking into: merge scores, energies, bounds.
    """

    labels: NDArray[np.int64]
    background: Bools
    segments: NDArray[np.int64]
    confidence: NDArray[np.float64]
    details: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("background", "segments", "confidence"):
            shape = getattr(self, name).shape
            if shape != self.labels.shape:
                raise ValueError(f"expected {name} of shape {self.labels.shape}, got {shape}")


@dataclass(frozen=True)
class LabelTable:
    """One row for every track and frame in which it is seen, ordered by frame, then track.

    Attributes
    ----------
    frame : (N,) int32, from 0.
    ids : (N,) int64, the track.
    xy : (N, 2) float32, pixels.
    labels : (N,) int32, as in `Segmentation`.
    frames : int
        Number of frames decoded, also those without a point.
    """

    frame: NDArray[np.int32]
    ids: NDArray[np.int64]
    xy: NDArray[np.float32]
    labels: NDArray[np.int32]
    frames: int

    def __post_init__(self) -> None:
        rows = len(self.frame)
        for name, shape in (("ids", (rows,)), ("xy", (rows, 2)), ("labels", (rows,))):
            if getattr(self, name).shape != shape:
                raise ValueError(f"expected {name} of shape {shape}, got {getattr(self, name).shape}")
        if rows and (np.diff(self.frame) < 0).any():
            raise ValueError("rows must be ordered by frame")

    def at(self, frame: int) -> slice:
        """The rows of one frame."""
        start, stop = np.searchsorted(self.frame, [frame, frame + 1])
        return slice(int(start), int(stop))


@dataclass(frozen=True)
class Scene:
    """What a renderer is told of one frame.

    Attributes
    ----------
    frame : int, from 0.
    time_s : float, seconds of the input.
    ids : (N,) int64, xy : (N, 2) float32, labels : (N,) int32
        The points seen in this frame.
    trails : (T, N, 2) float32
        Where these points were in the T frames up to this one, oldest first; NaN where they were not seen.
        Read only.
    """

    frame: int
    time_s: float
    ids: NDArray[np.int64]
    xy: NDArray[np.float32]
    labels: NDArray[np.int32]
    trails: NDArray[np.float32]


@dataclass(frozen=True)
class MovingObject:
    """One object of a clip: its number, first and last sight (seconds of the input), number of tracks."""

    label: int
    first_s: float
    last_s: float
    tracks: int


@dataclass(frozen=True)
class Counts:
    """How many frames and tracks a clip had, and how many rows of each kind its labels."""

    frames: int
    tracks: int
    background: int
    moving: int
    undecided: int

    @property
    def rows(self) -> int:
        """Rows in all."""
        return self.background + self.moving + self.undecided


@dataclass(frozen=True)
class Result:
    """What a run found and wrote.

    Attributes
    ----------
    info : VideoInfo
    counts : Counts
    objects : tuple of MovingObject, by number
    output, labels : Path or None
        What was written.
    warnings : tuple of str
        What a user should know: frames missing, a side padded, no corner found.
    seconds : mapping of stage name to seconds spent; stages run side by side.
    kept : LabelTable or None
        Every row, unless the run was told not to keep them; `table` is the same without None.
    events : tuple of Event, by time
    history : ObjectTable or None
        A row for every object and frame. This and the events are there where further outputs were asked for.
    further : tuple of Path
        These outputs.
    """

    info: VideoInfo
    counts: Counts
    objects: tuple[MovingObject, ...]
    output: Path | None
    labels: Path | None
    warnings: tuple[str, ...]
    seconds: Mapping[str, float]
    events: tuple[Event, ...] = ()
    history: ObjectTable | None = None
    further: tuple[Path, ...] = ()
    kept: LabelTable | None = None

    @property
    def table(self) -> LabelTable:
        """Every row of the labels.

        Raises
        ------
        ValueError
            If the run was told not to keep them (``keep_table=False``).
        """
        if self.kept is None:
            raise ValueError("the run kept no table; leave out keep_table=False, or read the CSV")
        return self.kept


class Tracker(Protocol):
    """Turns frames into points that keep their id."""

    def track(self, frames: Iterable[Image], ignore: Bools | None = None) -> Iterator[FramePoints]:
        """Yield the points of every frame: exactly one item per frame, in order.

        Parameters
        ----------
        frames : iterable of (H, W, 3) uint8, RGB
        ignore : (H, W) bool, optional
            True where the picture is not looked at.
        """
        ...


@runtime_checkable
class GreyTracker(Protocol):
    """A `Tracker` that can do without colours; it is then spared making them."""

    def track_grey(self, frames: Iterable[Image], ignore: Bools | None = None) -> Iterator[FramePoints]:
        """As `Tracker.track`, of frames (H, W) uint8."""
        ...


class Segmenter(Protocol):
    """Turns the tracks of one window into labels."""

    def segment(self, tracks: Tracks, motions: int | None = None) -> Segmentation:
        """Segment all frames as one window; ``motions`` tells the number of motions where it is known."""
        ...


class Sink(Protocol):
    """Consumes what was found, frame by frame; overlay, CSV and every other output is one.

    Its files belong to a group of outputs (`ifsvideo.output.atomic.Outputs`) that it is given when it is
    made: they appear with all others of the run, or not at all. What it keeps must not grow with points x
    frames.

    Attributes
    ----------
    wants_image : bool
        Whether `add` needs the picture; pictures that no sink wants are not made.
    """

    @property
    def wants_image(self) -> bool: ...

    def add(self, scene: Scene, image: Image | None) -> None:
        """Take the next frame: every one once, in order, its labels and object numbers final.

        Parameters
        ----------
        scene : Scene
        image : (H, W, 3) uint8 RGB, not to be changed; None where the input is tracks, or no sink wants it.
        """
        ...

    def finish(self) -> None:
        """Complete the output, after the last frame; not called after a failure."""
        ...


class Renderer(Protocol):
    """Draws what was found."""

    def draw(self, image: Image, scene: Scene) -> Image:
        """Return the picture (H, W, 3) uint8 RGB to be written; ``image`` must not be changed.

        Where a transparent overlay is asked for (`ifsvideo.OverlayConfig.transparent`): (H, W, 4) RGBA.
        """
        ...
