"""How long each stage works, where stages run side by side."""

from __future__ import annotations

import threading
import time
from collections import defaultdict
from collections.abc import Generator, Iterable
from contextlib import ExitStack, closing, contextmanager
from typing import TypeVar

_Item = TypeVar("_Item")


class Stopwatch:
    """Adds up seconds by stage; a stage inside another counts for itself only."""

    def __init__(self) -> None:
        self._seconds: dict[str, float] = defaultdict(float)
        self._lock = threading.Lock()
        self._open = threading.local()

    @contextmanager
    def stage(self, name: str) -> Generator[None, None, None]:
        """Count the time of a block; each thread has stages of its own."""
        outer = getattr(self._open, "inner", None)
        inner = self._open.inner = [0.0]  # what stages inside this one took
        begun = time.perf_counter()
        try:
            yield
        finally:
            spent = time.perf_counter() - begun
            with self._lock:
                self._seconds[name] += spent - inner[0]
            self._open.inner = outer
            if outer is not None:
                outer[0] += spent

    def seconds_of(self, names: Iterable[str]) -> dict[str, float]:
        """Seconds of those of the named stages that took any."""
        return {name: self._seconds[name] for name in names if name in self._seconds}

    def each(self, name: str, items: Iterable[_Item]) -> Generator[_Item, None, None]:
        """The items; the time that it takes to come by each of them counts."""
        iterator = iter(items)
        with ExitStack() as stack:
            if isinstance(items, Generator):
                stack.enter_context(closing(items))
            while True:
                with self.stage(name):
                    item = next(iterator, _END)
                if item is _END:
                    return
                yield item  # type: ignore[misc]


_END = object()
