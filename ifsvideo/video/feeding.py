"""What writers of videos and of animations share: frames go to an ffmpeg, its file to its place."""

from __future__ import annotations

from abc import ABC, abstractmethod
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from ifsvideo.errors import OutputError
from ifsvideo.output.atomic import Outputs
from ifsvideo.types import Image, VideoInfo
from ifsvideo.video import ffmpeg


class FedWriter(ABC):
    """Feeds frames to an ffmpeg; the file appears when the context ends well, otherwise nothing is left.

    Parameters
    ----------
    path : Path
    info : VideoInfo
        Size and rate of the frames.
    outputs : Outputs, optional
        Group with which the file is placed; alone by default.
    transparent : bool
        Whether the frames are RGBA, in place of RGB.

    Attributes
    ----------
    warnings : tuple of str
        What a user should know; complete after `finish`.
    frames : int
        Frames written so far.
    """

    def __init__(self, path: Path, info: VideoInfo, outputs: Outputs | None, transparent: bool) -> None:
        self.path = path
        self.frames = 0
        self.warnings: tuple[str, ...] = ()
        self._info = info
        self._group = outputs
        self._transparent = transparent

    @abstractmethod
    def _arguments(self) -> list[str]:
        """Arguments of the ffmpeg that is fed."""

    @abstractmethod
    def _complete(self) -> None:
        """Make the target complete, once that ffmpeg has ended well."""

    def _as_fed(self, image: Image) -> Image:
        """The picture as ffmpeg is given it."""
        return np.ascontiguousarray(image)

    def __enter__(self) -> Self:
        self._own = Outputs()
        self._finished = False
        try:
            self._target = (self._group or self._own).add(self.path)
            self._child = ffmpeg.Ffmpeg(self._arguments(), feeds=True)
        except BaseException:
            self._own.discard()
            raise
        return self

    def write(self, image: Image) -> None:
        """Append one frame.

        Parameters
        ----------
        image : (H, W, 3) uint8
            RGB, of the size promised by ``info``; (H, W, 4) RGBA where it is transparent.

        Raises
        ------
        ValueError
            If shape or type differ.
        OutputError
            If ffmpeg has died, for instance because the disk is full.
        """
        expected = (self._info.height, self._info.width, 4 if self._transparent else 3)
        if image.shape != expected or image.dtype != np.uint8:
            raise ValueError(f"expected uint8 image of shape {expected}, got {image.dtype} {image.shape}")
        pixels = self._as_fed(image)
        try:
            self._child.stdin.write(pixels.data.cast("B"))
        except OSError:
            self._child.wait()
            raise self._failure(self._child.printed()) from None
        self.frames += 1

    def finish(self) -> None:
        """Let ffmpeg end and make the file complete; leaving the context well does it too.

        Raises
        ------
        OutputError
            If ffmpeg fails, the disk is full or no frame was written.
        """
        if self._finished:
            return
        with suppress(OSError):  # where ffmpeg has died, its exit status says more
            self._child.stdin.close()
        status = self._child.wait()
        if self.frames == 0:
            raise OutputError(f"{self.path}: no frame was written; nothing is left to place there")
        if status != 0:
            raise self._failure(self._child.printed())
        self._complete()
        self._finished = True

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if kind is None:
                self.finish()
        except BaseException as failure:
            kind, error, trace = type(failure), failure, failure.__traceback__
            raise
        finally:
            self._child.stop()
            self._own.__exit__(kind, error, trace)

    def _input(self, width: int, height: int, pixels: str) -> list[str]:
        """Arguments that tell ffmpeg what it is fed; ``pixels`` is its name of their format."""
        return [
            *("-loglevel", "error", "-f", "rawvideo", "-pix_fmt", pixels),
            *("-video_size", f"{width}x{height}", "-framerate", str(self._info.fps), "-i", "pipe:0"),
        ]

    def _warn(self, text: str) -> None:
        self.warnings = (*self.warnings, f"{self.path}: {text}")

    def _failure(self, complaints: list[str]) -> OutputError:
        text = "\n".join(complaints)
        if "No space left on device" in text:
            return OutputError(f"{self.path}: the disk is full; free space or name another place")
        reason = complaints[-1] if complaints else "it was killed"
        return OutputError(
            f"{self.path}: ffmpeg could not write the video ({reason}); check the disk and memory"
        )
