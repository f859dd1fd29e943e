"""Masks as Pillow reads them, and folders that appear whole or not at all."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ifsvideo.errors import OutputError
from ifsvideo.output.atomic import Outputs, check_folder
from ifsvideo.output.masks import OWN_FILES, MaskSink, davis_palette
from ifsvideo.types import Scene, VideoInfo

INFO = VideoInfo(120, 80, Fraction(25))


def scene(frame: int, *objects: tuple[int, tuple[int, int, int, int]]) -> Scene:
    """Objects of 5 x 5 points over (left, top, right, bottom)."""
    xy, labels = [np.empty((0, 2))], [np.empty(0, int)]
    for number, (left, top, right, bottom) in objects:
        grid = np.meshgrid(np.linspace(left, right, 5), np.linspace(top, bottom, 5))
        xy.append(np.stack(grid, axis=-1).reshape(-1, 2))
        labels.append(np.full(25, number))
    points, number = np.concatenate(xy).astype(np.float32), np.concatenate(labels).astype(np.int32)
    return Scene(frame, 0.0, np.arange(len(points)), points, number, points[None])


def write(folder: Path, *scenes: Scene) -> MaskSink:
    with Outputs() as outputs:
        sink = MaskSink(folder, INFO, outputs)
        for one in scenes:
            sink.add(one, None)
        sink.finish()
    return sink


def test_pillow_reads_numbers_and_colours(tmp_path):
    write(tmp_path / "m", scene(0, (1, (20, 20, 60, 60)), (2, (30, 30, 40, 40))), scene(1))
    assert sorted(path.name for path in (tmp_path / "m").iterdir()) == ["00000.png", "00001.png"]
    with Image.open(tmp_path / "m" / "00000.png") as picture:
        assert (picture.mode, picture.size) == ("P", (120, 80))
        assert picture.getpalette()[:12] == [0, 0, 0, 128, 0, 0, 0, 128, 0, 128, 128, 0]
        mask = np.array(picture)
    # The small object lies on the large one.
    assert (mask[25, 25], mask[35, 35], mask[10, 10]) == (1, 2, 0)
    assert abs(int((mask > 0).sum()) - 41 * 41) < 200
    with Image.open(tmp_path / "m" / "00001.png") as picture:
        assert not np.array(picture).any()


def test_the_palette_is_that_of_davis():
    palette = davis_palette()
    assert palette.shape == (256, 3)
    known = {8: (64, 0, 0), 9: (192, 0, 0), 16: (0, 64, 0), 32: (0, 0, 64), 255: (224, 224, 192)}
    assert {number: tuple(palette[number].tolist()) for number in known} == known


def test_more_objects_than_an_index_holds_are_left_out_with_a_warning(tmp_path):
    sink = write(tmp_path / "m", scene(0, (255, (10, 10, 30, 30)), (256, (60, 10, 90, 40))))
    with Image.open(tmp_path / "m" / "00000.png") as picture:
        assert set(np.unique(np.array(picture))) == {0, 255}
    assert len(sink.warnings) == 1
    assert "above 255" in sink.warnings[0]


def test_an_older_folder_is_replaced_whole(tmp_path):
    write(tmp_path / "m", scene(0), scene(1), scene(2))
    check_folder(tmp_path / "m", OWN_FILES)
    write(tmp_path / "m", scene(0, (1, (20, 20, 60, 60))))
    assert [path.name for path in (tmp_path / "m").iterdir()] == ["00000.png"]
    assert [path.name for path in tmp_path.iterdir()] == ["m"]


def test_after_a_failure_the_older_folder_stands(tmp_path):
    write(tmp_path / "m", scene(0), scene(1))
    outputs = Outputs()
    MaskSink(tmp_path / "m", INFO, outputs).add(scene(0, (1, (20, 20, 60, 60))), None)
    with pytest.raises(RuntimeError), outputs:
        raise RuntimeError
    assert len(list((tmp_path / "m").iterdir())) == 2
    assert [path.name for path in tmp_path.iterdir()] == ["m"]


def test_folders_are_placed_with_the_files_of_their_group(tmp_path, monkeypatch):
    write(tmp_path / "m", scene(0))
    (tmp_path / "t.txt").write_text("old")
    outputs = Outputs()
    MaskSink(tmp_path / "m", INFO, outputs).add(scene(0, (1, (20, 20, 60, 60))), None)
    outputs.add(tmp_path / "t.txt").write_text("new")
    taken = outputs.add(tmp_path / "gone.txt")
    taken.unlink()
    with pytest.raises(OutputError), outputs:
        pass
    assert (tmp_path / "t.txt").read_text() == "old"
    with Image.open(tmp_path / "m" / "00000.png") as picture:
        assert not np.array(picture).any()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["m", "t.txt"]


def test_a_folder_with_something_of_others_is_refused(tmp_path):
    (tmp_path / "m").mkdir()
    check_folder(tmp_path / "m", OWN_FILES)
    (tmp_path / "m" / "holiday.jpg").touch()
    with pytest.raises(OutputError, match=r"m: holds holiday.jpg, which would be lost"):
        check_folder(tmp_path / "m", OWN_FILES)
    with pytest.raises(OutputError, match=r"none: .* does not exist|the folder .*none does not exist"):
        check_folder(tmp_path / "none" / "m", OWN_FILES)
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match="is a file; name a folder"):
        check_folder(tmp_path / "file", OWN_FILES)
