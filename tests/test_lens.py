"""Radial distortion: its model, its inverse, and that the segmenter sees coordinates without it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ifsvideo.errors import UsageError
from ifsvideo.lens import K1_LEAST, distort, undistort
from ifsvideo.segmentation.config import SegmenterConfig
from ifsvideo.segmentation.segmenter import IFSSegmenter
from ifsvideo.video import open_source
from tests.conftest import encode
from tests.scenes import LEFT_CAR, SIZE, Camera, make_scene

PICTURE = (640, 360)
GRID = np.stack(np.meshgrid(np.linspace(0, 639, 65), np.linspace(0, 359, 37)), axis=-1)


@pytest.mark.parametrize("k1", [K1_LEAST + 1e-6, -0.1, -0.01, 0.0, 0.05, 1.0])
def test_undistort_is_the_inverse_of_distort_all_over_the_picture(k1: float) -> None:
    np.testing.assert_allclose(distort(undistort(GRID, PICTURE, k1), PICTURE, k1), GRID, atol=1e-6)


def test_a_point_in_the_corner_and_one_half_way() -> None:
    """Done by hand: half a diagonal of (60, 80) is 50, the centre (29.5, 39.5), the ray (0.6, 0.8)."""
    xy = np.array([29.5, 39.5]) + np.array([[0.0, 0.0], [15.0, 20.0], [30.0, 40.0]])
    expected = np.array([29.5, 39.5]) + np.array([[0, 0], [15 * 0.975, 20 * 0.975], [30 * 0.9, 40 * 0.9]])
    np.testing.assert_allclose(distort(xy, (60, 80), -0.1), expected)


def test_what_is_not_seen_or_not_bent_stays() -> None:
    seen = np.array([[[10.0, 20.0], [np.nan, np.nan]], [[np.nan, np.nan], [5.0, 6.0]]])
    np.testing.assert_array_equal(np.isnan(undistort(seen, PICTURE, -0.1)), np.isnan(seen))
    np.testing.assert_allclose(undistort(seen, PICTURE, 0.0), seen)
    assert undistort(np.empty((3, 0, 2)), PICTURE, -0.1).shape == (3, 0, 2)


def test_no_point_is_lost_beyond_the_corners() -> None:
    far = undistort(np.array([[-30.0, -20.0], [900.0, 500.0]]), PICTURE, -0.145)
    assert np.isfinite(far).all()


@pytest.mark.parametrize("k1", [-4 / 27, -1.0, 1.1, float("nan"), float("inf")])
def test_a_lens_that_cannot_be_undone_is_refused(k1: float) -> None:
    with pytest.raises(UsageError, match="above -4/27"):
        undistort(GRID, PICTURE, k1)
    with pytest.raises(UsageError, match=r"segmentation\.distortion must be above -4/27"):
        SegmenterConfig(distortion=k1)


def test_the_model_is_that_of_ffmpeg(tmp_path: Path) -> None:
    """ffmpeg's lenscorrection moves a dot to where `undistort` says."""
    k1, dots = -0.12, [(60, 50), (320, 60), (560, 300)]
    picture = np.zeros((360, 640, 3), np.uint8)
    for x, y in dots:
        picture[y - 3 : y + 4, x - 3 : x + 4] = 255
    filtered = f"lenscorrection=k1={k1}:k2=0:i=bilinear"
    clip = encode(tmp_path / "dots.mp4", [picture], "-vf", filtered, "-qp", "0")
    (image,) = open_source(clip).frames()
    found = image[..., 0] > 128
    for x, y in undistort(np.array(dots), PICTURE, k1):
        rows, columns = np.nonzero(found & near(found.shape, x, y, 12))
        # A dot is 7 pixels wide and stretched unevenly; in the corners it is moved by 30.
        assert (columns.mean(), rows.mean()) == (pytest.approx(x, abs=1.5), pytest.approx(y, abs=1.5))


def near(shape: tuple[int, int], x: float, y: float, reach: float) -> np.ndarray:
    """Pixels within reach of a place."""
    row, column = np.indices(shape)
    return np.hypot(column - x, row - y) < reach


@pytest.mark.parametrize("movers", [(), (LEFT_CAR,)], ids=["static", "car"])
@pytest.mark.parametrize("config", [SegmenterConfig(), SegmenterConfig.thesis()], ids=["default", "thesis"])
def test_a_bent_scene_is_segmented_as_the_straight_one(config: SegmenterConfig, movers: tuple) -> None:
    scene = make_scene(Camera.path(turn=(0, 0, 0.04), step=(0.1, 0, 0)), movers, static=100).with_gaps()
    bent = replace(scene.tracks, xy=distort(scene.tracks.xy, SIZE, -0.14))
    straight = IFSSegmenter(config).segment(scene.tracks)
    told = IFSSegmenter(replace(config, distortion=-0.14)).segment(bent)
    np.testing.assert_array_equal(told.labels, straight.labels)
    np.testing.assert_allclose(told.details["evidence"], straight.details["evidence"], atol=1e-3)
    untold = IFSSegmenter(config).segment(bent)
    assert not np.allclose(untold.details["evidence"], straight.details["evidence"], atol=1e-3)
