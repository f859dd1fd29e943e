"""The benchmark of real clips in which what moves was marked by hand."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest

from ifsvideo.benchmark import __main__ as command
from ifsvideo.benchmark import marked, marking
from ifsvideo.benchmark.marking import FrameMarks, Marks, Passing
from ifsvideo.errors import InputError
from ifsvideo.types import Counts, LabelTable, Result, VideoInfo
from ifsvideo.video import open_source

MARKED = ("davis_car_shadow", "static_pedestrians")


def rows(points: list[tuple[float, float, int]], frames: int = 3) -> LabelTable:
    """The same points (x, y, label) in every frame."""
    n = len(points)
    return LabelTable(
        np.repeat(np.arange(frames, dtype=np.int32), n),
        np.tile(np.arange(n, dtype=np.int64), frames),
        np.tile(np.array([p[:2] for p in points], np.float32).reshape(-1, 2), (frames, 1)),
        np.tile(np.array([p[2] for p in points], np.int32), frames),
        frames,
    )


def with_masks(folder: Path, frames: int = 3) -> Path:
    """A folder of 40 x 30 masks, a square of 20 pixels at (10, 5) in each."""
    mask = np.zeros((30, 40), np.uint8)
    mask[5:25, 10:30] = 255
    (folder / "gt").mkdir()
    for frame in range(frames):
        iio.imwrite(folder / "gt" / f"{frame}.png", mask)
    return folder


def test_only_marked_frames_count_and_uncounted_wins():
    marks = Marks(frame=(FrameMarks(1, moving=((10, 10, 5, 8),), uncounted=((13, 10, 9, 9),)),))
    table = rows([(10, 10, 0), (9.4, 10, 0), (12, 17.4, 0), (12, 17.6, 0), (13, 12, 0)])
    truth = marks.truth(table, Path()).reshape(3, 5)
    assert truth[1].tolist() == [1, 0, 1, 0, -1]
    assert (truth[[0, 2]] == -1).all()


def test_masks_their_border_and_what_passes(tmp_path: Path):
    passing = Passing("a dog", (0, 2), ((30, 0, 4, 4), (34, 8, 4, 4)))
    marks = Marks(masks="gt", border=2, passing=(passing,))
    inside, border, outside, dog = (20, 15, 0), (11, 15, 0), (3, 15, 0), (33, 6, 0)
    truth = marks.truth(rows([inside, border, outside, dog]), with_masks(tmp_path)).reshape(3, 4)
    assert truth.tolist() == [[1, -1, 0, 0], [1, -1, 0, -1], [1, -1, 0, 0]]


def test_what_passes_behind_a_mask_takes_nothing_from_it(tmp_path: Path):
    behind = Passing("a dog", (0, 2), ((0, 0, 40, 30),) * 2)
    truth = Marks(masks="gt", passing=(behind,)).truth(rows([(20, 15, 0), (3, 3, 0)]), with_masks(tmp_path))
    assert truth.tolist() == [1, -1] * 3


def test_a_box_goes_evenly_from_one_frame_to_the_next():
    passing = Passing("a dog", (2, 4, 5), ((0, 0, 4, 4), (10, 4, 8, 4), (0, 0, 1, 1)))
    assert [passing.at(frame) for frame in (1, 2, 3, 6)] == [None, (0, 0, 4, 4), (5, 2, 6, 4), None]
    for frames, boxes in (((2, 2), ((0, 0, 1, 1),) * 2), ((1, 2, 3), ((0, 0, 1, 1),) * 2)):
        with pytest.raises(ValueError, match="a dog: expected a box for each frame"):
            Passing("a dog", frames, boxes)


def test_score_counts_undecided_as_not_found():
    marks = Marks(frame=(FrameMarks(0, moving=((0, 0, 10, 10),)), FrameMarks(2)))
    table = rows([(1, 1, 4), (2, 2, -1), (3, 3, 0), (20, 20, 0), (21, 20, 1), (22, 20, -1)])
    score = marked.score(table, marks, Path())
    assert score.found == pytest.approx(100 / 3)
    assert (score.moving, score.others) == (3, 9)
    assert (score.false, score.undecided) == (pytest.approx(100 / 3), pytest.approx(100 / 3))
    nothing = marked.score(rows([]), marks, Path())
    assert (nothing.found, nothing.false, nothing.undecided) == (None, None, None)


def test_a_clip_that_is_not_the_marked_one_is_refused(tmp_path: Path):
    with pytest.raises(InputError, match="has 3 frames, frame 9 is marked"):
        Marks(frame=(FrameMarks(9),)).truth(rows([(1, 1, 0)]), tmp_path)
    with_masks(tmp_path, frames=2)
    with pytest.raises(InputError, match="gt: holds 2 masks for 3 frames"):
        Marks(masks="gt").truth(rows([(1, 1, 0)]), tmp_path)
    (tmp_path / "gt" / "2.png").write_bytes(b"no picture")
    with pytest.raises(InputError, match=r"gt/2\.png: is no picture"):
        Marks(masks="gt").truth(rows([(1, 1, 0)]), tmp_path)


@pytest.mark.parametrize("name", MARKED)
def test_marks_that_are_kept_can_be_read(name: str):
    marks = marking.marks_of(Path(f"elsewhere/{name}.avi"))
    assert bool(marks.masks) != bool(marks.frame)
    boxes = [box for one in marks.frame for box in (*one.moving, *one.uncounted)]
    boxes += [box for one in marks.passing for box in one.boxes]
    assert all(left >= 0 and top >= 0 and width > 0 and height > 0 for left, top, width, height in boxes)
    numbers = [one.number for one in marks.frame]
    assert numbers == sorted(set(numbers))


def test_people_are_marked_in_twenty_frames(shared: Path):
    """Marks lie on the picture, in frames that there are, and a person differs from the empty scene."""
    clip = shared / "videos" / "static_pedestrians.avi"
    marks = {one.number: one for one in marking.marks_of(clip).frame}
    assert len(marks) == 20
    grey = {k: image.mean(axis=2) for k, image in enumerate(open_source(clip).frames()) if k in marks}
    empty = np.median(list(grey.values()), axis=0)
    for number, one in marks.items():
        changed = np.abs(grey[number] - empty) > 15
        for left, top, width, height in one.moving:
            assert left + width <= 480
            assert top + height <= 360
            assert changed[top : top + height, left : left + width].mean() > 0.25
        assert changed.mean() < 0.1


class Perfect:
    """A pipeline that finds the square of `with_masks`; with an odd seed it calls everything moving."""

    def __init__(self, seed: int) -> None:
        self.seed = seed

    def run(self, source: Path, *, start: float = 0.0, end: float | None = None) -> Result:
        assert source.name == "frames"
        table = rows([(20, 15, 1), (3, 15, self.seed % 2), (2, 3, self.seed % 2)])
        return Result(
            VideoInfo(40, 30, Fraction(10)), Counts(0, 0, 0, 0, 0), (), None, None, (), {}, kept=table
        )


def test_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    monkeypatch.setattr(marked, "PipelineFactory", lambda config: Perfect)
    place = tmp_path / "davis_car_shadow"
    (place / "frames").mkdir(parents=True)
    iio.imwrite(place / "frames" / "0.png", np.zeros((30, 40), np.uint8))
    with_masks(place)
    line = ["marked", str(place), "--runs", "2", "--jobs", "1", "--json", str(tmp_path / "a.json")]
    assert command.main(line) == 0
    (clip,) = json.loads((tmp_path / "a.json").read_text())["clips"]
    assert (clip["name"], clip["found"], clip["false"], clip["moving"]) == ("davis_car_shadow", 100, 50, 3)
    assert "davis_car_shadow   100.00    50.00" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "status", "message"),
    [
        (
            ["nobody.avi"],
            3,
            "nobody.avi: nobody marked a clip of that name; there are marks of davis_car_shadow, s",
        ),
        (["static_pedestrians.avi"], 3, "static_pedestrians.avi: does not exist"),
        (["static_pedestrians.avi", "--json", "nowhere/a.json"], 4, "the folder nowhere does not"),
    ],
)
def test_what_cannot_end_well_is_refused_before_the_work(
    arguments: list[str],
    status: int,
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(marked, "in_processes", lambda *_: pytest.fail("work was begun"))
    assert command.main(["marked", *arguments]) == status
    assert message in capsys.readouterr().err
