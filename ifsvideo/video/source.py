"""What every source of frames offers, and the stretch of time that is read of it."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Generator
from contextlib import closing
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from ifsvideo.errors import UsageError
from ifsvideo.types import Image, VideoInfo
from ifsvideo.video.picture import Picture
from ifsvideo.video.sound import SoundSource


class FrameSource(ABC):
    """A video that can be read from its first frame to its last, as often as wanted.

    Attributes
    ----------
    path : Path
        File or folder.
    info : VideoInfo
        Of the stretch that is read.
    warnings : tuple of str
        What the last full pass met: frames missing, data damaged.
    shot_frames : int or None
        Where the frames do not follow each other: after so many of them another shot begins.
    """

    path: Path
    info: VideoInfo
    warnings: tuple[str, ...] = ()
    shot_frames: int | None = None

    @abstractmethod
    def frames(self) -> Generator[Image, None, None]:
        """Open the source anew and yield its frames, each a new (H, W, 3) uint8 RGB array, C-contiguous.

        Close the generator (``contextlib.closing``) to stop early. Every pass yields as many frames.

        Raises
        ------
        InputError
            If no frame can be read, or a picture of a folder cannot.
        """

    def pictures(self) -> Generator[Picture, None, None]:
        """The same frames in the form in which they need least memory."""
        with closing(self.frames()) as frames:
            for image in frames:
                yield Picture(image)

    @property
    def sound(self) -> SoundSource | None:
        """What is heard with the pictures."""
        return self.path if self.info.has_audio else None

    def stop(self) -> None:
        """Make a pass that waits for data in another thread end soon, by whatever error; by default it is
        taken not to wait long."""
        return


@dataclass(frozen=True)
class Stretch:
    """Frames ``first`` to ``stop`` (exclusive; None: to the end), counted from the source's first frame."""

    first: int
    stop: int | None

    @property
    def frames(self) -> int | None:
        """Number of frames, None where the end is not known."""
        return None if self.stop is None else self.stop - self.first


def choose_stretch(
    path: Path, fps: Fraction, zero: float, frames: int | None, start: float, end: float | None
) -> Stretch:
    """The frames shown from ``start`` to ``end``.

    A frame belongs to the stretch if its time, ``zero + k / fps``, is at least ``start`` and less than
    ``end``, each less half a frame: so a time that was rounded, up or down, still names the frame that was
    meant.

    Parameters
    ----------
    path : Path
        For messages.
    fps : Fraction
    zero : float
        Time of the source's first frame, seconds.
    frames : int or None
        Number of frames, None where not known.
    start, end : float
        Seconds; an end past the end is cut to it.

    Raises
    ------
    UsageError
        If a time is negative or not a number, if the end is not after the start, or the start past the end.
    """
    for name, seconds in (("start", start), ("end", end)):
        if seconds is not None and not 0 <= seconds < math.inf:
            raise UsageError(f"{path}: {name} {seconds} is not a time in the video; give seconds from 0")
    if end is not None and end <= start:
        raise UsageError(f"{path}: end {end:g} s is not after start {start:g} s; give a later end")
    first = max(0, _place(start, zero, fps))
    stop = frames if end is None else _place(end, zero, fps)
    if frames is not None and stop is not None:
        stop = min(stop, frames)
        if first >= frames:
            length = zero + float(frames / fps)
            raise UsageError(f"{path}: start {start:g} s is past the end; the video is {length:.2f} s long")
    if stop is not None and stop <= first:
        raise UsageError(f"{path}: no frame from {start:g} s to {end or 0:g} s; give a longer stretch")
    return Stretch(first, stop)


def _place(seconds: float, zero: float, fps: Fraction) -> int:
    """Number of the first frame whose time is at least ``seconds`` less half a frame."""
    return math.ceil((Fraction(seconds) - Fraction(zero)) * fps - Fraction(1, 2))
