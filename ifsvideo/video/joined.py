"""Files that one recording was cut into, read as one video."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path

from ifsvideo.errors import InputError, UsageError
from ifsvideo.types import Image
from ifsvideo.video.picture import Picture
from ifsvideo.video.sound import JoinedSound, SoundSource, Stretch
from ifsvideo.video.source import FrameSource


class Joined(FrameSource):
    """Chapters of one recording, in order, each with its sound; their frames follow each other without a gap.

    Parameters
    ----------
    chapters : sequence of FrameSource
        All of one size and rate.

    Raises
    ------
    InputError
        If a size or a rate differs.
    """

    def __init__(self, chapters: Sequence[FrameSource]) -> None:
        first = chapters[0]
        for chapter in chapters[1:]:
            for told in (_size, _rate):
                if told(chapter) != told(first):
                    raise InputError(
                        f"{chapter.path}: has {told(chapter)}, but {first.path.name} has {told(first)}; join "
                        "the files of one recording only"
                    )
        self.path = first.path
        self._chapters = chapters
        self._reading = first
        lengths = [chapter.info.frames for chapter in chapters]
        frames = None if None in lengths else sum(length or 0 for length in lengths)
        sounds = frames is not None and any(chapter.info.has_audio for chapter in chapters)
        self.info = replace(first.info, frames=frames, has_audio=sounds)

    @property
    def sound(self) -> SoundSource | None:
        """See `FrameSource.sound`."""
        if not self.info.has_audio:
            return None
        return JoinedSound(
            tuple(
                Stretch(
                    chapter.path if chapter.info.has_audio else None,
                    chapter.info.start,
                    float((chapter.info.frames or 0) / chapter.info.fps),
                )
                for chapter in self._chapters
            )
        )

    def frames(self) -> Generator[Image, None, None]:
        """See `FrameSource.frames`."""
        with closing(self.pictures()) as pictures:
            for picture in pictures:
                yield picture.rgb

    def pictures(self) -> Generator[Picture, None, None]:
        """See `FrameSource.pictures`."""
        self.warnings = ()
        for chapter in self._chapters:
            self._reading = chapter
            with closing(chapter.pictures()) as pictures:
                yield from pictures
            self.warnings = (*self.warnings, *chapter.warnings)

    def stop(self) -> None:
        """See `FrameSource.stop`."""
        self._reading.stop()


def open_joined(
    paths: Sequence[Path],
    open_one: Callable[[Path, float, float | None], FrameSource],
    start: float = 0.0,
    end: float | None = None,
) -> Joined:
    """Open as many of the chapters of a recording as a stretch of it needs.

    Parameters
    ----------
    paths : sequence of Path
    open_one : callable
        ``open_one(path, start, end)`` opens one of them.
    start, end : float
        Seconds of the whole recording.

    Raises
    ------
    InputError
        As of each, or if they do not fit together.
    UsageError
        If the stretch makes no sense.
    """
    whole = [open_one(path, 0.0, None) for path in paths]
    joined = Joined(whole)
    if start == 0.0 and end is None:
        return joined
    chapters: list[FrameSource] = []
    begin = first = 0.0
    for path, source in zip(paths, whole, strict=True):
        length = float((source.info.frames or 0) / joined.info.fps)
        if begin + length > start and (end is None or begin < end):
            left = None if end is None or end >= begin + length else end - begin
            chapters.append(open_one(path, max(0.0, start - begin), left))
            first = begin if len(chapters) == 1 else first
        begin += length
    if not chapters:
        raise UsageError(f"{paths[0]}: no frame from {start:g} s on; the recording is {begin:.2f} s long")
    joined = Joined(chapters)
    joined.info = replace(joined.info, start=first + joined.info.start)
    return joined


def _size(source: FrameSource) -> str:
    return f"{source.info.width}x{source.info.height} pixels"


def _rate(source: FrameSource) -> str:
    return f"{float(source.info.fps):g} frames per second"
