"""Folders of images, read as a video in natural order."""

from __future__ import annotations

import re
from collections.abc import Generator
from fractions import Fraction
from pathlib import Path
from typing import Any

import imageio.v3 as iio
import numpy as np

from ifsvideo.errors import InputError
from ifsvideo.types import Image, VideoInfo
from ifsvideo.video.source import FrameSource, choose_stretch

ENDINGS = frozenset({".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp"})
"""What counts as an image of a folder, in any case; everything else and every hidden file is passed over."""
DEFAULT_FPS = Fraction(10)
"""Rate of a folder unless told: what cameras on research vehicles take (KITTI)."""
_SIDEWAYS = frozenset({5, 6, 7, 8})  # EXIF orientations that swap width and height


class ImageFolder(FrameSource):
    """The images of a folder, img2 before img10, all of one size.

    Grey, palette and colour images are read alike, transparency is ignored, EXIF orientation applied (not
    of PNG). Images of 16 bits a channel keep their upper 8, so that white stays white and every image of a
    folder is scaled alike.

    Parameters
    ----------
    path : Path
    fps : Fraction, optional
        Frames per second, 10 unless told.
    start, end : float
        Stretch that is read, seconds; see `choose_stretch`.

    Raises
    ------
    InputError
        If there is no image, one cannot be read, or their sizes differ; the sizes are read before any frame.
    UsageError
        If the stretch makes no sense.
    """

    def __init__(
        self, path: Path, *, fps: Fraction | None = None, start: float = 0.0, end: float | None = None
    ) -> None:
        self.path = path
        rate = fps or DEFAULT_FPS
        files = _list_images(path)
        stretch = choose_stretch(path, rate, 0.0, len(files), start, end)
        self._files = files[stretch.first : stretch.stop]
        width, height = _common_size(self._files)
        self.info = VideoInfo(width, height, rate, frames=len(self._files), start=float(stretch.first / rate))

    def frames(self) -> Generator[Image, None, None]:
        """See `FrameSource.frames`."""
        for file in self._files:
            image = _read(file)
            if image.shape != (self.info.height, self.info.width, 3):
                raise InputError(f"{file}: changed its size while the folder was read; run again")
            yield image


def natural_key(name: str) -> tuple[list[str | int], str]:
    """Sorting key by which numbers in a name count as numbers."""
    parts = re.split(r"([0-9]+)", name)
    return [int(part) if place % 2 else part.casefold() for place, part in enumerate(parts)], name


def _list_images(folder: Path) -> list[Path]:
    try:
        files = [
            file
            for file in folder.iterdir()
            if file.suffix.lower() in ENDINGS and not file.name.startswith(".") and file.is_file()
        ]
    except OSError as error:
        raise InputError(f"{folder}: cannot be listed ({error.strerror}); check its permissions") from None
    if not files:
        raise InputError(f"{folder}: holds no image ({', '.join(sorted(ENDINGS))}); name a folder of frames")
    return sorted(files, key=lambda file: natural_key(file.name))


def _common_size(files: list[Path]) -> tuple[int, int]:
    """Width and height of all images, read from their headers."""
    size = _size(files[0])
    for file in files[1:]:
        other = _size(file)
        if other != size:
            raise InputError(
                f"{file}: is {other[0]}x{other[1]} pixels but {files[0].name} is {size[0]}x{size[1]}; "
                "give every image the same size"
            )
    return size


def _opened(file: Path) -> Any:
    """An open image; its type in imageio knows nothing of what the Pillow plugin can do."""
    return iio.imopen(file, "r", plugin="pillow")


def _turns(file: Path) -> bool:
    """Whether EXIF orientation is looked for: rare in a PNG, where it may stand last and cost a decoding."""
    return file.suffix.lower() != ".png"


def _size(file: Path) -> tuple[int, int]:
    """Width and height of the upright image."""
    sideways = False
    try:
        with _opened(file) as opened:
            height, width = opened.properties(index=0).shape[:2]
            if _turns(file):
                tags = opened.metadata(index=0, exclude_applied=False)
                sideways = tags.get("Orientation") in _SIDEWAYS
    except Exception as error:
        raise _unreadable(file, error) from None
    return (height, width) if sideways else (width, height)


def _read(file: Path) -> Image:
    """One image as (H, W, 3) uint8 RGB."""
    try:
        with _opened(file) as opened:
            kind = opened.properties(index=0).dtype
            deep = kind.kind in "iu" and kind.itemsize > 1  # Pillow keeps only grey images at 16 bits
            pixels = opened.read(index=0, rotate=_turns(file), mode=None if deep else "RGB")
    except Exception as error:
        raise _unreadable(file, error) from None
    if deep:
        pixels = np.repeat((pixels >> 8).clip(0, 255).astype(np.uint8)[..., None], 3, axis=2)
    return np.ascontiguousarray(pixels, dtype=np.uint8)


def _unreadable(file: Path, error: Exception) -> InputError:
    """One message for the many kinds that imageio and Pillow raise, whose texts speak of plugins."""
    if isinstance(error, PermissionError):
        return InputError(f"{file}: no permission to read it; change its mode or its owner")
    return InputError(f"{file}: is damaged or no image; replace it or remove it")
