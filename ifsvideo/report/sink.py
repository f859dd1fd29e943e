"""Gathers what the page shows and writes it when all is known."""

from __future__ import annotations

import os
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from ifsvideo.objects.history import ObjectHistory
from ifsvideo.output.atomic import Outputs, output_error
from ifsvideo.report.data import page_data
from ifsvideo.report.page import beside, embedded, fill
from ifsvideo.report.pairs import Pairs
from ifsvideo.report.shapes import DIRECTIONS, outline
from ifsvideo.types import BACKGROUND, Image, Scene, VideoInfo
from ifsvideo.video import VideoWriter
from ifsvideo.video.sound import SoundSource

EMBEDDED = 8_000_000
"""Largest video that is put into the page itself, bytes; a larger one stands beside it."""
_SHAPES_PER_S = 15
"""Outlines a second; between them the page interpolates."""
_PAIRS_PER_S = 5
"""Shear and stretch are measured so often: over a fifth of a second they rise above the tracker's noise."""
_WIDEST = 854
"""Longest side of the page's video, pixels: what a page shows beside a table."""


def video_beside(page: Path) -> Path:
    """Where the video of a page stands that is too large to be put into it."""
    return page.with_name(f"{page.stem}.video.mp4")


class ReportSink:
    """Writes the page (a `Sink`): `PATH.html`, and `PATH.video.mp4` beside it where the video is large.

    Parameters
    ----------
    path : Path
        .html.
    name : str
        Of the input, for people.
    info : VideoInfo
        Of the input.
    history : ObjectHistory
        With thumbnails; it is fed and finished before this sink.
    outputs : Outputs
        Group with which the page is placed.
    sound : path or JoinedSound, optional
        Whose sound the page's video has.

    Attributes
    ----------
    warnings : tuple of str
        What a user should know; known after `finish`.
    beside : Path or None
        The video, where it stands beside the page; known after `finish`.

    Raises
    ------
    OutputError
        Here and later, if the page or its video cannot be written.
    """

    wants_image = True

    def __init__(
        self,
        path: Path,
        name: str,
        info: VideoInfo,
        history: ObjectHistory,
        outputs: Outputs,
        sound: SoundSource | None = None,
    ) -> None:
        self._path, self._name, self._info, self._history = path, name, info, history
        self._outputs, self._sound = outputs, sound
        self.warnings: tuple[str, ...] = ()
        self._unfinished = outputs.add(path)
        self._diagonal = float(np.hypot(info.width, info.height))
        self._every = max(1, round(float(info.fps) / _SHAPES_PER_S))
        self._pairs_every = max(1, round(float(info.fps) / _PAIRS_PER_S))
        self._shapes: list[NDArray[np.float32]] = []
        self._pairs = Pairs(self._pairs_every / float(info.fps))
        self._frames = 0
        self._video: _PageVideo | None = None
        self.beside: Path | None = None

    def add(self, scene: Scene, image: Image | None) -> None:
        """See `ifsvideo.types.Sink`."""
        if scene.frame % self._every == 0:
            for number in np.unique(scene.labels[scene.labels > BACKGROUND]).tolist():
                self._shapes.append(outline(scene.xy[scene.labels == number], self._diagonal))
        if scene.frame % self._pairs_every == 0:
            self._pairs.add(scene.frame // self._pairs_every, scene)
        if image is not None:
            if self._video is None:
                self._video = _PageVideo(self._path, self._info, self._outputs, self._sound)
            self._video.write(image)
        self._frames = scene.frame + 1

    def finish(self) -> None:
        """See `ifsvideo.types.Sink`."""
        shapes = np.array(self._shapes, np.float32).reshape(-1, 2 + DIRECTIONS)
        data = page_data(
            self._info, self._frames, self._history, (self._every, shapes), (self._pairs_every, self._pairs)
        )
        address = ""
        if self._video is not None:
            address, self.beside = self._video.finish()
        sounds = self._video is not None and self._video.sounds
        if self._sound and not sounds:
            self.warnings = (f"{self._path}: the sound of its video could not be kept",)
        page = fill(self._name, self._facts(), data, address, sound=sounds)
        try:
            self._unfinished.write_text(page, encoding="utf-8", newline="\n")
        except OSError as error:
            raise output_error(self._path, error) from None

    def _facts(self) -> str:
        info, count = self._info, len(self._history.table.numbers)
        objects = "nothing moves by itself" if not count else f"{count} moving object{'s' * (count > 1)}"
        rate = f"{float(info.fps):.4g} pictures a second"
        return f"{objects} · {self._frames} pictures, {info.width}×{info.height}, {rate}"


class _PageVideo:
    """The plain pictures, small, as H.264, to be put into the page or beside it."""

    def __init__(self, page: Path, info: VideoInfo, outputs: Outputs, sound: SoundSource | None) -> None:
        self._place = video_beside(page)
        self._outputs = outputs
        self._scratch = outputs.add_scratch(self._place)
        # Upright pixels: a page has no other.
        width, height = info.width * float(info.sample_aspect), info.height
        shrink = min(1.0, _WIDEST / max(width, height))
        self._size = (2 * max(1, round(shrink * width / 2)), 2 * max(1, round(shrink * height / 2)))
        small = replace(info, width=self._size[0], height=self._size[1], sample_aspect=info.sample_aspect**0)
        self._open = outputs.enter(ExitStack())
        writer = VideoWriter(self._scratch, small, audio_from=sound, for_page=True)
        self._writer = self._open.enter_context(writer)
        self._wanted = sound is not None

    def write(self, image: Image) -> None:
        small = image
        if image.shape[1::-1] != self._size:
            small = np.asarray(cv2.resize(image, self._size, interpolation=cv2.INTER_AREA), np.uint8)
        self._writer.write(small)

    @property
    def sounds(self) -> bool:
        """Whether it has sound; known after `finish`."""
        return self._wanted and not self._writer.warnings

    def finish(self) -> tuple[str, Path | None]:
        """Complete it; the address by which the page finds it, and where it stands if not in the page."""
        self._open.close()
        if self._scratch.stat().st_size <= EMBEDDED:
            return embedded(self._scratch.read_bytes(), "video/mp4"), None
        try:
            os.replace(self._scratch, self._outputs.add(self._place))
        except OSError as error:
            raise output_error(self._place, error) from None
        return beside(self._place.name), self._place
