"""Several inputs of one command: handed out to an executor, and noted when done, so that a run can go on.

A cluster's executor can stand in for `local_executor`: it needs `submit` and `shutdown` of
`concurrent.futures.Executor`, and paths that mean the same on every machine.
"""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from multiprocessing import active_children, get_context, parent_process
from pathlib import Path
from types import FrameType, TracebackType
from typing import Any, TypeVar

import cv2
import numpy as np

from ifsvideo.arguments import Arguments, Job
from ifsvideo.errors import IfsVideoError
from ifsvideo.pipeline import Pipeline
from ifsvideo.summary import summary
from ifsvideo.types import Progress, Result
from ifsvideo.video.ffmpeg import kill_all

_Value = TypeVar("_Value")


@dataclass(frozen=True)
class Outcome:
    """What is told of a clip that was run; small, as it may come from another process.

    Attributes
    ----------
    text : str
        The summary, for people.
    written : tuple of Path
    length_s : float
    objects, events : int
    contact : (time in the clip, time to contact) or None
        The shortest there is, seconds.
    """

    text: str
    written: tuple[Path, ...]
    length_s: float
    objects: int
    events: int
    contact: tuple[float, float] | None


def perform(job: Job, told: Arguments, progress: Progress | None = None) -> Outcome:
    """Run one clip.

    Raises
    ------
    IfsVideoError
        As `Pipeline.run`.
    """
    begun = time.perf_counter()
    result = Pipeline(told.config).run(
        job.whole,
        job.output,
        job.labels,
        fps=told.fps,
        start=told.start,
        end=told.end,
        preview=told.preview,
        ignore=told.ignore,
        motions=told.motions,
        products=job.products,
        keep_table=False,
        progress=progress,
    )
    places = (result.output, result.labels, *result.further)
    return Outcome(
        summary(str(job.source), result, time.perf_counter() - begun),
        tuple(path for path in places if path is not None),
        float(result.counts.frames / result.info.fps),
        len(result.objects),
        len(result.events),
        _shortest_contact(result),
    )


def _shortest_contact(result: Result) -> tuple[float, float] | None:
    history = result.history
    if history is None or not np.isfinite(history.ttc_s).any():
        return None
    row = int(np.nanargmin(history.ttc_s))
    return round(float(history.time_s[row]), 2), round(float(history.ttc_s[row]), 2)


def each_done(
    jobs: Iterator[Job], work: Callable[[Job], Outcome], executor: Executor, at_once: int
) -> Generator[tuple[Job, Outcome | Exception], None, None]:
    """Hand out jobs and tell of each as it is done; a failure does not stop the others.

    Where this is left early, as by Ctrl-C, what was not begun is given up, and the executor ends the rest.

    Parameters
    ----------
    jobs : iterator of Job
    work : callable
        Runs a job; it is pickled where the executor uses other processes.
    executor : Executor
        Is shut down in the end.
    at_once : int
        Most jobs that are handed out and not yet done.
    """
    handed: dict[Future[Outcome], Job] = {}
    with executor:
        try:
            while True:
                while len(handed) < at_once and (job := next(jobs, None)) is not None:
                    handed[executor.submit(work, job)] = job
                if not handed:
                    return
                for future in wait(handed, return_when=FIRST_COMPLETED).done:
                    yield handed.pop(future), _value(future)
        except BaseException:
            for future in handed:
                future.cancel()
            raise


def _value(future: Future[Outcome]) -> Outcome | Exception:
    try:
        return future.result()
    except BrokenProcessPool:
        return IfsVideoError("a worker was killed, perhaps for its memory; run again with fewer --jobs")
    except Exception as error:
        return error


def local_executor(workers: int) -> Executor:
    """Processes of this machine; with one worker, this process itself."""
    return _Here() if workers == 1 else _Workers(workers)


class _Here(Executor):
    """Runs what is submitted at once."""

    def submit(self, function: Callable[..., _Value], /, *arguments: Any, **named: Any) -> Future[_Value]:
        future: Future[_Value] = Future()
        try:
            future.set_result(function(*arguments, **named))
        except Exception as error:
            future.set_exception(error)
        return future


class _Workers(ProcessPoolExecutor):
    """Processes that end cleanly with their parent, however it ends."""

    def __init__(self, workers: int) -> None:
        threads = max(1, (os.cpu_count() or 1) // workers)
        super().__init__(workers, get_context("spawn"), _begin, (threads,))

    def submit(self, function: Callable[..., _Value], /, *arguments: Any, **named: Any) -> Future[_Value]:
        # A new worker inherits the mask: Ctrl-C in the terminal reaches this process alone, which decides.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            return super().submit(_supervised, function, *arguments, **named)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is not None:
            for child in active_children():
                child.terminate()
        super().__exit__(kind, error, trace)


class _Stopped(BaseException):
    """A worker is asked to end; not an Exception, so that nothing on the way takes it for a failure."""


_busy = False


def _begin(threads: int) -> None:
    """First thing in a worker."""
    cv2.setNumThreads(threads)
    signal.signal(signal.SIGTERM, _stop)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _stop(number: int, frame: FrameType | None) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # a second one must not cut the cleaning up short
    if not _busy:
        os._exit(128 + number)
    raise _Stopped


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os.kill(os.getpid(), signal.SIGTERM)


def _supervised(function: Callable[..., _Value], *arguments: Any, **named: Any) -> _Value:
    global _busy
    _busy = True
    try:
        return function(*arguments, **named)
    except _Stopped:
        kill_all()  # those whose contexts were not entered yet
        os._exit(128 + signal.SIGTERM)  # all is cleaned up, and there may be no parent left to ask for more
    finally:
        _busy = False
