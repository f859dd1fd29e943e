"""Free memory is given back."""

from __future__ import annotations

import ctypes
import re
from pathlib import Path

import numpy as np
import pytest

from ifsvideo.allocator import give_back

_STATUS = Path("/proc/self/status")


def resident_mb() -> float:
    return int(re.findall(r"VmRSS:\s*(\d+) kB", _STATUS.read_text())[0]) / 1024


@pytest.mark.skipif(
    not _STATUS.exists() or not hasattr(ctypes.CDLL(None), "malloc_trim"), reason="needs Linux with glibc"
)
def test_holes_between_what_lasts_are_given_back() -> None:
    blocks = [np.ones(60_000, np.uint8) for _ in range(2000)]  # below what glibc maps by itself
    full = resident_mb()
    lasting = blocks[::20]
    del blocks
    give_back()
    assert resident_mb() < full - 60
    assert all(block.all() for block in lasting)


def test_without_glibc_nothing_happens(monkeypatch) -> None:
    monkeypatch.setattr(ctypes, "CDLL", lambda name: object())
    give_back()
