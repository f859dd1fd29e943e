"""What else a run writes beside overlay and labels: one optional place for each."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, fields
from pathlib import Path

from ifsvideo.errors import UsageError
from ifsvideo.output.atomic import check_writable

ENDINGS = {
    "objects": (".csv",),
    "mot": (".txt",),
    "summary": (".json",),
    "tracks": (".npz",),
}
"""How the files may end; what is not named here is a folder."""


@dataclass(frozen=True)
class Products:
    """Places of further outputs; what is None is not written.

    Attributes
    ----------
    objects : CSV with a row for every object and frame (`ifsvideo.output.objects_csv`).
    mot : the objects' boxes as MOTChallenge rows (.txt).
    summary : JSON with input, settings, versions, timings, objects, events and warnings.
    masks : folder of indexed PNGs, one a frame.
    tracks : NumPy archive (.npz) with every track, which the command takes as input again.
    clips : folder of the seconds round each event, cut out of the input.
    """

    objects: Path | None = None
    mot: Path | None = None
    summary: Path | None = None
    masks: Path | None = None
    tracks: Path | None = None
    clips: Path | None = None

    def named(self) -> Iterator[tuple[str, Path]]:
        """Name and place of what is to be written."""
        for item in fields(self):
            path = getattr(self, item.name)
            if path is not None:
                yield item.name, path

    def check(self, taken: dict[str, Path]) -> None:
        """Refuse places before any work is done.

        Parameters
        ----------
        taken : mapping of a name for people ("the input itself") to a place that must stay free.

        Raises
        ------
        UsageError
            If two outputs have one place, an output is the input, or an ending is unknown.
        OutputError
            If it cannot be written.
        """
        places = dict(taken)
        for name, path in self.named():
            endings = ENDINGS.get(name)
            if endings and path.suffix.lower() not in endings:
                raise UsageError(
                    f"{path}: unknown ending {path.suffix!r}; {name} end in {' or '.join(endings)}"
                )
            for what, other in places.items():
                if same_place(path, other):
                    raise UsageError(f"{path}: is {what}; name another place for the {name}")
            places[f"the {name} too"] = path
            if endings:
                check_writable(path)


def same_place(one: Path, other: Path) -> bool:
    """Whether two paths name one file or folder, also by another name of it."""
    if one.exists() and other.exists():
        return os.path.samefile(one, other)
    return os.path.realpath(one) == os.path.realpath(other)
