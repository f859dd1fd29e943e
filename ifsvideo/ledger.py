"""A folder of results: what was done in it, by which inputs and settings, and the page that links it all."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ifsvideo import __version__
from ifsvideo.arguments import Arguments, Job
from ifsvideo.batch import Outcome
from ifsvideo.errors import OutputError
from ifsvideo.output.atomic import Outputs, output_error
from ifsvideo.report.index import index_page

PAGE, RECORD = "index.html", "index.json"


class Ledger:
    """What a folder holds, kept in ``index.json`` there, and shown by ``index.html``.

    Parameters
    ----------
    folder : Path
        Made where it is missing.

    Raises
    ------
    OutputError
        If it is no folder, or cannot be made or written in.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        try:
            folder.mkdir(exist_ok=True)
        except OSError as error:
            raise output_error(folder, error) from None
        self._clips = _read(folder / RECORD)

    @property
    def page(self) -> Path:
        """The page that links all results."""
        return self._folder / PAGE

    def complete(self, job: Job, told: Arguments) -> bool:
        """Whether the outputs of a job are there, made of the same input by the same settings and version."""
        entry = self._clips.get(_name(job), {})
        if entry.get("made_of") != _made_of(job, told):
            return False
        wanted = {
            path.name for path in (job.output, job.labels, *dict(job.products.named()).values()) if path
        }
        there = {name for name in entry["files"] if (self._folder / name).exists()}
        return wanted <= there == set(entry["files"])

    def note(self, job: Job, told: Arguments, outcome: Outcome | Exception) -> None:
        """Write down what became of a job.

        Raises
        ------
        OutputError
            If the record or the page cannot be written.
        """
        entry: dict[str, Any] = {"source": str(job.source)}
        if isinstance(outcome, Exception):
            entry["error"] = " ".join(str(outcome).split()) or type(outcome).__name__
        else:
            entry |= {
                "made_of": _made_of(job, told),
                "files": sorted(path.name for path in outcome.written),
                "length_s": round(outcome.length_s, 2),
                "objects": outcome.objects,
                "events": outcome.events,
                "contact": outcome.contact,
            }
        self._clips[_name(job)] = entry
        self.write()

    def write(self) -> None:
        """Write record and page.

        Raises
        ------
        OutputError
            If they cannot be written.
        """
        clips = dict(sorted(self._clips.items()))
        record = {"format": "ifsvideo index", "version": 1, "clips": clips}
        with Outputs() as outputs:
            for name, text in ((RECORD, json.dumps(record, indent=1)), (self.page.name, index_page(clips))):
                unfinished = outputs.add(self._folder / name)
                try:
                    unfinished.write_text(text + "\n", encoding="utf-8")
                except OSError as error:
                    raise output_error(self._folder / name, error) from None


def _read(path: Path) -> dict[str, dict[str, Any]]:
    """The clips of a record; none where there is none yet."""
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
        if record["format"] != "ifsvideo index" or record["version"] != 1:
            raise ValueError("another format")
        clips: dict[str, dict[str, Any]] = record["clips"]
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, KeyError, TypeError):
        raise OutputError(
            f"{path}: is no record of earlier runs; move it away or name another folder"
        ) from None
    return clips


def _name(job: Job) -> str:
    """By what a clip goes in the folder."""
    return job.labels.name.removesuffix(".ifs.csv")


def _made_of(job: Job, told: Arguments) -> str:
    """A mark that differs where the input, the settings or the version do."""
    settings = asdict(told.config)
    stretch = (told.fps, told.start, told.end, told.preview, told.motions)
    files = [_mark(thing) for thing in (job.source, *job.chapters, *told.ignore)]
    whole = [__version__, files, settings, stretch]
    return hashlib.sha256(json.dumps(whole, default=str, sort_keys=True).encode()).hexdigest()[:32]


def _mark(thing: Any) -> Any:
    """A file by its name, size and time of change; a folder by those of its files."""
    if not isinstance(thing, Path):
        return thing
    try:
        if thing.is_dir():
            return [_mark(path) for path in sorted(thing.iterdir()) if path.is_file()]
        status = thing.stat()
    except OSError:
        return thing.name
    return [thing.name, status.st_size, status.st_mtime_ns]
