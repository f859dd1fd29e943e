"""Pieces cut out of a video: copied from a key frame, exact elsewhere, named after what they show."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from ifsvideo.objects.history import Event
from ifsvideo.output.atomic import Outputs
from ifsvideo.output.event_clips import OWN_FILES, write_clips
from ifsvideo.video import open_source
from ifsvideo.video.cutting import Cutter
from ifsvideo.video.probe import key_frames

from .conftest import FPS, encode


@pytest.fixture(scope="module")
def counted(tmp_path_factory) -> Path:
    """6 s whose frame k has the brightness 2 k, with key frames at 0 and 3 s."""
    images = [np.full((64, 96, 3), 2 * frame, np.uint8) for frame in range(6 * FPS)]
    return encode(tmp_path_factory.mktemp("counted") / "c.mp4", images, "-x264opts", "keyint=60:no-scenecut")


def shown(path: Path) -> list[int]:
    """Numbers of the frames of a piece."""
    return [round(float(image.mean()) / 2) for image in open_source(path).frames()]


def test_key_frames_are_known(counted, tmp_path):
    assert key_frames(counted).tolist() == pytest.approx([0.0, 3.0])
    (tmp_path / "no.mp4").write_bytes(b"no video")
    assert len(key_frames(tmp_path / "no.mp4")) == 0


@pytest.mark.parametrize(
    ("start", "end", "first", "copied"),
    [
        (0.0, 1.0, 0, True),
        (0.6, 1.2, 0, True),
        (3.0, 4.0, 60, True),
        (3.9, 5.0, 60, True),
        (1.5, 2.5, 30, False),
    ],
)
def test_a_piece_begins_with_a_key_frame_or_exactly(counted, tmp_path, start, end, first, copied):
    piece = Cutter(counted).cut(start, end, tmp_path / "p")
    found = shown(piece)
    assert found[0] == pytest.approx(first, abs=1)
    assert len(found) >= round((end - start) * FPS)
    if not copied:
        assert len(found) == round((end - start) * FPS)
        assert found == pytest.approx(list(range(30, 50)), abs=1)


def test_past_the_end_there_is_what_there_is(counted, tmp_path):
    assert shown(Cutter(counted).cut(5.5, 9.0, tmp_path / "p"))[-1] == pytest.approx(119, abs=1)


def test_an_avi_is_cut_into_a_container_of_ours(counted, tmp_path):
    images = [np.full((64, 96, 3), 2 * frame, np.uint8) for frame in range(40)]
    avi = encode(tmp_path / "c.avi", images, "-c:v", "mpeg4", "-g", "12")
    assert Cutter(avi).cut(0.0, 1.0, tmp_path / "p").suffix == ".mkv"
    assert shown(tmp_path / "p.mkv")[0] == 0


def test_each_event_has_its_clip_and_those_at_once_share_one(counted, tmp_path):
    events = [
        Event(20, 1.0, 1, "comes closer fast", ""),
        Event(24, 1.2, 2, "appears", ""),
        Event(90, 4.5, 1, "leaves", ""),
    ]
    with Outputs() as outputs:
        clip_of = write_clips(tmp_path / "clips", counted, events, outputs)
    names = ["0001.00s-object-1-comes-closer-fast.mp4", "0004.50s-object-1-leaves.mp4"]
    assert [clip_of[event] for event in events] == [names[0], names[0], names[1]]
    assert sorted(path.name for path in (tmp_path / "clips").iterdir()) == names
    assert all(re.fullmatch(OWN_FILES, name) for name in names)
    assert 50 <= shown(tmp_path / "clips" / names[1])[0] <= 60
