"""Outputs that appear complete or not at all.

Every output is written under a hidden name beside its place (so on the same disk) and moved there when
complete. Several outputs of one run are placed together: if one cannot be, none is, and what stood there
before stands there again.
"""

from __future__ import annotations

import os
import re
import secrets
import shutil
import stat
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import Self, TypeVar

from ifsvideo.errors import OutputError

_Context = TypeVar("_Context")


def check_writable(target: Path) -> None:
    """Refuse a place where no file can be written, before any work is done.

    Raises
    ------
    OutputError
        If the folder is missing or not writable, or if the target is a folder, a device or a protected file.
    """
    folder = target.parent
    if target.is_dir():
        raise OutputError(f"{target}: is a folder; name a file in it")
    if not folder.is_dir():
        raise OutputError(f"{target}: the folder {folder} does not exist; create it first")
    if target.exists() and not target.is_file():
        raise OutputError(f"{target}: is not a regular file; name another output")
    real_folder = _real(target).parent
    if not os.access(real_folder, os.W_OK | os.X_OK):
        raise OutputError(f"{target}: no permission to write in {real_folder}; name another folder")
    if target.exists() and not os.access(target, os.W_OK):
        raise OutputError(f"{target}: exists and is write-protected; name another output or allow writing")


def check_folder(target: Path, own: str) -> None:
    """Refuse a place where no folder can be written, before any work is done.

    A folder that stands there is replaced, so it must hold nothing but what an earlier run wrote.

    Parameters
    ----------
    target : Path
    own : str
        Pattern that the whole name of every such file matches.

    Raises
    ------
    OutputError
        If it holds something else, or no folder can be made there.
    """
    if target.exists() and not target.is_dir():
        raise OutputError(f"{target}: is a file; name a folder")
    folder = _real(target).parent
    if not folder.is_dir():
        raise OutputError(f"{target}: the folder {target.parent} does not exist; create it first")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise OutputError(f"{target}: no permission to write in {folder}; name another folder")
    try:
        names = sorted(os.listdir(target)) if target.exists() else []
    except OSError as error:
        raise output_error(target, error) from None
    foreign = next((name for name in names if not re.fullmatch(own, name)), None)
    if foreign is not None:
        raise OutputError(f"{target}: holds {foreign}, which would be lost; name a new folder, or empty it")


def output_error(target: Path, error: OSError) -> OutputError:
    """The one line for a system error met while writing ``target``."""
    reason = error.strerror or str(error)
    return OutputError(f"{target}: cannot be written ({reason}); free space or name another place")


class Outputs:
    """Files being written, placed together when the context ends well and removed when it does not.

    Examples
    --------
    ::

        with Outputs() as outputs:
            video = outputs.add(Path("out.mp4"))  # write to these two ...
            table = outputs.add(Path("out.csv"))
        # ... and from here on both stand in their places
    """

    def __init__(self) -> None:
        self._staged: list[tuple[Path, Path]] = []
        self._scratch: list[Path] = []
        self._open = ExitStack()

    def add(self, target: Path) -> Path:
        """Name of an empty hidden file, with the target's ending, to be written in its stead.

        A symbolic link is followed: the file it names is replaced, the link stays. The mode is that of the
        file replaced, or of any new file (umask).

        Raises
        ------
        OutputError
            If `check_writable` refuses the target or the file cannot be created.
        """
        check_writable(target)
        real = _real(target)
        temporary = _hidden(real)
        self._staged.append((temporary, real))  # before it exists: an interruption must not strand it
        try:
            os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
            if real.exists():
                os.chmod(temporary, stat.S_IMODE(real.stat().st_mode))
        except OSError as error:
            raise output_error(target, error) from None
        return temporary

    def add_folder(self, target: Path) -> Path:
        """Name of an empty hidden folder, to be filled in the target's stead.

        What stands there is replaced whole; `check_folder` tells whether nothing is lost by it.

        Raises
        ------
        OutputError
            If the folder cannot be created.
        """
        real = _real(target)
        temporary = _hidden(real)
        self._staged.append((temporary, real))
        try:
            temporary.mkdir()
        except OSError as error:
            raise output_error(target, error) from None
        return temporary

    def add_scratch(self, beside: Path) -> Path:
        """Name of a hidden file on the same disk, not yet there, that is removed in the end."""
        self._scratch.append(_hidden(beside))
        return self._scratch[-1]

    def enter(self, context: AbstractContextManager[_Context]) -> _Context:
        """Enter the context of something that writes a file of this group.

        It is left, with the failure if there is one, before any file is placed or removed.
        """
        return self._open.enter_context(context)

    def text(self, target: Path) -> TextFile:
        """An output of ASCII text, open for writing, and closed with the group."""
        return self.enter(TextFile(target, self.add(target)))

    def commit(self) -> None:
        """Move every file to its place; if one cannot be moved, undo the others.

        Raises
        ------
        OutputError
            If a file cannot be moved.
        """
        placing: list[tuple[Path, Path, Path]] = []
        try:
            for temporary, real in self._staged:
                placing.append((temporary, real, _hidden(real)))
                if real.exists() and (len(self._staged) > 1 or real.is_dir()):
                    _keep_old(real, placing[-1][2])
                os.replace(temporary, real)
        except BaseException as error:
            for temporary, real, backup in reversed(placing):
                _undo(real, backup, placed=not temporary.exists())
            if isinstance(error, OSError):
                raise output_error(placing[-1][1], error) from None
            raise
        for _, _, backup in placing:
            _remove(backup)
        self._staged.clear()

    def discard(self) -> None:
        """Remove what was written and not placed; the targets are untouched."""
        for temporary in [*(file for file, _ in self._staged), *self._scratch]:
            with suppress(OSError):
                _remove(temporary)
        self._staged.clear()
        self._scratch.clear()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self._open.__exit__(kind, error, trace)
            if kind is None:
                self.commit()
        finally:
            self.discard()


class TextFile:
    """A text file being written; what the system refuses becomes the one line about its target.

    Parameters
    ----------
    target : Path
        Named in messages.
    unfinished : Path
        Where it is written.
    """

    def __init__(self, target: Path, unfinished: Path) -> None:
        self._target = target
        self._file = unfinished.open("w", encoding="ascii", newline="")

    def write(self, text: str) -> None:
        """Append text.

        Raises
        ------
        OutputError
            If it cannot be written, as on a full disk.
        """
        try:
            self._file.write(text)
        except OSError as error:
            raise output_error(self._target, error) from None

    def close(self) -> None:
        """Write what is still buffered, and close.

        Raises
        ------
        OutputError
            As `write`.
        """
        try:
            self._file.close()
        except OSError as error:
            raise output_error(self._target, error) from None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self.close()
        else:
            with suppress(OSError):  # after a failure the file goes anyway
                self._file.close()


@contextmanager
def replacing(target: Path) -> Iterator[Path]:
    """One output: yields the file to write, which takes the target's place if the block ends well."""
    with Outputs() as outputs:
        yield outputs.add(target)


def _real(target: Path) -> Path:
    return Path(os.path.realpath(target))


def _hidden(real: Path) -> Path:
    return real.with_name(f".ifsvideo-{secrets.token_hex(6)}{real.suffix}")


def _remove(path: Path) -> None:
    """Remove a file or a folder, if it is there."""
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def _keep_old(real: Path, backup: Path) -> None:
    """Give the file that stands at ``real`` a second name; a folder, another."""
    try:
        os.link(real, backup)
    except OSError:  # a folder, or a file system without hard links
        os.rename(real, backup)


def _undo(real: Path, backup: Path, *, placed: bool) -> None:
    """Put back what stood at ``real``: the file kept as ``backup``, or nothing."""
    with suppress(OSError):
        if real.is_dir() and placed:
            shutil.rmtree(real)
        if backup.exists():
            os.replace(backup, real)
            backup.unlink(missing_ok=True)  # replace() does nothing where both names are one file
        elif placed:
            real.unlink(missing_ok=True)
