"""The ffmpeg that imageio-ffmpeg brings, as a child that never outlives its purpose.

imageio-ffmpeg's own reader and writer are not used: the reader lets ffmpeg repeat and drop frames, tells the
rate in two decimals and leaves a killed child unreaped; the writer has no atomic output and no exact rate.
"""

from __future__ import annotations

import subprocess
import threading
import weakref
from collections import deque
from collections.abc import Sequence
from concurrent.futures import Future
from contextlib import suppress
from io import BufferedReader
from pathlib import Path
from types import TracebackType
from typing import IO, Self

import imageio_ffmpeg

from ifsvideo.errors import IfsVideoError

_KEPT_LINES = 1000
"""Last lines kept of a child that may complain about every frame; a header has some dozens."""


def executable() -> str:
    """Path of the ffmpeg binary (``IMAGEIO_FFMPEG_EXE`` overrides the bundled one).

    Raises
    ------
    IfsVideoError
        If there is none for this platform.
    """
    try:
        return str(imageio_ffmpeg.get_ffmpeg_exe())
    except RuntimeError:
        raise IfsVideoError("no ffmpeg found; reinstall imageio-ffmpeg or set IMAGEIO_FFMPEG_EXE") from None


def file_url(path: Path) -> str:
    """The path as ffmpeg takes it literally: no protocol, no option, no pattern in it."""
    return f"file:{path.absolute()}"


class Ffmpeg:
    """A running ffmpeg; leaving the context kills it if it still runs, and reaps it in any case.

    Parameters
    ----------
    arguments : sequence of str
        What follows ``ffmpeg -hide_banner -nostdin``.
    feeds : bool
        True if the child reads ``stdin`` from us, False if we read its ``stdout``.
    stdin : binary file, optional
        What the child reads where we do not feed it.
    """

    def __init__(
        self, arguments: Sequence[str], *, feeds: bool = False, stdin: IO[bytes] | None = None
    ) -> None:
        command = [executable(), "-hide_banner", *([] if feeds or stdin else ["-nostdin"]), *arguments]
        stdin_of = subprocess.PIPE if feeds else stdin or subprocess.DEVNULL
        self._process = _start(command, stdin_of, subprocess.DEVNULL if feeds else subprocess.PIPE)
        _running.add(self)
        self._lines: deque[str] = deque(maxlen=_KEPT_LINES)
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()
        # Also where Python ends before the context does: it must not find a thread that reads from a child.
        self._end = weakref.finalize(self, _end, self._process, self._listener)

    def _listen(self) -> None:
        assert self._process.stderr is not None
        for line in self._process.stderr:
            text = line.decode("utf-8", "replace").strip()
            if text:
                self._lines.append(text)

    @property
    def stdin(self) -> IO[bytes]:
        """What the child reads."""
        assert self._process.stdin is not None
        return self._process.stdin

    @property
    def stdout(self) -> BufferedReader:
        """What the child writes."""
        assert isinstance(self._process.stdout, BufferedReader)
        return self._process.stdout

    @property
    def pid(self) -> int:
        """Process id of the child."""
        return self._process.pid

    def wait(self) -> int:
        """Exit status of the child, once it has ended by itself; negative: the signal that killed it."""
        status = self._process.wait()
        self._listener.join()
        return status

    def printed(self) -> list[str]:
        """The last lines that the child wrote to stderr; complete after `wait` or `stop`."""
        return list(self._lines)

    def kill(self) -> None:
        """Kill the child, whoever waits for it; it is reaped as its context is left."""
        self._process.kill()

    def stop(self) -> None:
        """Kill the child if it still runs, reap it, close the pipes."""
        self._end()
        for pipe in (self._process.stdin, self._process.stdout, self._process.stderr):
            if pipe is not None:
                with suppress(BrokenPipeError):  # what was still buffered for a dead child is lost
                    pipe.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()


_running: weakref.WeakSet[Ffmpeg] = weakref.WeakSet()


def kill_all() -> None:
    """Kill all children: before a process ends at once, whose pipes would tell them to end their files."""
    for child in list(_running):
        child.kill()


def _start(command: list[str], stdin: int | IO[bytes], stdout: int) -> subprocess.Popen[bytes]:
    """Start a child in a thread: a signal's exception, which strikes the main one, then never strikes between
    the child's beginning and our knowing of it, whose file would appear when all is cleaned up."""
    begun: Future[subprocess.Popen[bytes]] = Future()

    def start() -> None:
        try:
            # A session of its own: Ctrl-C in the terminal reaches Python alone, which decides.
            begun.set_result(
                subprocess.Popen(
                    command, stdin=stdin, stdout=stdout, stderr=subprocess.PIPE, start_new_session=True
                )
            )
        except BaseException as error:
            begun.set_exception(error)

    starter = threading.Thread(target=start)
    try:
        starter.start()
        return begun.result()
    except BaseException:
        if starter.ident is not None:
            starter.join()
            if begun.exception() is None:
                begun.result().kill()
                begun.result().wait()
        raise


def _end(process: subprocess.Popen[bytes], listener: threading.Thread) -> None:
    if process.poll() is None:
        process.kill()
    process.wait()
    listener.join()


def run(arguments: Sequence[str]) -> tuple[int, str, list[str]]:
    """Run ffmpeg to its end.

    Returns
    -------
    status : int
        Exit status.
    output : str
        What it wrote to stdout.
    complaints : list of str
        The last lines of stderr.
    """
    with Ffmpeg(arguments) as child:
        output = child.stdout.read().decode("utf-8", "replace")
        status = child.wait()
        return status, output, child.printed()
