"""What the page is made of: outlines, pairs, packed numbers, escaped text, files in their places."""

from __future__ import annotations

import base64
import json
import re
import subprocess
from fractions import Fraction

import numpy as np
import pytest

import ifsvideo
from ifsvideo.errors import OutputError, UsageError
from ifsvideo.objects.history import Event, ObjectHistory
from ifsvideo.output.atomic import Outputs
from ifsvideo.output.products import Products
from ifsvideo.report import sink
from ifsvideo.report.data import page_data
from ifsvideo.report.page import as_script, beside, fill, packed
from ifsvideo.report.pairs import Pairs
from ifsvideo.report.shapes import DIRECTIONS, outline, steady
from ifsvideo.types import VideoInfo

from .conftest import FFMPEG, decoded, tone
from .reports import INFO, Mover, history_of, make_report, scenes


def test_outline_follows_the_points():
    corners = np.array([[100, 50], [300, 50], [300, 150], [100, 150]], np.float32)
    found = outline(corners, 1000.0)
    np.testing.assert_allclose(found[:2], (200, 100), atol=0.5)
    margin = 10.0
    along = DIRECTIONS // 4
    assert found[2] == pytest.approx(100 + margin, abs=0.5)
    assert found[2 + along] == pytest.approx(50 + margin, abs=0.5)
    assert found[2 + 2 * along] == pytest.approx(100 + margin, abs=0.5)
    assert (outline(corners[:1], 1000.0)[2:] > 8).all(), "one point has an outline too"


def test_an_outline_that_twitches_is_steadied_as_the_object_moves_and_grows():
    step = np.arange(12)
    size = 100 * np.exp(0.05 * step)
    boxes = np.stack([10.0 * step, 5.0 * step, size, size], axis=1)
    wanted = np.column_stack([boxes[:, :2] + size[:, None] / 2, np.tile(0.6 * size[:, None], DIRECTIONS)])
    seen = wanted.copy()
    seen[6, 2:] *= 1.5
    np.testing.assert_allclose(steady(seen, boxes), wanted, rtol=1e-4)


def test_packed_numbers_are_found_again():
    values = np.array([0.0, 1.234, -2.5, np.nan, 1e9])
    read = np.frombuffer(base64.b64decode(packed(values, "i2", 1000.0)), "<i2")
    np.testing.assert_array_equal(read, [0, 1234, -2500, 32767, 32766])


def test_shear_and_stretch_are_those_of_the_motion():
    # The second object goes away from the first: lines between them grow and do not turn.
    movers = [Mover((100, 100), (0, 0)), Mover((220, 100), (2, 0))]
    pairs = Pairs(step_s=0.1)
    for sample, scene in enumerate(scenes(movers, 6)):
        pairs.add(sample, scene)
    found = {(item.first, item.second): item for item in pairs.series(1000)}
    assert set(found) == {(0, 1), (0, 2), (1, 2)}
    np.testing.assert_allclose(found[1, 2].stretch, 20.0, rtol=0.05)
    assert found[1, 2].shear.max() < found[0, 2].shear.max()
    np.testing.assert_allclose(found[0, 1].stretch, 0.0, atol=1e-4)
    np.testing.assert_array_equal(found[1, 2].sample, np.arange(1, 6))


def test_pairs_longest_together_are_kept():
    movers = [Mover((100, 100), (0, 0)), Mover((220, 100), (2, 0), first=3)]
    pairs = Pairs(step_s=0.1)
    for sample, scene in enumerate(scenes(movers, 6)):
        pairs.add(sample, scene)
    assert [(item.first, item.second) for item in pairs.series(6)] == [(0, 1)]
    assert pairs.series(0) == []


def content(page: str) -> dict:
    found = re.search(r'<script id="data" type="application/json">(.*?)</script>', page, re.DOTALL)
    assert found
    return json.loads(found[1])


def test_text_from_outside_stays_text():
    name = "</script><img src=x onerror=alert(1)>&<!--title-->/*script*/.mp4"
    page = fill(name, name, {"text": name}, beside(name))
    assert "<img" not in page
    assert content(page) == {"text": name}
    assert page.count("</script>") == 2
    assert page.count("&lt;!--title--&gt;") >= 2
    assert "\u2028" not in as_script({"a": "\u2028"})


def test_page_is_one_file_with_its_video(tmp_path):
    page = make_report(tmp_path / "r.html", [Mover((40, 50), (1, 0), first=2, last=20)], frames=24)
    assert [path.name for path in tmp_path.iterdir()] == ["r.html"]
    text = page.read_text(encoding="utf-8")
    assert 'src="data:video/mp4;base64,' in text
    assert not re.search(r'(?:src|href)="(?!data:|#)', text), "nothing is loaded from elsewhere"
    told = content(text)
    (item,) = told["objects"]
    assert (item["number"], item["first"], item["last"]) == (1, 0.1, 1.0)
    assert item["picture"].startswith("data:image/jpeg;base64,")
    assert told["frames"] == 24


def test_a_large_video_stands_beside_its_page(tmp_path, monkeypatch):
    monkeypatch.setattr(sink, "EMBEDDED", 1000)
    page = make_report(tmp_path / "a b.html", [Mover((40, 50), (1, 0))], frames=24)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a b.html", "a b.video.mp4"]
    assert 'src="./a%20b.video.mp4"' in page.read_text()
    assert decoded(tmp_path / "a b.video.mp4") == (24, (INFO.width, INFO.height), 20)


def test_a_failure_leaves_neither_page_nor_video(tmp_path, monkeypatch):
    monkeypatch.setattr(sink, "EMBEDDED", 1000)
    (tmp_path / "r.html").write_text("older")

    def broken(*arguments, **named):
        raise RuntimeError("broken")

    monkeypatch.setattr(sink, "fill", broken)
    with pytest.raises(RuntimeError, match="broken"):
        make_report(tmp_path / "r.html", [Mover((40, 50), (1, 0))], frames=24)
    assert [path.name for path in tmp_path.iterdir()] == ["r.html"]
    assert (tmp_path / "r.html").read_text() == "older"


def test_tracks_have_a_page_without_a_video(tmp_path):
    page = make_report(tmp_path / "r.html", [Mover((40, 50), (1, 0))], frames=24, pictures=False)
    text = page.read_text()
    assert "<video" not in text
    assert len(content(text)["objects"]) == 1


def test_ten_minutes_of_many_objects_stay_below_five_megabytes():
    rng = np.random.default_rng(0)
    info = VideoInfo(1280, 720, Fraction(30))
    history, outlines, every = long_history(info, rng)
    pairs = Pairs(0.2)
    pairs._found = {(a, b): [(i, 1.0, 1.0) for i in range(400)] for a in range(40) for b in range(a + 1, 40)}
    data = page_data(info, 18000, history, (every, outlines), (6, pairs))
    size = len(fill("ten minutes.mp4", "", data, "./r.video.mp4"))
    assert 2e6 < size < 5e6
    assert len(data["objects"]) == 200
    assert sum(bool(item["picture"]) for item in data["objects"]) > 20


def long_history(info: VideoInfo, rng: np.random.Generator) -> tuple[ObjectHistory, np.ndarray, int]:
    """Two hundred objects, each half a minute in sight, so ten at a time, and their outlines."""
    every = 2
    first = np.sort(rng.integers(0, 8550, 200)) * every
    frame = np.concatenate([np.arange(start, start + 900, every) for start in first])
    number = np.repeat(np.arange(1, 201), 450)
    order = np.lexsort((number, frame))
    history = history_of(info, frame[order], number[order], rng)
    history.thumbnails = {n: rng.integers(0, 255, (90, 160, 3), dtype=np.uint8) for n in range(1, 201)}
    history.events = tuple(
        Event(start, start / 30, n, "appears", f"object {n} appears at the left")
        for n, start in enumerate(first.tolist(), 1)
    )
    outlines = rng.uniform(0, 700, (len(frame), 2 + DIRECTIONS)).astype(np.float32)
    return history, outlines, every


def test_pipeline_writes_the_page(clip, tmp_path):
    result = ifsvideo.Pipeline().run(clip, products=Products(report=tmp_path / "r.html"))
    assert result.further == (tmp_path / "r.html",)
    told = content((tmp_path / "r.html").read_text())
    assert told["frames"] == 24
    assert len(told["objects"]) == len(result.objects)


@pytest.mark.parametrize("room", [sink.EMBEDDED, 0])
def test_the_page_has_the_sound_of_the_input(clip, tmp_path, monkeypatch, room):
    monkeypatch.setattr(sink, "EMBEDDED", room)
    loud = tmp_path / "loud.mp4"
    join = ["-i", tone(tmp_path / "tone.m4a", 1.2), "-c", "copy", loud]
    subprocess.run([FFMPEG, "-v", "error", "-i", clip, *join], check=True)
    page = tmp_path / "r.html"
    products = Products(report=page)
    assert ifsvideo.Pipeline().run(loud, products=products).warnings == ()
    address = re.search(r'<video id="video" src="([^"]*)" controls playsinline', page.read_text())
    assert address
    video = tmp_path / "r.video.mp4"
    if room:
        video.write_bytes(base64.b64decode(address[1].partition("base64,")[2]))
    said = subprocess.run([FFMPEG, "-i", video], capture_output=True, text=True, check=False).stderr
    assert "Audio: aac" in said
    assert decoded(video)[0] == 24
    ifsvideo.Pipeline().run(loud, products=products, audio=False)
    assert "controls muted playsinline" in page.read_text()


def test_sound_that_cannot_be_read_costs_only_the_sound(clip, tmp_path):
    with Outputs() as outputs:
        page = sink.ReportSink(tmp_path / "r.html", "c", INFO, ObjectHistory(INFO), outputs, clip)
        page.add(next(scenes([], 1)), np.zeros((INFO.height, INFO.width, 3), np.uint8))
        page._history.finish()
        page.finish()
    assert page.warnings == (f"{tmp_path / 'r.html'}: the sound of its video could not be kept",)
    assert "controls muted playsinline" in (tmp_path / "r.html").read_text()


def test_places_are_checked_before_any_work(clip, tmp_path):
    with pytest.raises(UsageError, match=r"r\.htm: unknown ending"):
        Products(report=tmp_path / "r.htm").check({})
    with pytest.raises(UsageError, match=r"is the overlay"):
        Products(report=tmp_path / "r.html").check({"the overlay": tmp_path / "r.video.mp4"})
    with pytest.raises(OutputError, match="does not exist"), Outputs():
        Products(report=tmp_path / "none" / "r.html").check({})
