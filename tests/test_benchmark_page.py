"""The benchmark of the page: its clip has the objects it is told to have, and it measures what it says."""

from __future__ import annotations

import json

import pytest

from ifsvideo.benchmark import __main__ as benchmark
from ifsvideo.benchmark import browser, page


def test_every_object_is_seen_and_keeps_its_tracks():
    seen: dict[int, set[int]] = {}
    for scene in page.scenes(12, 200):
        assert (scene.ids[1:] > scene.ids[:-1]).all()
        for number in set(scene.labels.tolist()) - {0}:
            seen.setdefault(number, set()).update(scene.ids[scene.labels == number].tolist())
    assert sorted(seen) == list(range(1, 13))
    assert {len(tracks) for tracks in seen.values()} == {20}


NEEDS = pytest.mark.skipif(not browser.HERE, reason="no chromium and chromedriver here")


@pytest.mark.parametrize("here", [pytest.param(True, marks=NEEDS), False])
def test_a_page_is_measured(monkeypatch, capsys, tmp_path, here):
    made_up = page.scenes
    monkeypatch.setattr(page, "scenes", lambda objects, frames: made_up(objects, 60))
    monkeypatch.setattr(browser, "HERE", here)
    figures = tmp_path / "figures.json"
    line = ["page", "--minutes", "1", "--objects", "4", "--runs", "2", "--json", str(figures)]
    assert benchmark.main(line) == 0
    out = capsys.readouterr().out
    assert out.startswith("page: 1 minutes, 4 objects\n\nsize: 0.")
    report = json.loads(figures.read_text())
    assert 20_000 < report["bytes"] < 200_000
    assert report["embedded_video_bytes"] > 3_000
    assert len(report["seconds"]) == (2 if here else 0)
    assert ("median of 2" in out) == here
    assert ("not measured" in out) != here
