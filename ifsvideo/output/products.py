"""What a run writes beside overlay and labels: one optional place for each, and the sink that fills them."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from ifsvideo.errors import UsageError
from ifsvideo.objects.history import Event, ObjectHistory
from ifsvideo.output import event_clips, masks
from ifsvideo.output.atomic import Outputs, check_folder, check_writable
from ifsvideo.output.event_clips import write_clips
from ifsvideo.output.masks import MaskSink
from ifsvideo.output.object_tables import write_mot, write_objects
from ifsvideo.output.summary_json import summary_document, write_summary
from ifsvideo.output.tracks_npz import TracksSink
from ifsvideo.report import ReportSink, video_beside
from ifsvideo.types import Image, Result, Scene, Sink, VideoInfo
from ifsvideo.video.sound import SoundSource

ENDINGS = {"objects": ".csv", "mot": ".txt", "summary": ".json", "tracks": ".npz", "report": ".html"}
"""How the files end."""
BESIDE = {
    "objects": ".objects.csv",
    "mot": ".mot.txt",
    "summary": ".json",
    "tracks": ".tracks.npz",
    "report": ".html",
    "masks": ".masks",
    "clips": ".clips",
}
"""What stands behind the overlay's name, in place of its ending, where nobody says where an output goes."""
FOLDERS = {"masks": masks.OWN_FILES, "clips": event_clips.OWN_FILES}
"""Pattern of what an earlier run wrote into the folders."""


@dataclass(frozen=True)
class Products:
    """Places of further outputs; what is None is not written.

    Attributes
    ----------
    objects : CSV with a row for every object and frame (`ifsvideo.objects.history.ObjectTable`).
    mot : the objects' boxes as MOTChallenge rows (.txt).
    summary : JSON with input, settings, versions, timings, objects, events and warnings.
    masks : folder of indexed PNGs, one a frame.
    tracks : NumPy archive (.npz) with every track, which `Pipeline` takes as input again.
    clips : folder of the seconds round each event, cut out of the video.
    report : page with video, timeline, table of objects and plots (.html); a large video stands beside it.
    """

    objects: Path | None = None
    mot: Path | None = None
    summary: Path | None = None
    masks: Path | None = None
    tracks: Path | None = None
    clips: Path | None = None
    report: Path | None = None

    def __post_init__(self) -> None:
        for name, path in self.named():  # a caller without a type checker may give strings
            object.__setattr__(self, name, path)

    def named(self) -> Iterator[tuple[str, Path]]:
        """Name and place of what is to be written."""
        for item in fields(self):
            path = getattr(self, item.name)
            if path is not None:
                yield item.name, Path(path)

    def check(self, taken: Mapping[str, Path]) -> None:
        """Refuse places before any work is done.

        Parameters
        ----------
        taken : mapping of what it is, for people ("the input itself"), to a place that must stay free.

        Raises
        ------
        UsageError
            If two outputs have one place, an output is the input, or an ending is unknown.
        OutputError
            If it cannot be written.
        """
        places = dict(taken)
        wanted = list(self.named())
        if self.report:
            wanted.append(("report's video", video_beside(Path(self.report))))
        for name, path in wanted:
            ending = ENDINGS.get(name)
            if ending is not None and path.suffix.lower() != ending:
                raise UsageError(f"{path}: unknown ending {path.suffix!r}; the {name} go to a {ending} file")
            for what, other in places.items():
                if same_place(path, other):
                    raise UsageError(f"{path}: is {what}; name another place for the {name}")
            places[f"the {name} too"] = path
            if name in FOLDERS:
                check_folder(path, FOLDERS[name])
            else:
                check_writable(path)


def same_place(one: Path, other: Path) -> bool:
    """Whether two paths name one file or folder, also by another name of it."""
    if one.exists() and other.exists():
        return os.path.samefile(one, other)
    return os.path.realpath(one) == os.path.realpath(other)


class ProductsSink:
    """Fills the places (a `Sink`); what is told of whole objects follows when the last frame was seen.

    Parameters
    ----------
    products : Products
    info : VideoInfo
    source : Path or None
        The input, where it was read from disk; clips are cut out of it.
    outputs : Outputs
        Group with which all of it is placed.
    sound : path or JoinedSound, optional
        Whose sound the page's video has.

    Attributes
    ----------
    history : ObjectHistory
    warnings : tuple of str
        Complete after `finish`.
    """

    def __init__(
        self,
        products: Products,
        info: VideoInfo,
        source: Path | None,
        outputs: Outputs,
        sound: SoundSource | None = None,
    ) -> None:
        self.history = ObjectHistory(info, thumbnails=products.report is not None)
        self._products = products
        self._source = source
        self._outputs = outputs
        self._frames = 0
        self._clip_of: dict[Event, str] = {}
        self._masks = MaskSink(products.masks, info, outputs) if products.masks else None
        tracks = TracksSink(products.tracks, info, outputs) if products.tracks else None
        name = source.resolve().name if source else "Tracks"
        page = products.report
        self._report = ReportSink(page, name, info, self.history, outputs, sound) if page else None
        sinks = (self.history, self._masks, tracks, self._report)
        self._sinks: list[Sink] = [sink for sink in sinks if sink is not None]

    @property
    def wants_image(self) -> bool:
        """See `ifsvideo.types.Sink`."""
        return any(sink.wants_image for sink in self._sinks)

    @property
    def warnings(self) -> tuple[str, ...]:
        """See the class."""
        return tuple(text for sink in (self._masks, self._report) if sink for text in sink.warnings)

    def add(self, scene: Scene, image: Image | None) -> None:
        """See `ifsvideo.types.Sink`."""
        self._frames += 1
        for sink in self._sinks:
            sink.add(scene, image)

    def finish(self) -> None:
        """See `ifsvideo.types.Sink`."""
        for sink in self._sinks:
            sink.finish()
        places, table = self._products, self.history.table
        if places.objects:
            write_objects(places.objects, table, self._outputs)
        if places.mot:
            write_mot(places.mot, table, self._outputs)
        if places.clips and self._source:
            self._clip_of = write_clips(places.clips, self._source, self.history.events, self._outputs)

    def described(self, result: Result) -> Result:
        """The result with what was found out of the objects, and where it was written."""
        places = tuple(path for _, path in self._products.named())
        if not places:
            return result
        if self._report and self._report.beside:
            places += (self._report.beside,)
        return replace(result, events=self.history.events, history=self.history.table, further=places)

    def summarise(self, result: Result, settings: Mapping[str, Any]) -> None:
        """Write the summary, where one is wanted; the last of all, as it tells of the others.

        Parameters
        ----------
        result : Result
        settings : mapping
            What the run was told, by name; anything that is no JSON is written as its text.

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        places = self._products
        if places.summary is None:
            return
        written = {"overlay": result.output, "labels": result.labels, **dict(places.named())}
        document = summary_document(
            result, self._source, self._frames, self.history, self._clip_of, settings, written
        )
        write_summary(places.summary, document, self._outputs)
