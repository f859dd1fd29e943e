"""Reading tracks from .npz and the benchmarks' .mat files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from ifsvideo.errors import InputError
from ifsvideo.tracking.files import load_tracks

SHARED = Path(__file__).resolve().parents[2] / "shared" / "datasets"
XY = np.random.default_rng(0).uniform(0, 99, (7, 5, 2))
HOMOGENEOUS = np.concatenate([XY.transpose(2, 1, 0), np.ones((1, 5, 7))])


def save(file: Path, **fields: Any) -> Path:
    if file.suffix == ".npz":
        np.savez(file, **fields)
    else:
        savemat(file, fields)
    return file


def test_npz_with_coordinates_alone(tmp_path: Path) -> None:
    tracks = load_tracks(save(tmp_path / "a.npz", xy=XY))
    np.testing.assert_array_equal(tracks.xy, XY)
    assert tracks.visible.all()
    assert tracks.ids.tolist() == [0, 1, 2, 3, 4]


def test_npz_with_mask_gaps_and_ids(tmp_path: Path) -> None:
    xy, visible = XY.copy(), np.ones((7, 5), bool)
    xy[2, 1] = np.nan
    visible[3, 4] = False
    file = save(tmp_path / "a.npz", xy=xy, visible=visible, ids=[9, 3, 7, 1, 0])
    tracks = load_tracks(str(file.rename(tmp_path / "A.NPZ")))
    assert np.argwhere(~tracks.visible).tolist() == [[2, 1], [3, 4]]
    assert np.isnan(tracks.xy[3, 4]).all()
    assert tracks.ids.tolist() == [9, 3, 7, 1, 0]


def test_hopkins_layout(tmp_path: Path) -> None:
    tracks = load_tracks(save(tmp_path / "a.mat", y=HOMOGENEOUS, x=HOMOGENEOUS / 9, width=640, height=480))
    np.testing.assert_array_equal(tracks.xy, XY)
    assert tracks.size == (640, 480)


@pytest.mark.parametrize("masked", [True, False])
def test_kt3dmoseg_layout(tmp_path: Path, masked: bool) -> None:
    visible = np.ones((5, 7), np.uint8)
    visible[4, 2] = 0
    data = {"ySparse": HOMOGENEOUS} | ({"visibleSparse": visible} if masked else {})
    tracks = load_tracks(save(tmp_path / "a.mat", Data=data))
    np.testing.assert_array_equal(tracks.xy[:, :4], XY[:, :4])
    assert np.argwhere(~tracks.visible).tolist() == ([[2, 4]] if masked else [])


def test_one_frame_in_a_mat_file(tmp_path: Path) -> None:
    tracks = load_tracks(save(tmp_path / "a.mat", y=HOMOGENEOUS[:, :, 0]))
    np.testing.assert_array_equal(tracks.xy, XY[:1])


@pytest.mark.parametrize(
    ("name", "fields", "message"),
    [
        ("a.npz", {"uv": XY}, "no field xy, only uv"),
        ("a.npz", {"xy": XY[..., 0]}, r"shape \(7, 5\)"),
        ("a.npz", {"xy": XY, "visible": np.ones((5, 7))}, "visible has shape"),
        ("a.npz", {"xy": XY, "ids": [1, 2]}, "5 integers"),
        ("a.npz", {"xy": XY, "ids": [1.5] * 5}, "5 integers"),
        ("a.npz", {"xy": XY, "ids": [1, 2, 3, 3, 4]}, "twice"),
        ("a.npz", {"xy": XY.astype(str)}, "not numbers"),
        ("a.npz", {"xy": XY.astype(object)}, "damaged"),
        ("a.npz", {"xy": XY[:0]}, "5 tracks over 0 frames"),
        ("a.npz", {"xy": XY[:, :0]}, "0 tracks over 7 frames"),
        ("a.mat", {"z": XY}, "neither y nor Data.ySparse, only z"),
        ("a.mat", {"Data": {"other": 1}}, "neither y nor Data.ySparse, only Data"),
        ("a.mat", {"Data": 3}, "neither y nor Data.ySparse, only Data"),
        ("a.mat", {"y": XY}, "y has shape"),
        ("a.mat", {"y": "text"}, "not numbers"),
        (
            "a.mat",
            {"Data": {"ySparse": HOMOGENEOUS, "visibleSparse": np.ones((7, 5))}},
            "visibleSparse has shape",
        ),
    ],
)
def test_says_what_is_wrong_with_the_content(tmp_path: Path, name: str, fields: Any, message: str) -> None:
    file = save(tmp_path / name, **fields)
    with pytest.raises(InputError, match=message) as caught:
        load_tracks(file)
    assert str(caught.value).startswith(f"{file}: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["a.npz", "a.mat"])
@pytest.mark.parametrize("damage", ["empty", "text", "cut"])
def test_says_that_a_file_is_damaged(tmp_path: Path, name: str, damage: str) -> None:
    file = tmp_path / name
    content = save(file, y=HOMOGENEOUS, xy=XY).read_bytes()
    file.write_bytes({"empty": b"", "text": b"frame,x,y\n" * 40, "cut": content[: len(content) // 2]}[damage])
    with pytest.raises(InputError, match=r"damaged|cannot be read") as caught:
        load_tracks(file)
    assert str(caught.value).startswith(f"{file}: ")
    assert "\n" not in str(caught.value)


def test_plain_array_under_the_wrong_name(tmp_path: Path) -> None:
    file = tmp_path / "a.npz"
    with file.open("wb") as stream:
        np.save(stream, XY)
    with pytest.raises(InputError, match="single array"):
        load_tracks(file)


def test_other_ending_missing_file_and_folder(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("1 2 3")
    for name, message in (
        ("a.txt", "not a file of tracks"),
        ("b.npz", "no such file"),
        (".", "no such file"),
    ):
        with pytest.raises(InputError, match=message):
            load_tracks(tmp_path / name)


@pytest.mark.skipif(not SHARED.is_dir(), reason="the benchmark data is not here")
@pytest.mark.parametrize(
    ("name", "shape", "size"),
    [
        ("hopkins155/1R2RC/1R2RC_truth.mat", (29, 459), (640, 480)),
        ("kt3dmoseg/Seq011_Clip01_Tracks.mat", (16, 473), None),
    ],
)
def test_files_of_the_benchmarks(name: str, shape: tuple[int, int], size: tuple[int, int] | None) -> None:
    tracks = load_tracks(SHARED / name)
    assert tracks.visible.shape == shape
    assert tracks.size == size
    assert tracks.visible.all() == (size is not None)
