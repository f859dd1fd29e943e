"""Memory of a process and all that it started, read from /proc."""

from __future__ import annotations

import threading
import time
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

_EVERY_S = 0.2
_KB = 1 / 1024
_ENDING = 0.97
"""Share of the whole from which on processes end, and their memory goes."""


class MemoryWatch:
    """Adds up the resident memory of a process tree, five times a second, while the context lasts.

    Pages that processes share are counted for each of them.

    Parameters
    ----------
    pid : int
        The root; it is expected to be there all the time.
    """

    def __init__(self, pid: int) -> None:
        self._pid = pid
        self._samples: list[tuple[float, float]] = []
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    @property
    def peak(self) -> float:
        """Greatest sum, MB; 0 where /proc is not there."""
        return max((megabytes for _, megabytes in self._samples), default=0.0)

    def slope(self, from_share: float) -> float | None:
        """Growth, MB per second, over the time from a share of the whole on; None where that is too short."""
        time_s, megabytes = self._curve()
        share = time_s / max(time_s.max(initial=0.0), 1e-9)
        late = (share >= from_share) & (share <= _ENDING)
        if np.count_nonzero(late) < 10:
            return None
        return float(np.polyfit(time_s[late], megabytes[late], 1)[0])

    def _curve(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        time_s, megabytes = np.array(self._samples, np.float64).reshape(-1, 2).T
        return time_s, megabytes

    def _run(self) -> None:
        begun = time.monotonic()
        while not self._ended.wait(_EVERY_S):
            self._samples.append((time.monotonic() - begun, tree_megabytes(self._pid)))

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended.set()
        self._thread.join()


def tree_megabytes(root: int) -> float:
    """Resident memory of a process and all its descendants, MB; what ends meanwhile counts for nothing."""
    parent: dict[int, int] = {}
    resident: dict[int, float] = {}
    for status in Path("/proc").glob("[0-9]*/status"):
        try:
            lines = status.read_text().splitlines()
        except OSError:
            continue
        fields = dict(line.split(":", 1) for line in lines if ":" in line)
        pid = int(status.parent.name)
        parent[pid] = int(fields["PPid"])
        resident[pid] = _KB * float(fields.get("VmRSS", "0 kB").split()[0])
    return sum(megabytes for pid, megabytes in resident.items() if _descends(pid, root, parent))


def _descends(pid: int, root: int, parent: dict[int, int]) -> bool:
    while pid in parent and pid != root:
        pid = parent[pid]
    return pid == root
