"""The overlay as a file: a video, or an animation."""

from __future__ import annotations

from pathlib import Path

from ifsvideo.config import OverlayConfig
from ifsvideo.errors import UsageError
from ifsvideo.output.atomic import Outputs
from ifsvideo.output.layout import Composition
from ifsvideo.types import Image, Renderer, Scene, VideoInfo
from ifsvideo.video import ANIMATIONS, AnimationWriter, VideoWriter
from ifsvideo.video.sound import SoundSource

_WITH_ALPHA = (".mov", *ANIMATIONS)


def check_wishes(path: Path, config: OverlayConfig) -> None:
    """Refuse what the kind of file cannot do, before any work is done.

    Raises
    ------
    UsageError
        If it knows no transparency, or none of its kind is made to a size.
    """
    ending = path.suffix.lower()
    if config.transparent and ending not in _WITH_ALPHA:
        raise UsageError(
            f"{path}: {ending} knows no transparency; name an output in {', '.join(_WITH_ALPHA)}"
        )
    if config.max_size_mb is not None and ending not in ANIMATIONS:
        raise UsageError(f"{path}: a size is kept for {' and '.join(ANIMATIONS)} only; leave out the size")


class OverlaySink:
    """Draws every frame and writes it.

    Parameters
    ----------
    path : Path
        .mp4, .mov, .mkv, .gif or .webp.
    info : VideoInfo
        Of the input.
    renderer : Renderer
    outputs : Outputs
        Group with which the file is placed.
    audio_from : path or JoinedSound, optional
        Whose sound is kept, where the file can hold it and plays at the same speed.
    config : OverlayConfig, optional

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
        audio_from: SoundSource | None = None,
        config: OverlayConfig | None = None,
    ) -> None:
        config = config or OverlayConfig()
        self._composition = Composition(renderer, config, info)
        self._warnings: tuple[str, ...] = ()
        self._writer: AnimationWriter | VideoWriter
        info = self._composition.info
        if path.suffix.lower() in ANIMATIONS:
            limit = None if config.max_size_mb is None else int(1e6 * config.max_size_mb)
            self._writer = AnimationWriter(
                path, info, outputs=outputs, transparent=config.transparent, max_bytes=limit
            )
        else:
            if config.slow != 1.0 and audio_from is not None:
                self._warnings = (f"{path}: without the sound, which does not fit what is slowed down",)
                audio_from = None
            self._writer = VideoWriter(
                path, info, audio_from=audio_from, outputs=outputs, transparent=config.transparent
            )
        outputs.enter(self._writer)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a user should know of the video; complete after `finish`."""
        return (*self._warnings, *self._writer.warnings)

    def add(self, scene: Scene, image: Image | None) -> None:
        """See `ifsvideo.types.Sink`."""
        assert image is not None, "an overlay is refused where the input has no pictures"
        self._writer.write(self._composition.draw(image, scene))

    def finish(self) -> None:
        """See `ifsvideo.types.Sink`."""
        self._writer.finish()
