"""Functions that are called in a thread, or a process, of their own.

The process is not made by `multiprocessing`: its way of starting one that is safe beside threads imports the
main module again, and a user's script that is not written for this would begin anew in the child.
"""

from __future__ import annotations

import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Future, wait
from contextlib import suppress
from itertools import count
from types import TracebackType
from typing import Any, Generic, Self, TypeVar

from ifsvideo.ahead import POLL_S
from ifsvideo.allocator import give_back
from ifsvideo.errors import IfsVideoError
from ifsvideo.stopwatch import Stopwatch

_Argument = TypeVar("_Argument")
_Value = TypeVar("_Value")
_COMMAND = "from ifsvideo.worker import serve; serve()"
_KEPT = {"MALLOC_TOP_PAD_": str(32 << 20)}
"""Memory that glibc keeps when it is free, bytes: to give it back and take it again with every array of a
megabyte costs the child a twentieth of its time."""
_GIVEN_BACK = 64
"""Calls after which the child gives free memory back all the same: what is kept grows by the holes between
what lasts. Seldom, for what it needs next it must take again."""


class Call(Generic[_Value]):
    """A call that has begun.

    Parameters
    ----------
    future : Future
    watch : Stopwatch
        Counts the time that is spent waiting.
    """

    def __init__(self, future: Future[_Value], watch: Stopwatch) -> None:
        self._future = future
        self._watch = watch

    def done(self) -> bool:
        """Whether the value is there."""
        return self._future.done()

    def value(self) -> _Value:
        """The value, or what the call raised, once it is there; signals are heeded meanwhile.

        A signal that another thread happens to receive does not wake one that waits without end.
        """
        with self._watch.stage("waiting"):
            while not wait([self._future], POLL_S).done:
                continue
        return self._future.result()


class Caller(Generic[_Argument, _Value]):
    """Calls a function of one argument in a thread, one call after the other.

    Leaving the context drops the calls that have not begun, and does not wait for the one that has: a thread
    cannot be stopped, and must not keep the program from ending.

    Parameters
    ----------
    function : callable
    watch : Stopwatch
        Counts the time that someone waits for a call.
    """

    def __init__(self, function: Callable[[_Argument], _Value], watch: Stopwatch) -> None:
        self._function = function
        self._watch = watch
        self._calls: queue.SimpleQueue[tuple[_Argument, Future[_Value]] | None] = queue.SimpleQueue()
        self._left = False
        threading.Thread(target=self._run, daemon=True).start()

    def begin(self, argument: _Argument) -> Call[_Value]:
        """Begin a call, once those before are done."""
        future: Future[_Value] = Future()
        self._calls.put((argument, future))
        return Call(future, self._watch)

    def _run(self) -> None:
        while (call := self._calls.get()) is not None and not self._left:
            argument, future = call
            try:
                future.set_result(self._function(argument))
            except BaseException as error:
                future.set_exception(error)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._left = True
        self._calls.put(None)


class Worker(Generic[_Argument, _Value]):
    """Calls a function of one argument in a child process, which ends with the context or with its parent.

    Parameters
    ----------
    function : callable
        Function, argument and value are pickled.
    purpose : str
        What the child does, for messages.
    keeps_memory : bool
        Whether it keeps tens of megabytes that are free, to be faster; what it starts itself does so, too.
    """

    def __init__(
        self, function: Callable[[_Argument], _Value], purpose: str, keeps_memory: bool = False
    ) -> None:
        self._purpose = purpose
        self._process = subprocess.Popen(
            [sys.executable, "-c", _COMMAND],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={
                **(_KEPT if keeps_memory else {}),
                **os.environ,
                "PYTHONPATH": os.pathsep.join(path or os.getcwd() for path in sys.path),
            },
            start_new_session=True,  # Ctrl-C in the terminal reaches the parent alone, which decides
        )
        with suppress(BrokenPipeError):  # the first call tells of it
            self._send(function)

    @property
    def pid(self) -> int:
        """Process id of the child."""
        return self._process.pid

    def __call__(self, argument: _Argument) -> _Value:
        """Call the function; what it raises is raised here.

        Raises
        ------
        IfsVideoError
            If the child was killed.
        """
        assert self._process.stdout is not None
        try:
            self._send(argument)
            done, value = pickle.load(self._process.stdout)
        except (BrokenPipeError, EOFError, pickle.UnpicklingError):
            raise self._ended() from None
        if not done:
            raise value
        result: _Value = value
        return result

    def _send(self, thing: object) -> None:
        assert self._process.stdin is not None
        pickle.dump(thing, self._process.stdin, protocol=pickle.HIGHEST_PROTOCOL)
        self._process.stdin.flush()

    def _ended(self) -> IfsVideoError:
        status = self._process.wait()
        how = f"was killed (signal {-status})" if status < 0 else f"ended (status {status})"
        return IfsVideoError(
            f"the process that {self._purpose} {how}; run again, with more memory free if it lacks"
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            with suppress(BrokenPipeError):
                pipe.close()


def serve() -> None:
    """The child: take a function, then call it for every argument until there are no more."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    requests = sys.stdin.buffer
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what anyone prints must not get among the answers
    with suppress(EOFError, BrokenPipeError):
        function = pickle.load(requests)
        for call in count(1):
            answer = _answer(function, pickle.load(requests))
            pickle.dump(answer, answers, protocol=pickle.HIGHEST_PROTOCOL)
            answers.flush()
            if call % _GIVEN_BACK == 0:
                give_back()


def _answer(function: Callable[[Any], Any], argument: Any) -> tuple[bool, Any]:
    try:
        return True, function(argument)
    except Exception as error:
        return False, error
