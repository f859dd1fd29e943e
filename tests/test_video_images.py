"""Folders of images: natural order, every usual kind, one size, faults named before anything is written."""

from __future__ import annotations

import os
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import cv2
import imageio.v3 as iio
import numpy as np
import pytest

from ifsvideo.errors import InputError, UsageError
from ifsvideo.types import Image
from ifsvideo.video import open_source

RED, GREEN, BLUE = (200, 30, 10), (10, 180, 60), (0, 0, 250)


def picture() -> Image:
    """40x60 pixels: red on the left, green in the middle, blue on the right below, black above."""
    image = np.zeros((40, 60, 3), np.uint8)
    image[:, :20], image[:, 20:40], image[20:, 40:] = RED, GREEN, BLUE
    return image


def numbered(folder: Path, names: list[str]) -> None:
    """Images of 8x6 pixels whose grey tells their place in the list."""
    for place, name in enumerate(names):
        iio.imwrite(folder / name, np.full((6, 8, 3), 10 * (place % 25), np.uint8))


def greys(folder: Path, **options: float) -> list[int]:
    """Places of the images that a source yields."""
    return [int(image[3, 4, 0]) // 10 for image in open_source(folder, **options).frames()]  # type: ignore[arg-type]


def test_order_is_natural_and_other_files_are_passed_over(tmp_path: Path) -> None:
    numbered(tmp_path, ["img1.png", "img2.png", "img10.png", "IMG11.PNG", "img100.bmp"])
    numbered(tmp_path, [".hidden.png"])
    (tmp_path / "notes.txt").write_text("no image")
    (tmp_path / "folder.png").mkdir()
    source = open_source(tmp_path)
    assert greys(tmp_path) == [0, 1, 2, 3, 4]
    assert greys(tmp_path) == [0, 1, 2, 3, 4]
    assert (source.info.width, source.info.height, source.info.frames) == (8, 6, 5)
    assert source.info.fps == 10
    assert not source.info.has_audio
    assert open_source(tmp_path, fps=Fraction(30000, 1001)).info.fps == Fraction(30000, 1001)


def test_a_stretch_is_counted_at_the_rate(tmp_path: Path) -> None:
    numbered(tmp_path, [f"{k}.png" for k in range(20)])
    assert greys(tmp_path, start=0.5, end=0.8) == [5, 6, 7]
    assert greys(tmp_path, start=1.8, end=99.0) == [18, 19]
    assert open_source(tmp_path, start=0.5).info.start == pytest.approx(0.5)
    with pytest.raises(UsageError, match="past the end"):
        open_source(tmp_path, start=2.0)


def plain(folder: Path, name: str, image: Image) -> Path:
    """8 bits a channel."""
    path = folder / name
    iio.imwrite(path, image, plugin="pillow")
    return path


def deep(folder: Path, name: str, image: Image) -> Path:
    """16 bits a channel, written by OpenCV (which takes BGR)."""
    path = folder / name
    ordered = image[..., ::-1] if image.ndim == 3 else image
    assert cv2.imwrite(str(path), ordered.astype(np.uint16) * 257)
    return path


KINDS: dict[str, Callable[[Path], Path]] = {
    "png": lambda folder: plain(folder, "a.png", picture()),
    "bmp": lambda folder: plain(folder, "a.bmp", picture()),
    "tif": lambda folder: plain(folder, "a.tif", picture()),
    "jpeg": lambda folder: plain(folder, "a.JPEG", picture()),
    "webp": lambda folder: plain(folder, "a.webp", picture()),
    "alpha": lambda folder: plain(folder, "a.png", np.dstack([picture(), np.full((40, 60), 9, np.uint8)])),
    "16 bit png": lambda folder: deep(folder, "a.png", picture()),
    "16 bit tiff": lambda folder: deep(folder, "a.tiff", picture()),
}


@pytest.mark.parametrize("kind", KINDS)
def test_colour_images_of_every_kind(tmp_path: Path, kind: str) -> None:
    KINDS[kind](tmp_path)
    (image,) = open_source(tmp_path).frames()
    assert image.shape == (40, 60, 3)
    assert image.dtype == np.uint8
    assert image.flags.c_contiguous
    tolerance = 40 if kind in {"jpeg", "webp"} else 0
    for (row, column), colour in zip([(5, 8), (5, 30), (30, 50)], [RED, GREEN, BLUE], strict=True):
        assert image[row, column].tolist() == pytest.approx(colour, abs=tolerance)


@pytest.mark.parametrize("name", ["a.png", "a.tif"])
@pytest.mark.parametrize("bits", [8, 16])
def test_grey_images_become_three_equal_channels(tmp_path: Path, name: str, bits: int) -> None:
    grey = np.ascontiguousarray(picture()[..., 0])
    (plain if bits == 8 else deep)(tmp_path, name, grey)
    (image,) = open_source(tmp_path).frames()
    assert (image == grey[..., None]).all()


def test_dark_16_bit_images_are_not_stretched(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "a.png"), np.full((4, 4), 4095, np.uint16))
    assert int(next(open_source(tmp_path).frames())[0, 0, 0]) == 15


def test_exif_orientation_is_applied(tmp_path: Path) -> None:
    exif = b"Exif\0\0II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0\0\0\0\0"  # Orientation: 6
    iio.imwrite(tmp_path / "a.jpg", picture(), plugin="pillow", exif=exif, quality=95)
    source = open_source(tmp_path)
    assert (source.info.width, source.info.height) == (40, 60)
    image = next(source.frames())
    assert image[5, 35].tolist() == pytest.approx(RED, abs=20)  # the left edge is now the upper one
    assert image[50, 10].tolist() == pytest.approx(BLUE, abs=20)


def test_mixed_sizes_are_refused_before_the_first_frame(tmp_path: Path) -> None:
    numbered(tmp_path, ["1.png", "2.png", "10.png"])
    iio.imwrite(tmp_path / "3.png", np.zeros((7, 9, 3), np.uint8))
    with pytest.raises(InputError, match=r"3\.png: is 9x7 pixels but 1\.png is 8x6"):
        open_source(tmp_path)


@pytest.mark.parametrize("name", ["2.png", "2.jpg"])
@pytest.mark.parametrize("content", [b"", b"no image", None])
def test_a_damaged_image_in_the_middle_is_named(tmp_path: Path, name: str, content: bytes | None) -> None:
    numbered(tmp_path, ["1.png", "3.png"])
    noise = np.random.default_rng(0).integers(0, 255, (6, 8, 3), dtype=np.uint8)
    iio.imwrite(tmp_path / name, noise)
    whole = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(whole[: len(whole) - 40] if content is None else content)
    with pytest.raises(InputError, match="damaged or no image") as caught:
        list(open_source(tmp_path).frames())
    assert str(tmp_path / name) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_folder_without_images_is_refused(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").touch()
    with pytest.raises(InputError, match="holds no image"):
        open_source(tmp_path)


def test_images_are_closed(tmp_path: Path) -> None:
    numbered(tmp_path, [f"{k}.png" for k in range(30)])
    before = len(os.listdir("/dev/fd"))
    frames = open_source(tmp_path).frames()
    for _ in range(20):
        next(frames)
    assert len(os.listdir("/dev/fd")) == before


def test_a_rate_must_be_positive(tmp_path: Path) -> None:
    numbered(tmp_path, ["1.png"])
    with pytest.raises(UsageError, match="positive"):
        open_source(tmp_path, fps=Fraction(0))
