"""The command ``ifsvideo``: the only place that prints, shows progress or exits."""

from __future__ import annotations

import os
import signal
import sys
import traceback
import warnings
from collections.abc import Generator, Iterator, Sequence
from contextlib import closing, contextmanager
from functools import partial
from types import FrameType
from typing import Any, TextIO

from tqdm import tqdm

from ifsvideo.arguments import Arguments, Job, parse
from ifsvideo.batch import Outcome, each_done, local_executor, perform
from ifsvideo.errors import IfsVideoError
from ifsvideo.ledger import Ledger

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
        with _signals_raise():
            return _run(_parsed(argv), debug)
    except _Interrupted as interrupted:
        with _while_read(sys.stderr):
            print("ifsvideo: interrupted", file=sys.stderr)
        return interrupted.exit_status
    except Exception as error:
        return _report(error, debug)


def _parsed(argv: Sequence[str]) -> Arguments:
    """The arguments; the help, which ends the process, may have no reader."""
    with _while_read(sys.stdout):
        try:
            return parse(argv)
        finally:
            sys.stdout.flush()
    raise SystemExit(_DONE)


def _run(told: Arguments, debug: bool) -> int:
    if len(told.jobs) == 1 and told.folder is None:
        _process(told.jobs[0], told)
        return _DONE
    ledger = Ledger(told.folder) if told.folder is not None else None
    failures = []
    with closing(_outcomes(told, ledger)) as outcomes:
        for job, outcome in outcomes:
            if ledger is not None:
                ledger.note(job, told, outcome)
            if isinstance(outcome, Exception):
                failures.append(outcome)
            elif not told.quiet:
                _say(outcome.text)
    if ledger is not None:
        ledger.write()
        if not told.quiet:
            _say(f"{ledger.page}: all results")
    for failure in failures:
        _report(failure, debug)
    if failures:
        _complain(f"{len(failures)} of {len(told.jobs)} inputs failed")
    return _SOME_FAILED if failures else _DONE


def _outcomes(
    told: Arguments, ledger: Ledger | None
) -> Generator[tuple[Job, Outcome | Exception], None, None]:
    """What became of each input that is not done already, as they are done."""
    jobs = [job for job in told.jobs if ledger is None or not ledger.complete(job, told)]
    if not told.quiet and len(jobs) < len(told.jobs):
        _say(f"{len(told.jobs) - len(jobs)} of {len(told.jobs)} inputs are done already, and unchanged")
    if told.workers == 1:
        yield from each_done(iter(jobs), lambda job: _with_bar(job, told), local_executor(1), 1)
        return
    work = partial(perform, told=told)
    workers = local_executor(told.workers)
    with (
        tqdm(total=len(jobs), unit="clip", file=sys.stderr, disable=told.quiet, dynamic_ncols=True) as bar,
        closing(each_done(iter(jobs), work, workers, told.workers)) as outcomes,
    ):
        for job, outcome in outcomes:
            with _while_read(sys.stderr):
                bar.update()
            with bar.external_write_mode(sys.stderr):
                yield job, outcome


def _process(job: Job, told: Arguments) -> None:
    outcome = _with_bar(job, told)
    if not told.quiet:
        _say(outcome.text)


def _with_bar(job: Job, told: Arguments) -> Outcome:
    with _Bar(told.quiet) as bar:
        return perform(job, told, bar.show)


def _say(text: str) -> None:
    with _while_read(sys.stdout):
        print(text, flush=True)


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
    _complain(message)
    return status


def _complain(message: str) -> None:
    with _while_read(sys.stderr):
        print("ifsvideo: error:", " ".join(message.split()), file=sys.stderr)


class _Bar:
    """A progress bar on stderr."""

    def __init__(self, quiet: bool) -> None:
        self._quiet = quiet
        self._bar: tqdm[Any] | None = None

    def show(self, stage: str, done: int, total: int | None) -> None:
        """A `ifsvideo.types.Progress`."""
        if self._quiet:
            return
        with _while_read(sys.stderr):
            if self._bar is None:
                self._bar = tqdm(unit="frame", file=sys.stderr, dynamic_ncols=True)
            self._bar.total = total
            self._bar.update(done - self._bar.n)

    def __enter__(self) -> _Bar:
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            with _while_read(sys.stderr):
                self._bar.close()


@contextmanager
def _while_read(stream: TextIO) -> Iterator[None]:
    """Whoever reads what we print may leave: that is no fault, and the work goes on unseen."""
    try:
        yield
    except BrokenPipeError:
        # What is printed from now on, at the latest by Python's own flush at exit, must not complain of it.
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


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
