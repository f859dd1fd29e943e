"""Video from standard input: it can be read once, and nothing is known of it before."""

from __future__ import annotations

import re
import sys
from collections.abc import Generator
from contextlib import closing
from fractions import Fraction
from pathlib import Path

import numpy as np

from ifsvideo.errors import IfsVideoError, InputError, UsageError
from ifsvideo.types import Image, VideoInfo
from ifsvideo.video import ffmpeg
from ifsvideo.video.picture import Picture
from ifsvideo.video.probe import VIDEO_STREAM
from ifsvideo.video.source import FrameSource, choose_stretch

STDIN = Path("-")
_HEADER = re.compile(rb"YUV4MPEG2 W(\d+) H(\d+) F(\d+):(\d+)(?: I\S)?(?: A(\d+):(\d+))?")
_LONGEST_HEADER = 256
# Even sides, as the planes ask for; the rate is made constant on the way.
_FILTERS = "pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt601:out_range=tv,format=yuv420p"


class StandardInput(FrameSource):
    """A container that ffmpeg can stream, from standard input; an odd side is padded by one black pixel.

    Parameters
    ----------
    fps : Fraction, optional
        Take the frames one by one as if they had this rate.
    start, end : float
        Stretch that is read, seconds.

    Raises
    ------
    InputError
        If it cannot be read.
    UsageError
        If the stretch makes no sense.
    """

    def __init__(self, *, fps: Fraction | None = None, start: float = 0.0, end: float | None = None) -> None:
        self.path = STDIN
        timing = ["-fps_mode", "passthrough" if fps else "cfr"]
        source = ["-loglevel", "error", "-threads", "2", "-i", "pipe:0", "-map", VIDEO_STREAM]
        form = ["-vf", _FILTERS, *timing, "-strict", "-1", "-f", "yuv4mpegpipe", "-"]
        self._child = ffmpeg.Ffmpeg([*source, *form], stdin=sys.stdin.buffer)
        header = _HEADER.match(self._child.stdout.readline(_LONGEST_HEADER))
        if header is None:
            self._child.wait()
            reason = (self._child.printed() or ["no data"])[-1]
            self._child.stop()
            raise InputError(
                f"standard input: no video that can be streamed (ffmpeg: {reason}); save it first"
            )
        width, height, rate, per, aspect, over = (int(number or 0) for number in header.groups())
        fps = fps or Fraction(rate, per)
        self._stretch = choose_stretch(Path("standard input"), fps, 0.0, None, start, end)
        square = Fraction(aspect, over) if aspect and over else Fraction(1)
        begin = float(self._stretch.first / fps)
        self.info = VideoInfo(width, height, fps, self._stretch.frames, square, start=begin)

    def frames(self) -> Generator[Image, None, None]:
        """See `FrameSource.frames`; once only."""
        with closing(self.pictures()) as pictures:
            for picture in pictures:
                yield picture.rgb

    def pictures(self) -> Generator[Picture, None, None]:
        """See `FrameSource.pictures`; once only."""
        first, stop = self._stretch.first, self._stretch.stop
        place = 0
        with self._child as child:
            while stop is None or place < stop:
                planes = np.empty((self.info.height * 3 // 2, self.info.width), np.uint8)
                if not child.stdout.readline().startswith(b"FRAME"):
                    break
                if child.stdout.readinto(planes.data.cast("B")) != planes.nbytes:
                    break
                place += 1
                if place > first:
                    yield Picture(planes)
            if stop is None or place < stop:
                self._check_end(child, place)

    def stop(self) -> None:
        """See `FrameSource.stop`."""
        self._child.kill()

    def _check_end(self, child: ffmpeg.Ffmpeg, place: int) -> None:
        status = child.wait()
        if status < 0:
            raise IfsVideoError(f"standard input: ffmpeg was killed while reading (signal {-status})")
        if place <= self._stretch.first:
            raise UsageError("standard input: start is past the end, or no frame can be decoded")
        printed = child.printed()
        if printed:
            self.warnings = (f"standard input: is damaged in places (ffmpeg: {printed[0]})",)
