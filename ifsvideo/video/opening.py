"""The one door to everything that can be read as a video."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

from ifsvideo.errors import UsageError
from ifsvideo.video.file import VideoFile
from ifsvideo.video.images import ImageFolder
from ifsvideo.video.source import FrameSource
from ifsvideo.video.stream import STDIN, StandardInput


def open_source(
    path: str | Path, *, fps: Fraction | None = None, start: float = 0.0, end: float | None = None
) -> FrameSource:
    """Open a video file or a folder of images for reading.

    Parameters
    ----------
    path : str or Path
        Any file that ffmpeg decodes, a folder of images in natural order, or ``-``: standard input.
    fps : Fraction, optional
        Frames per second: of a folder (10 unless told), or in place of a file's own rate.
    start, end : float, optional
        Stretch to be read, seconds of the input; an end past the end is cut to it. A frame counts from half a
        frame before its time.

    Returns
    -------
    FrameSource
        `VideoFile`, `ImageFolder` or `StandardInput`.

    Raises
    ------
    InputError
        If the input is missing, unreadable or holds no picture.
    UsageError
        If ``fps`` is not positive or the stretch makes no sense.
    """
    path = Path(path)
    if fps is not None and fps <= 0:
        raise UsageError(f"{path}: {fps} frames per second cannot be; give a positive number")
    if path == STDIN:
        return StandardInput(fps=fps, start=start, end=end)
    kind = ImageFolder if path.is_dir() else VideoFile
    return kind(path, fps=fps, start=start, end=end)
