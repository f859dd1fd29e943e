"""Free memory is given back, by the program and by the processes that it starts."""

from __future__ import annotations

import ctypes
import re
from pathlib import Path

import numpy as np
import pytest

from ifsvideo.allocator import give_back
from ifsvideo.worker import Worker

_STATUS = "/proc/{}/status"
_needs_glibc = pytest.mark.skipif(
    not Path(_STATUS.format("self")).exists() or not hasattr(ctypes.CDLL(None), "malloc_trim"),
    reason="needs Linux with glibc",
)


def resident_mb(process: int | str = "self") -> float:
    return int(re.findall(r"VmRSS:\s*(\d+) kB", Path(_STATUS.format(process)).read_text())[0]) / 1024


@_needs_glibc
def test_holes_between_what_lasts_are_given_back() -> None:
    blocks = [np.ones(60_000, np.uint8) for _ in range(2000)]  # below what glibc maps by itself
    full = resident_mb()
    lasting = blocks[::20]
    del blocks
    give_back()
    assert resident_mb() < full - 60
    assert all(block.all() for block in lasting)


@_needs_glibc
def test_a_worker_gives_back_after_some_calls() -> None:
    with Worker(exec, "runs") as worker:
        worker("import sys; sys.blocks = [bytes([1]) * 60_000 for _ in range(2000)]")
        full = resident_mb(worker.pid)
        worker("sys.blocks = sys.blocks[::20]")
        for _ in range(64):
            worker("len(sys.blocks)")
        assert resident_mb(worker.pid) < full - 60


def test_without_glibc_nothing_happens(monkeypatch) -> None:
    monkeypatch.setattr(ctypes, "CDLL", lambda name: object())
    give_back()
