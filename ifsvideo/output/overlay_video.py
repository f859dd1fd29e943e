"""The overlay as a video file."""

from __future__ import annotations

from pathlib import Path

from ifsvideo.output.atomic import Outputs
from ifsvideo.types import Image, Renderer, Scene, VideoInfo
from ifsvideo.video import VideoWriter


class OverlaySink:
    """Draws every frame and writes it.

    Parameters
    ----------
    path : Path
        .mp4, .mov or .mkv.
    info : VideoInfo
        Of the frames.
    renderer : Renderer
    outputs : Outputs
        Group with which the file is placed.
    audio_from : Path, optional
        File whose sound is kept.

    Raises
    ------
    OutputError
        Here and later, if the video cannot be written.
    """

    wants_image = True

    def __init__(
        self,
        path: Path,
        info: VideoInfo,
        renderer: Renderer,
        outputs: Outputs,
        audio_from: Path | None = None,
    ) -> None:
        self._renderer = renderer
        self._writer = outputs.enter(VideoWriter(path, info, audio_from=audio_from, outputs=outputs))

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a user should know of the video; complete after `finish`."""
        return self._writer.warnings

    def add(self, scene: Scene, image: Image | None) -> None:
        """See `ifsvideo.types.Sink`."""
        assert image is not None, "an overlay is refused where the input has no pictures"
        self._writer.write(self._renderer.draw(image, scene))

    def finish(self) -> None:
        """See `ifsvideo.types.Sink`."""
        self._writer.finish()
