"""The command ``ifsvideo``: the only place that prints, shows progress or exits."""

from __future__ import annotations

import os
import signal
import sys
import time
import traceback
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from types import FrameType
from typing import Any

from tqdm import tqdm

from ifsvideo.arguments import Arguments, Job, parse
from ifsvideo.errors import IfsVideoError
from ifsvideo.pipeline import Pipeline
from ifsvideo.summary import summary

_DONE, _FAULT, _SOME_FAILED = 0, 1, 5


class _Interrupted(BaseException):
    """A signal asks to end; not an Exception, so that nothing on the way takes it for a failure."""

    def __init__(self, number: int) -> None:
        self.exit_status = 128 + number


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit status.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments without the command's name; those of the process by default.
    """
    argv = sys.argv[1:] if argv is None else argv
    debug = "--debug" in argv
    if not debug:
        warnings.simplefilter("ignore")  # NumPy's and others': meant for developers, and --quiet is quiet
    try:
        with _signals_raise(), _flushed():
            return _run(parse(argv), debug)
    except _Interrupted as interrupted:
        return interrupted.exit_status
    except BrokenPipeError:
        # Whoever read our summary has left; Python's own flush at exit must not complain of it.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return _DONE
    except Exception as error:
        return _report(error, debug)


def _run(arguments: Arguments, debug: bool) -> int:
    pipeline = Pipeline(arguments.config)
    if len(arguments.jobs) == 1:
        _process(pipeline, arguments.jobs[0], arguments)
        return _DONE
    failed = False
    for job in arguments.jobs:
        try:
            _process(pipeline, job, arguments)
        except BrokenPipeError:
            raise
        except Exception as error:
            _report(error, debug)
            failed = True
    return _SOME_FAILED if failed else _DONE


def _process(pipeline: Pipeline, job: Job, arguments: Arguments) -> None:
    begun = time.perf_counter()
    with _Bar(arguments.quiet) as bar:
        result = pipeline.run(
            job.source,
            job.output,
            job.labels,
            fps=arguments.fps,
            start=arguments.start,
            end=arguments.end,
            ignore=arguments.ignore,
            motions=arguments.motions,
            products=job.products,
            keep_table=False,
            progress=bar.show,
        )
    if not arguments.quiet:
        print(summary(str(job.source), result, time.perf_counter() - begun), flush=True)


def _report(error: Exception, debug: bool) -> int:
    """One line about an error, to stderr; returns the exit status."""
    if debug:
        traceback.print_exception(error)
    if isinstance(error, IfsVideoError):
        message, status = str(error), error.exit_status
    else:
        kind = type(error).__name__
        hint = "" if debug else "; run again with --debug and report what it prints"
        message, status = f"a fault of the program ({kind}: {error}){hint}", _FAULT
    print("ifsvideo: error:", " ".join(message.split()), file=sys.stderr)
    return status


class _Bar:
    """A progress bar on stderr."""

    def __init__(self, quiet: bool) -> None:
        self._quiet = quiet
        self._bar: tqdm[Any] | None = None

    def show(self, stage: str, done: int, total: int | None) -> None:
        """A `ifsvideo.types.Progress`."""
        if self._quiet:
            return
        if self._bar is None:
            self._bar = tqdm(unit="frame", file=sys.stderr, dynamic_ncols=True)
        self._bar.total = total
        self._bar.update(done - self._bar.n)

    def __enter__(self) -> _Bar:
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.close()


@contextmanager
def _flushed() -> Iterator[None]:
    """Let a broken pipe show here and not at Python's exit, where it cannot be caught."""
    try:
        yield
    finally:
        sys.stdout.flush()


@contextmanager
def _signals_raise() -> Iterator[None]:
    """Let SIGINT and SIGTERM raise, so that children end and unfinished files go on the way out."""

    def interrupt(number: int, frame: FrameType | None) -> None:
        # A second signal must not cut the cleaning up short.
        for each in numbers:
            signal.signal(each, signal.SIG_IGN)
        raise _Interrupted(number)

    numbers = (signal.SIGINT, signal.SIGTERM)
    before = {each: signal.signal(each, interrupt) for each in numbers}
    try:
        yield
    except _Interrupted:
        before.clear()  # the process is about to end: further signals stay ignored until it has
        raise
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)
