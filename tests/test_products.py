"""All further outputs of one run: read by others, taken back, and refused where they make no sense."""

from __future__ import annotations

import csv
import json
from fractions import Fraction
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from PIL import Image

import ifsvideo
from ifsvideo import cli
from ifsvideo.config import Config, TrackerConfig
from ifsvideo.errors import OutputError, UsageError
from ifsvideo.objects.events import KINDS
from ifsvideo.output.products import Products
from ifsvideo.output.summary_json import schema, summary_document
from ifsvideo.pipeline import Pipeline
from ifsvideo.types import MovingObject, Result, VideoInfo

from .conftest import HEIGHT, WIDTH
from .drives import INFO, drive, history
from .test_pipeline import ByStep

FILES = ("objects", "mot", "summary", "tracks")
ENDINGS = {"objects": "o.csv", "mot": "m.txt", "summary": "s.json", "tracks": "t.npz"}


@pytest.fixture
def pipeline() -> Pipeline:
    return Pipeline(Config(tracking=TrackerConfig(max_points=150)), segmenter=ByStep())


def everything(folder: Path) -> Products:
    places = {name: folder / ending for name, ending in ENDINGS.items()}
    return Products(**places, masks=folder / "masks", clips=folder / "clips")


def test_one_run_writes_them_all(pipeline, clip, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    result = pipeline.run(clip, products=everything(out))
    assert sorted(path.name for path in out.iterdir()) == [
        "clips",
        "m.txt",
        "masks",
        "o.csv",
        "s.json",
        "t.npz",
    ]
    assert set(result.further) == set(out.iterdir())
    with (out / "o.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(np.loadtxt(out / "m.txt", delimiter=",", ndmin=2)) == len(result.history) > 10
    assert len(list((out / "masks").iterdir())) == 24
    with Image.open(out / "masks" / "00012.png") as picture:
        assert picture.size == (WIDTH, HEIGHT)
        assert set(np.unique(np.array(picture))) == {0, 1}
    with np.load(out / "t.npz") as tracks:
        assert tracks["xy"].shape[0] == 24
        assert np.isin(result.table.ids, tracks["ids"]).all()
        assert int(tracks["visible"].sum()) == len(result.table.ids)
    told = json.loads((out / "s.json").read_text())
    jsonschema.validate(told, schema())
    assert [event["text"] for event in told["events"]] == [event.text for event in result.events]
    assert {event["clip"] for event in told["events"]} == {path.name for path in (out / "clips").iterdir()}
    assert told["outputs"]["masks"] == str(out / "masks")
    assert told["settings"]["config"]["tracking"]["max_points"] == 150


def test_tracks_are_taken_back_and_give_the_same_labels(clip, tmp_path):
    own = Pipeline(Config(tracking=TrackerConfig(max_points=150)), segmenter=ByStep())
    first = own.run(clip, products=Products(tracks=tmp_path / "t.npz"))
    again = own.run(
        tmp_path / "t.npz", products=Products(objects=tmp_path / "o.csv", summary=tmp_path / "s.json")
    )
    np.testing.assert_array_equal(again.table.xy, first.table.xy)
    assert (again.info.fps, again.info.width) == (first.info.fps, first.info.width)
    jsonschema.validate(json.loads((tmp_path / "s.json").read_text()), schema())
    assert len(ifsvideo.segment(ifsvideo.load_tracks(tmp_path / "t.npz")).labels) > 20


def test_names_may_be_strings(pipeline, clip, tmp_path):
    result = pipeline.run(clip, products=Products(objects=str(tmp_path / "o.csv")))
    assert result.further == (tmp_path / "o.csv",)
    assert (tmp_path / "o.csv").exists()


def test_a_failure_leaves_nothing(clip, tmp_path):
    class Broken(ByStep):
        def segment(self, tracks, motions=None):
            raise RuntimeError

    with pytest.raises(RuntimeError):
        Pipeline(segmenter=Broken()).run(clip, products=everything(tmp_path))
    assert [path.name for path in tmp_path.iterdir()] == ["clip.mp4"]


def test_nothing_that_moves_gives_empty_files(clips, tmp_path):
    result = Pipeline().run(clips["white"], products=everything(tmp_path))
    assert result.events == ()
    assert (tmp_path / "o.csv").read_text().count("\n") == 1
    assert list((tmp_path / "clips").iterdir()) == []
    jsonschema.validate(json.loads((tmp_path / "s.json").read_text()), schema())


class TestSummary:
    def test_the_schema_is_one(self):
        jsonschema.Draft202012Validator.check_schema(schema())
        assert schema()["properties"]["events"]["items"]["properties"]["kind"]["enum"] == list(KINDS)

    def test_objects_and_events_are_told(self):
        found = history(drive(lambda t: (-3.0, 75.0 - 12.0 * t, 0.0)))
        item = MovingObject(1, 0.0, 3.0, 90)
        result = Result(INFO, None, (item,), None, None, ("odd",), {"tracking": 1.23456})
        told = summary_document(result, Path("a.mp4"), 100, found, {}, {"config": {}}, {"overlay": None})
        jsonschema.validate(told, schema())
        assert json.loads(json.dumps(told, allow_nan=False)) == told
        (one,) = told["objects"]
        assert 0 < one["shortest_ttc_s"] < 1.5
        assert one["path"][0][0] == 0.0
        assert np.diff([place[0] for place in one["path"]]) == pytest.approx(0.2)
        assert [event["kind"] for event in told["events"]] == ["appears", "comes closer fast", "leaves"]
        assert (told["input"]["fps"], told["input"]["end_s"]) == ("25", 4.0)
        assert told["warnings"] == ["odd"]

    @pytest.mark.parametrize("change", [{"version": 2}, {"extra": 1}, {"events": [{"kind": "sings"}]}])
    def test_the_schema_refuses_what_is_not_promised(self, change):
        empty = Result(VideoInfo(4, 4, Fraction(25)), None, (), None, None, (), {})
        told = summary_document(empty, None, 0, history([]), {}, {"config": {}}, {})
        jsonschema.validate(told, schema())
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate({**told, **change}, schema())


class TestRefusals:
    @pytest.mark.parametrize("name", FILES)
    def test_unknown_endings(self, pipeline, clip, tmp_path, name):
        with pytest.raises(UsageError, match=r"unknown ending '\.doc'"):
            pipeline.run(clip, products=Products(**{name: tmp_path / "x.doc"}))

    def test_equal_places(self, pipeline, clip, tmp_path):
        with pytest.raises(UsageError, match="is the labels too"):
            pipeline.run(clip, labels=tmp_path / "a.csv", products=Products(objects=tmp_path / "a.csv"))
        with pytest.raises(UsageError, match="is the masks too"):
            pipeline.run(clip, products=Products(masks=tmp_path / "a", clips=tmp_path / "b" / ".." / "a"))
        np.savez(tmp_path / "t.npz", xy=np.zeros((3, 9, 2)))
        with pytest.raises(UsageError, match="is the input itself"):
            pipeline.run(tmp_path / "t.npz", products=Products(tracks=tmp_path / "t.npz"))

    def test_clips_need_a_video_and_its_own_times(self, pipeline, clip, tmp_path):
        np.savez(tmp_path / "t.npz", xy=np.zeros((3, 9, 2)))
        with pytest.raises(UsageError, match=r"t\.npz: is no video file to cut clips out of"):
            pipeline.run(tmp_path / "t.npz", products=Products(clips=tmp_path / "c"))
        with pytest.raises(UsageError, match="leave out fps"):
            pipeline.run(clip, fps=10, products=Products(clips=tmp_path / "c"))

    def test_a_folder_with_something_else_is_kept(self, pipeline, clip, tmp_path):
        (tmp_path / "m").mkdir()
        (tmp_path / "m" / "mine.txt").touch()
        with pytest.raises(OutputError, match=r"holds mine\.txt"):
            pipeline.run(clip, products=Products(masks=tmp_path / "m"))
        assert (tmp_path / "m" / "mine.txt").exists()

    @pytest.mark.parametrize(
        ("options", "status", "complaint"),
        [
            (["--objects", "o.txt"], 2, "unknown ending '.txt'"),
            (["--mot", "no/m.txt"], 4, "the folder no does not exist"),
            (["--masks", "file"], 4, "is a file; name a folder"),
            (["--tracks", "x.npz", "--json", "x.npz"], 2, "unknown ending '.npz'"),
            (["--mot", "a.mp4"], 2, "unknown ending '.mp4'"),
        ],
    )
    def test_the_command_says_so_in_one_line(
        self, clip, tmp_path, monkeypatch, capsys, options, status, complaint
    ):
        monkeypatch.chdir(tmp_path)
        clip.rename(tmp_path / "a.mp4")
        (tmp_path / "file").touch()
        before = sorted(tmp_path.iterdir())
        assert cli.main(["a.mp4", "--quiet", *options]) == status
        err = capsys.readouterr().err
        assert complaint in err
        assert err.count("\n") == 1
        assert sorted(tmp_path.iterdir()) == before


def test_the_command_has_an_option_for_each(clip, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    options = [
        "--objects",
        "o.csv",
        "--json",
        "s.json",
        "--mot",
        "m.txt",
        "--tracks",
        "t.npz",
        "--masks",
        "m",
    ]
    assert cli.main(["clip.mp4", *options, "--clips", "c", "--max-points", "80"]) == 0
    told = capsys.readouterr().out
    for place in ("clip.ifs.mp4", "o.csv", "s.json", "m.txt", "t.npz", "m", "c"):
        assert (tmp_path / place).exists()
        assert f"wrote       {place}\n" in told
