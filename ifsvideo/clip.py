"""What a pipeline runs on: pictures, or tracks that were made elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from ifsvideo.errors import UsageError
from ifsvideo.output.atomic import check_writable
from ifsvideo.output.products import Products, same_place
from ifsvideo.tracking.files import load_trajectories
from ifsvideo.tracking.trajectories import Trajectories
from ifsvideo.types import Tracks, VideoInfo
from ifsvideo.video import FrameSource, check_output, open_source
from ifsvideo.video.joined import Joined, open_joined
from ifsvideo.video.preview import Preview
from ifsvideo.video.stream import STDIN

TRACK_ENDINGS = (".npz", ".mat")
DEFAULT_FPS = Fraction(10)

Source = str | Path | Sequence[str | Path] | FrameSource | Tracks | NDArray[Any]
"""Path of a video, folder of images or tracks, ``-`` for standard input; paths of the chapters of one
recording; an open source of frames; tracks (F, P, 2), NaN: not seen."""


@dataclass(frozen=True)
class Clip:
    """Pictures (``frames``) or tracks (``trajectories``): exactly one of them is there.

    Attributes
    ----------
    name : str, for messages.
    info : VideoInfo
    path : Path or None, where it was read from.
    """

    name: str
    info: VideoInfo
    path: Path | None
    frames: FrameSource | None = None
    trajectories: Trajectories | None = None


def as_tracks(source: Tracks | NDArray[Any]) -> Tracks:
    """Tracks as they are, or from an (F, P, 2) array: NaN, or masked, where a point is not seen."""
    if isinstance(source, Tracks):
        return source
    return Tracks.from_array(np.ma.filled(np.ma.asarray(source, dtype=np.float64), np.nan))


def is_tracks_file(path: Path) -> bool:
    """Whether a path is taken for tracks, by its ending."""
    return path.suffix.lower() in TRACK_ENDINGS and not path.is_dir()


def open_clip(
    source: Source, fps: Fraction | None, start: float, end: float | None, preview: int | None = None
) -> Clip:
    """Open what was given.

    Parameters
    ----------
    source : path, sequence of paths, FrameSource, Tracks or (F, P, 2) array
    fps : Fraction or None
        Frames per second; None: the source's own, 10 where it has none.
    start, end : float
        Stretch of pictures that is read, seconds; tracks are taken whole.
    preview : int or None
        Read every so manyth second only.

    Raises
    ------
    InputError
        If it cannot be read.
    UsageError
        If the stretch makes no sense, or is asked for of something that is taken whole.
    """
    path = Path(source) if isinstance(source, str | Path) else None
    if path is not None and not is_tracks_file(path):
        return _of_frames(open_source(path, fps=fps, start=start, end=end), path, preview)
    if isinstance(source, list | tuple):
        return _of_frames(_joined([Path(each) for each in source], fps, start, end), None, preview)
    name = str(path or type(source).__name__)
    if start != 0.0 or end is not None or (preview is not None and not isinstance(source, FrameSource)):
        raise UsageError(f"{name}: is taken whole; leave out start, end and preview")
    if isinstance(source, FrameSource):
        if fps is not None:
            raise UsageError(f"{name}: is open already and has its rate; leave out fps")
        return _of_frames(source, source.path, preview)
    if isinstance(source, str | Path):
        points = load_trajectories(source)
    else:
        points = Trajectories.from_tracks(as_tracks(cast("Tracks | NDArray[Any]", source)))
    info = _info_of(points, fps)
    return Clip(name, info, path, trajectories=replace(points, fps=float(info.fps)))


def _of_frames(frames: FrameSource, path: Path | None, preview: int | None) -> Clip:
    source = frames if preview is None else Preview(frames, preview)
    return Clip(str(frames.path), source.info, None if path == STDIN else path, frames=source)


def _joined(paths: Sequence[Path], fps: Fraction | None, start: float, end: float | None) -> Joined:
    """The chapters of a recording.

    Raises
    ------
    UsageError
        If there are none, or one cannot be a chapter.
    """
    for path in paths:
        if is_tracks_file(path) or path == STDIN:
            raise UsageError(f"{path}: cannot be joined; name video files or folders of images")
    if not paths:
        raise UsageError("no file to join; name at least one")

    def open_one(path: Path, first: float, last: float | None) -> FrameSource:
        return open_source(path, fps=fps, start=first, end=last)

    return open_joined(paths, open_one, start, end)


def check_outputs(clip: Clip, video: Path | None, labels: Path | None, products: Products) -> None:
    """Refuse outputs before any work is done.

    Raises
    ------
    UsageError
        If an output is the input or another output, has an unknown ending, or needs what the input lacks.
    OutputError
        If it cannot be written.
    """
    if video is not None:
        if clip.frames is None:
            raise UsageError(f"{clip.name}: tracks hold no pictures; write their labels only (--labels FILE)")
        check_output(video, clip.path)
    if labels is not None:
        for other, what in ((clip.path, "the input itself"), (video, "the video too")):
            if other is not None and same_place(labels, other):
                raise UsageError(f"{labels}: is {what}; name another file for the labels")
        check_writable(labels)
    if products.clips is not None and not (clip.frames and clip.path and clip.path.is_file()):
        raise UsageError(f"{clip.name}: is no video file to cut clips out of; leave out the clips")
    taken = {"the input itself": clip.path, "the video too": video, "the labels too": labels}
    products.check({what: path for what, path in taken.items() if path is not None})


def _info_of(points: Trajectories, fps: Fraction | None) -> VideoInfo:
    """Size and rate of tracks; where nobody told the size, the extent of the points."""
    rate = fps or (Fraction(points.fps).limit_denominator(100_000) if points.fps else DEFAULT_FPS)
    width, height = points.size or _extent(points.xy)
    return VideoInfo(width, height, rate, points.frames)


def _extent(xy: NDArray[np.float32]) -> Sequence[int]:
    if len(xy) == 0:
        return 1, 1
    return [max(1, int(side)) for side in np.ceil(xy.max(axis=0) + 1).tolist()]
