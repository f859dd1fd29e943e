"""A second now and then of a long video, for a quick look."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import closing
from dataclasses import replace

from ifsvideo.errors import UsageError
from ifsvideo.types import Image
from ifsvideo.video.picture import Picture
from ifsvideo.video.source import FrameSource


class Preview(FrameSource):
    """Every n-th second of a source, one after the other, without sound.

    Parameters
    ----------
    source : FrameSource
    every : int
        1 is the whole of it.

    Raises
    ------
    UsageError
        If ``every`` is less than 1.
    """

    def __init__(self, source: FrameSource, every: int) -> None:
        if every < 1:
            raise UsageError(f"{source.path}: preview must be at least 1, got {every}")
        self.path = source.path
        self._source = source
        info = source.info
        self._shown = self.shot_frames = max(1, round(info.fps))
        self._round = every * self._shown
        frames = info.frames
        if frames is not None:
            frames = frames // self._round * self._shown + min(frames % self._round, self._shown)
        jump = (self._shown, self._round)
        self.info = replace(info, frames=frames, has_audio=False, jump=jump)

    def frames(self) -> Generator[Image, None, None]:
        """See `FrameSource.frames`."""
        with closing(self.pictures()) as pictures:
            for picture in pictures:
                yield picture.rgb

    def pictures(self) -> Generator[Picture, None, None]:
        """See `FrameSource.pictures`."""
        with closing(self._source.pictures()) as pictures:
            for place, picture in enumerate(pictures):
                if place % self._round < self._shown:
                    yield picture
        self.warnings = self._source.warnings

    def stop(self) -> None:
        """See `FrameSource.stop`."""
        self._source.stop()
