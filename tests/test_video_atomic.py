"""Outputs appear complete or not at all, and several of them together."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from ifsvideo.errors import OutputError
from ifsvideo.output.atomic import Outputs, replacing


def contents(folder: Path) -> dict[str, str]:
    """Names and texts of all files of a folder, hidden ones too."""
    return {file.name: file.read_text() for file in folder.iterdir()}


def test_the_file_appears_when_the_block_ends(tmp_path: Path) -> None:
    target = tmp_path / "a.csv"
    with replacing(target) as temporary:
        temporary.write_text("new")
        assert not target.exists()
        assert temporary.parent == tmp_path
        assert temporary.suffix == ".csv"
        assert temporary.name.startswith(".")
    assert contents(tmp_path) == {"a.csv": "new"}


def fail(target: Path, error: BaseException) -> None:
    """Write half a file, then fail."""
    with replacing(target) as temporary:
        temporary.write_text("half")
        raise error


@pytest.mark.parametrize("error", [ValueError(), KeyboardInterrupt(), SystemExit(), GeneratorExit()])
def test_a_failure_leaves_what_was_there(tmp_path: Path, error: BaseException) -> None:
    (tmp_path / "old.csv").write_text("old")
    for name in ("old.csv", "new.csv"):
        with pytest.raises(type(error)):
            fail(tmp_path / name, error)
    assert contents(tmp_path) == {"old.csv": "old"}


def place(*targets: Path) -> None:
    """Write several files as one group."""
    with Outputs() as outputs:
        for target in targets:
            outputs.add(target).write_text("new")


def test_a_group_is_placed_together(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("old")
    place(tmp_path / "a", tmp_path / "b")
    assert contents(tmp_path) == {"a": "new", "b": "new"}


@pytest.mark.parametrize("links", [True, False])
@pytest.mark.parametrize("error", [PermissionError(13, "Permission denied"), KeyboardInterrupt()])
def test_if_the_last_of_a_group_cannot_be_placed_none_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: BaseException, links: bool
) -> None:
    (tmp_path / "a").write_text("old a")
    (tmp_path / "c").write_text("old c")
    move, failures = os.replace, [error]

    def replace(source: Path, target: Path) -> None:
        if target.name == "c" and failures:
            raise failures.pop()
        move(source, target)

    def no_link(source: Path, target: Path) -> None:
        raise OSError(95, "Operation not supported")

    monkeypatch.setattr(os, "replace", replace)
    if not links:
        monkeypatch.setattr(os, "link", no_link)
    expected = OutputError if isinstance(error, OSError) else type(error)
    with pytest.raises(expected):
        place(tmp_path / "a", tmp_path / "b", tmp_path / "c")
    assert contents(tmp_path) == {"a": "old a", "c": "old c"}


def test_a_link_stays_and_its_file_is_replaced(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    file, link = tmp_path / "real" / "a.csv", tmp_path / "link.csv"
    file.write_text("old")
    link.symlink_to(file)
    place(link)
    assert link.is_symlink()
    assert file.read_text() == "new"
    assert os.listdir(tmp_path / "real") == ["a.csv"]


def test_the_mode_is_that_of_a_new_file_or_of_the_old_one(tmp_path: Path) -> None:
    previous = os.umask(0o027)
    try:
        place(tmp_path / "new")
        (tmp_path / "old").touch()
        (tmp_path / "old").chmod(0o604)
        place(tmp_path / "old")
    finally:
        os.umask(previous)
    assert stat.S_IMODE((tmp_path / "new").stat().st_mode) == 0o640
    assert stat.S_IMODE((tmp_path / "old").stat().st_mode) == 0o604


UNPRIVILEGED = """
import os, sys
from pathlib import Path
from ifsvideo.errors import OutputError
from ifsvideo.output.atomic import check_writable
if os.getuid() == 0:
    os.setuid(65534)
for name in sys.argv[1:]:
    try:
        check_writable(Path(name))
    except OutputError as error:
        print(error)
"""


def test_missing_permissions_are_told(tmp_path: Path) -> None:
    for folder in (tmp_path, tmp_path.parent, tmp_path.parent.parent):
        folder.chmod(0o755)
    locked, open_folder = tmp_path / "locked", tmp_path / "open"
    for folder, mode in ((locked, 0o555), (open_folder, 0o777)):
        folder.mkdir()
        folder.chmod(mode)
    (open_folder / "protected.csv").touch()
    (open_folder / "protected.csv").chmod(0o444)
    names = [str(locked / "a.csv"), str(open_folder / "protected.csv"), str(open_folder / "fine.csv")]
    done = subprocess.run(
        [sys.executable, "-c", UNPRIVILEGED, *names], capture_output=True, text=True, check=True
    )
    first, second = done.stdout.splitlines()
    assert first.startswith(names[0])
    assert "no permission to write" in first
    assert second.startswith(names[1])
    assert "write-protected" in second


def test_a_long_name_is_no_trouble(tmp_path: Path) -> None:
    name = "n" * 250 + ".csv"
    place(tmp_path / name)
    assert contents(tmp_path) == {name: "new"}
