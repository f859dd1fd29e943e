"""The benchmark's pictures, and what is computed for them."""

from __future__ import annotations

import json
from pathlib import Path

import imageio.v3 as imageio
import numpy as np
import pytest

from ifsvideo.benchmark import __main__ as command
from ifsvideo.benchmark import stages
from ifsvideo.types import Segmentation, Tracks

FRAMES = 5
LEFT, MIDDLE, RIGHT = np.arange(9), np.arange(9, 18), np.arange(18, 27)
SEGMENTS = np.repeat([0, 1, 2], 9)


def grids() -> Tracks:
    """Three grids of nine points side by side, of which the right one rises by 4 px a frame."""
    grid = np.stack(np.meshgrid(np.arange(3) * 5.0, np.arange(3) * 5.0), axis=-1).reshape(-1, 2)
    xy = np.concatenate([grid + np.array([20.0 * place, 40.0]) for place in range(3)])[None].repeat(
        FRAMES, axis=0
    )
    xy[:, RIGHT, 1] -= 4.0 * np.arange(FRAMES)[:, None]
    return Tracks.from_array(xy, size=(80, 60))


def found(**details: object) -> Segmentation:
    labels = (SEGMENTS == 2).astype(np.int64)
    return Segmentation(labels, labels == 0, SEGMENTS, np.ones(27), details)


def test_pairs_are_one_kept_apart_and_one_merged() -> None:
    apart, merged = stages.pairs_of_segments(grids(), found())
    assert (apart.title, merged.title) == ("kept apart", "merged")
    np.testing.assert_array_equal(apart.members, [MIDDLE, RIGHT])
    np.testing.assert_array_equal(merged.members, [LEFT, MIDDLE])


def test_shear_and_stretch_add_up_over_the_frames() -> None:
    apart, merged = stages.pairs_of_segments(grids(), found())
    for pair in (apart, merged):
        for name in ("inside first", "inside second"):
            np.testing.assert_allclose([pair.shear[name], pair.stretch[name]], 0, atol=1e-9)
    np.testing.assert_allclose([merged.shear["between"], merged.stretch["between"]], 0, atol=1e-9)
    # Nine pairs, matched row by row from the nearest: level edges of 10, 20 and 30 px that one end of rises.
    lengths = np.repeat([10.0, 20.0, 30.0], 3)
    turned = np.degrees(np.arctan2(4.0 * np.arange(FRAMES)[:, None], lengths))
    stretched = np.hypot(4.0 * np.arange(FRAMES)[:, None], lengths) - lengths
    np.testing.assert_allclose(apart.shear["between"], turned.mean(axis=1)[1:])
    np.testing.assert_allclose(apart.stretch["between"], stretched.mean(axis=1)[1:])


def test_a_single_segment_has_no_pair() -> None:
    one = Segmentation(np.zeros(27, np.int64), np.ones(27, bool), np.zeros(27, np.int64), np.ones(27))
    assert stages.pairs_of_segments(grids(), one) == []


def test_points_never_seen_are_in_no_pair() -> None:
    tracks = grids()
    xy = tracks.xy.copy()
    xy[:, 20] = np.nan
    apart, _ = stages.pairs_of_segments(Tracks.from_array(xy), found())
    assert 20 not in apart.members[1]
    assert np.isfinite(apart.shear["between"]).all()


def test_stages_come_in_order_and_missing_ones_are_left_out() -> None:
    truth = np.where(SEGMENTS == 2, 1, 2)
    plain = stages.groups_by_stage(found(), truth)
    assert [name.split()[0] for name in plain] == ["1", "4", "5", "truth"]
    np.testing.assert_array_equal(plain["truth"], SEGMENTS == 2)  # numbered as the labels that match
    usable = np.arange(1, 27)
    full = stages.groups_by_stage(found(start=usable % 5, usable=usable), truth)
    (start,) = (groups for name, groups in full.items() if name.startswith("3"))
    assert start[0] == -1
    assert len(np.unique(start[1:])) == 5
    assert start.max() == 5
    odd = stages.groups_by_stage(found(start=np.zeros((3, 3)), usable=usable), truth)
    assert list(odd) == list(plain)


def test_true_groups_that_nothing_matches_get_numbers_of_their_own() -> None:
    truth = np.r_[SEGMENTS[:26] + 1, 0]
    one = found()
    shown = stages.groups_by_stage(one, truth)["truth"]
    assert [np.unique(shown[members]).tolist() for members in (LEFT, MIDDLE, RIGHT[:-1])] == [[0], [2], [1]]
    assert shown[26] == -1


class Grids:
    """A segmenter that knows the three grids."""

    def __init__(self, seed: int) -> None:
        pass

    def segment(self, tracks: Tracks, motions: int | None = None) -> Segmentation:
        return found(start=SEGMENTS)


def test_pictures_are_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("matplotlib", reason="matplotlib is an extra")
    monkeypatch.setattr(command, "IFSFactory", lambda config: Grids)
    for name in ("a", "b"):
        np.savez(tmp_path / f"{name}.npz", xy=grids().xy, labels=np.where(SEGMENTS == 2, 2, 1))
    pictures = tmp_path / "pictures"
    arguments = ["--jobs", "1", "--plot", str(pictures), "--show", "a", "--json", str(tmp_path / "a.json")]
    assert command.main(["tracks", str(tmp_path), *arguments]) == 0
    names = {"errors.png", "noise.png", "motions.png", "a_stages.png", "a_shear.png"}
    assert {file.name for file in pictures.iterdir()} == names
    for file in pictures.iterdir():
        image = imageio.imread(file)
        assert min(image.shape[:2]) > 200
        assert image[..., :3].std() > 10, f"{file.name} is empty"
    printed = capsys.readouterr().out
    assert all(f"wrote {pictures / name}" in printed for name in names)
    curve = json.loads((tmp_path / "a.json").read_text())["noise_curve"]
    assert [one["noise"] for one in curve] == [0, 0.01, 0.25, 0.5, 1, 2, 4]


def test_a_sequence_that_is_not_there_is_refused_before_the_work(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("matplotlib", reason="matplotlib is an extra")
    np.savez(tmp_path / "a.npz", xy=grids().xy, labels=SEGMENTS + 1)
    pictures = tmp_path / "pictures"
    assert command.main(["tracks", str(tmp_path), "--plot", str(pictures), "--show", "c"]) == 2
    assert "no sequence is called c" in capsys.readouterr().err
    assert command.main(["tracks", str(tmp_path), "--plot", str(tmp_path / "no" / "pictures")]) == 4
    assert not pictures.exists()
