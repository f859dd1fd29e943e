"""Video files, decoded by ffmpeg."""

from __future__ import annotations

import re
from collections.abc import Generator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np

from ifsvideo.errors import IfsVideoError, InputError, UsageError
from ifsvideo.types import Image, VideoInfo
from ifsvideo.video import ffmpeg
from ifsvideo.video.probe import Probe, probe
from ifsvideo.video.source import FrameSource, choose_stretch

_THREADS = "2"
_DAMAGE = re.compile(r"error|invalid|corrupt|conceal|missing|truncat", re.IGNORECASE)


class VideoFile(FrameSource):
    """Any file that ffmpeg decodes; its first video stream, upright, at a constant rate.

    A file of constant rate yields the frames that are decoded, none repeated and none left out. A variable rate is
    brought to the nominal constant one (ffmpeg's r_frame_rate) from time 0 on: each frame shown for its own time.

    Parameters
    ----------
    path : Path
    fps : Fraction, optional
        Take the decoded frames one by one as if they had this rate, whatever their own times; then the sound is out of
        step and is not offered (``info.has_audio`` is False).
    start, end : float
        Stretch that is read, seconds; see `choose_stretch`.

    Raises
    ------
    InputError
        If the file cannot be read; before any frame is asked for.
    UsageError
        If the stretch makes no sense.
    """

    def __init__(
        self, path: Path, *, fps: Fraction | None = None, start: float = 0.0, end: float | None = None
    ) -> None:
        self.path = path
        found = probe(path)
        self._timing = _timing(found, fps)
        rate, zero = self._timing.fps, self._timing.zero
        self._stretch = choose_stretch(path, rate, zero, self._timing.frames, start, end)
        self.info = VideoInfo(
            width=found.width,
            height=found.height,
            fps=rate,
            frames=self._stretch.frames,
            sample_aspect=found.sample_aspect,
            has_audio=found.audio_codec is not None and fps is None,
            start=zero + float(self._stretch.first / rate),
        )

    def frames(self) -> Generator[Image, None, None]:
        """See `FrameSource.frames`."""
        first, stop = self._stretch.first, self._stretch.stop
        decoded = 0
        with ffmpeg.Ffmpeg(self._arguments()) as child:
            while stop is None or decoded < stop:
                image = self._read(child)
                if image is None:
                    break
                decoded += 1
                if decoded > first:
                    yield image
            else:
                child.stop()  # the rest of the file is not wanted
            self.warnings = self._judge(child, decoded)

    def _arguments(self) -> list[str]:
        size = (
            f"scale={self.info.width}:{self.info.height},format=rgb24"  # also if the size changes on the way
        )
        vary = "" if self._timing.constant else f"fps={self.info.fps}:start_time=0,"
        return [
            *("-threads", _THREADS, "-reinit_filter", "0", "-i", ffmpeg.file_url(self.path)),
            *("-map", "0:V:0", "-vf", vary + size, "-fps_mode", "passthrough"),
            *("-f", "rawvideo", "-"),
        ]

    def _read(self, child: ffmpeg.Ffmpeg) -> Image | None:
        image = np.empty((self.info.height, self.info.width, 3), dtype=np.uint8)
        got = child.stdout.readinto(memoryview(image).cast("B"))  # type: ignore[attr-defined]
        return image if got == image.nbytes else None

    def _judge(self, child: ffmpeg.Ffmpeg, decoded: int) -> tuple[str, ...]:
        """Warnings after a full pass; raises where nothing was read."""
        first, stop = self._stretch.first, self._stretch.stop
        status = child.wait()
        if stop is not None and decoded >= stop:
            return ()
        complaints = child.complaints()
        if status < 0:
            raise IfsVideoError(
                f"{self.path}: ffmpeg was killed by signal {-status} while reading; run it again"
            )
        if decoded <= first:
            if decoded:
                length = self._timing.zero + float(decoded / self.info.fps)
                raise UsageError(f"{self.path}: start is past the end; only {length:.2f} s can be decoded")
            last = complaints[-1] if complaints else "no reason given"
            raise InputError(f"{self.path}: not one frame can be decoded; copy it again (ffmpeg: {last})")
        reason = next((line for line in complaints if _DAMAGE.search(line)), "")
        if stop is not None:
            return (
                f"{self.path}: {decoded - first} of {stop - first} frames could be decoded, the file is damaged"
                + (f" (ffmpeg: {reason})" if reason else ""),
            )
        return ()


@dataclass(frozen=True)
class _Timing:
    """How frames get their times: rate, time of the first, number, and whether they are taken one by one."""

    fps: Fraction
    zero: float
    frames: int | None
    constant: bool


def _timing(found: Probe, fps: Fraction | None) -> _Timing:
    if fps is not None:
        return _Timing(fps, 0.0, found.packets or None, True)
    return _Timing(found.fps, found.first, found.frames if found.packets else None, found.constant)
