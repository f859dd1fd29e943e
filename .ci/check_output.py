"""Check what the main command wrote: ``check_output.py INPUT OVERLAY LABELS``; the first fault ends it."""

from __future__ import annotations

import csv
import re
import struct
import sys
from pathlib import Path
from typing import Any

import imageio_ffmpeg

COLUMNS = "frame,time_s,track_id,x,y,label"
ROW = re.compile(r"\d+,\d+\.\d{4},\d+,-?\d+\.\d\d,-?\d+\.\d\d,(-1|0|[1-9]\d*)")


def decode(path: Path) -> tuple[int, dict[str, Any]]:
    """Frames that ffmpeg decodes of a video, and what it says of it."""
    frames = imageio_ffmpeg.read_frames(str(path))
    told: dict[str, Any] = next(frames)
    return sum(1 for _ in frames), told


def boxes(path: Path) -> list[bytes]:
    """Names of an MP4's outermost boxes, in order."""
    content, place, names = path.read_bytes(), 0, []
    while place < len(content):
        size, name = struct.unpack_from(">I4s", content, place)
        if size == 1:
            (size,) = struct.unpack_from(">Q", content, place + 8)
        assert size >= 8, f"{path}: broken box {name!r} at {place}"
        names.append(name)
        place += size
    assert place == len(content), f"{path}: the last box is cut off"
    return names


def check_overlay(source: Path, overlay: Path) -> tuple[int, dict[str, Any]]:
    """An MP4 that plays in a browser, with the frames, size and rate of the input."""
    (expected, before), (frames, after) = decode(source), decode(overlay)
    assert frames == expected, f"{frames} frames, the input has {expected}"
    for name in ("source_size", "fps"):
        assert after[name] == before[name], f"{name} is {after[name]}, the input's is {before[name]}"
    assert after["codec"].startswith("h264"), after["codec"]
    assert after["pix_fmt"].startswith("yuv420p"), after["pix_fmt"]
    order = boxes(overlay)
    assert order.index(b"moov") < order.index(b"mdat"), f"a browser must load all of it first: {order}"
    return frames, after


def check_labels(labels: Path, frames: int, size: tuple[int, int], fps: float) -> None:
    """The contract of the CSV: header, form, range and order of the rows, numbers of the objects."""
    text = labels.read_text(encoding="ascii")
    assert text.endswith("\n"), "the last line is not complete"
    head, *lines = text.splitlines()
    assert head == COLUMNS, head
    wrong = next((line for line in lines if not ROW.fullmatch(line)), None)
    assert wrong is None, f"row {wrong!r}"
    rows = list(csv.DictReader(text.splitlines()))
    keys = [(int(row["frame"]), int(row["track_id"])) for row in rows]
    assert keys == sorted(set(keys)), "rows are not ordered by frame and track, each once"
    assert {frame for frame, _ in keys} == set(range(frames)), "there are frames without a point"
    for row in rows:
        assert abs(float(row["time_s"]) - int(row["frame"]) / fps) < 1e-4, row
        assert -0.5 <= float(row["x"]) <= size[0] - 0.5, row
        assert -0.5 <= float(row["y"]) <= size[1] - 0.5, row
    used = {int(row["label"]) for row in rows}
    objects = used - {-1, 0}
    assert 0 in used, "no background"
    assert objects, "no object was found"
    assert objects == set(range(1, len(objects) + 1)), f"numbers are left out: {sorted(objects)}"
    print(f"{len(rows)} rows, labels {sorted(used)}")


def main() -> None:
    """Check the files that the command line names."""
    source, overlay, labels = map(Path, sys.argv[1:])
    frames, told = check_overlay(source, overlay)
    print(f"{frames} frames, {told['source_size']}, {told['fps']} frames per second, {told['codec']}")
    check_labels(labels, frames, told["source_size"], told["fps"])


if __name__ == "__main__":
    main()
