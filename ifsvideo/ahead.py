"""Work that runs ahead in a thread of its own, as far as a limit."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import closing, suppress
from types import TracebackType
from typing import Generic, Self, TypeVar

_Item = TypeVar("_Item")
POLL_S = 0.1
"""How often who waits for another thread looks up, seconds: a signal that another thread happens to receive
does not wake one that waits without end."""
_PATIENCE_S = 3.0
"""How long it is waited for, seconds: a thread cannot be stopped, and one in a step that takes longer, in a
tracker of someone's own, must not keep the program from ending."""


class Ahead(Generic[_Item]):
    """Runs a generator in a thread; what it yields waits, at most ``limit`` items of it, to be iterated over.

    What the generator raises is raised to whoever iterates. Leaving the context closes the generator and ends
    the thread, once the step that it is in is done.

    Parameters
    ----------
    items : generator
    limit : int
    interrupt : callable, optional
        Makes the generator go on where it waits for something from outside.
    """

    def __init__(
        self,
        items: Generator[_Item, None, None],
        limit: int,
        interrupt: Callable[[], None] | None = None,
    ) -> None:
        self._items = items
        self._interrupt = interrupt
        self._queue: queue.Queue[_Item | _End] = queue.Queue(limit)
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def _run(self) -> None:
        end = _End(None)
        try:
            with closing(self._items):
                for item in self._items:
                    self._queue.put(item)
                    if self._stopped.is_set():
                        return
        except BaseException as error:
            end = _End(error)
        if not self._stopped.is_set():
            self._queue.put(end)

    def __iter__(self) -> Iterator[_Item]:
        while True:
            try:
                item = self._queue.get(timeout=POLL_S)
            except queue.Empty:
                continue
            if isinstance(item, _End):
                if item.error is not None:
                    raise item.error
                return
            yield item

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stopped.set()
        if self._interrupt is not None and self._thread.is_alive():
            self._interrupt()
        end = time.monotonic() + _PATIENCE_S
        while self._thread.is_alive() and time.monotonic() < end:
            with suppress(queue.Empty):
                self._queue.get(timeout=POLL_S)


class _End:
    """After the last item: why it was the last."""

    def __init__(self, error: BaseException | None) -> None:
        self.error = error
