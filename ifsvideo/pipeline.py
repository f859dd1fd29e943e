"""From a clip to labels and a coloured overlay: read, track, segment and link, check borders, write."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import asdict, replace
from fractions import Fraction
from pathlib import Path
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from ifsvideo.clip import Clip, Source, check_outputs, open_clip
from ifsvideo.config import Config
from ifsvideo.errors import UsageError
from ifsvideo.ignore import Area, ignore_mask
from ifsvideo.objects.figure_ground import FigureGround
from ifsvideo.objects.labelling import label_clip
from ifsvideo.objects.numbering import settle
from ifsvideo.output.atomic import Outputs
from ifsvideo.output.labels import LabelSink
from ifsvideo.output.overlay import OverlayRenderer
from ifsvideo.output.overlay_video import OverlaySink, check_wishes
from ifsvideo.output.products import Products, ProductsSink
from ifsvideo.output.scenes import Scenes
from ifsvideo.output.styles import look_of
from ifsvideo.segmentation.segmenter import IFSSegmenter
from ifsvideo.tracking.tracker import KltTracker
from ifsvideo.tracking.trajectories import Trajectories
from ifsvideo.types import (
    BACKGROUND,
    UNDECIDED,
    Bools,
    FramePoints,
    Image,
    LabelTable,
    MovingObject,
    Progress,
    Renderer,
    Result,
    Segmenter,
    Sink,
    Tracker,
    VideoInfo,
)
from ifsvideo.video import FrameSource

_Item = TypeVar("_Item")


class Pipeline:
    """Reads a clip, tracks points, finds what moves by itself, writes what it found.

    Parameters
    ----------
    config : Config, optional
    tracker, segmenter, renderer : optional
        An object of one's own in place of a part; `ifsvideo.types` tells the one method that each has.

    Examples
    --------
    ::

        result = Pipeline().run("clip.mp4", output="out.mp4", labels="out.csv")
        for item in result.objects:
            print(item.label, item.first_s, item.last_s)
    """

    def __init__(
        self,
        config: Config | None = None,
        *,
        tracker: Tracker | None = None,
        segmenter: Segmenter | None = None,
        renderer: Renderer | None = None,
    ) -> None:
        self.config = config or Config()
        self.tracker: Tracker = tracker or KltTracker(self.config.tracking)
        self.segmenter: Segmenter = segmenter or IFSSegmenter(self.config.segmentation, self.config.seed)
        self.renderer: Renderer = renderer or OverlayRenderer(self.config.overlay)

    def run(
        self,
        source: Source,
        output: str | Path | None = None,
        labels: str | Path | None = None,
        *,
        fps: Fraction | float | None = None,
        start: float = 0.0,
        end: float | None = None,
        ignore: Sequence[Area] = (),
        motions: int | None = None,
        audio: bool = True,
        products: Products | None = None,
        progress: Progress | None = None,
    ) -> Result:
        """Run all stages over one clip; frames are never all held in memory.

        Parameters
        ----------
        source : path, FrameSource, Tracks or array
            A video, a folder of images, a file of tracks (.npz, .mat), or tracks: (F, P, 2) float, pixels,
            NaN where a point is not seen. Of tracks only labels can be written.
        output, labels : path, optional
            Overlay (.mp4, .mov, .mkv, .gif, .webp) and CSV; they appear together when all is done.
        fps : Fraction or float, optional
            Frames per second of a folder or of tracks (10 unless told), or in place of a video's own.
        start, end : float, optional
            Stretch of the input, seconds.
        ignore : sequence of areas, optional
            What is not looked at: rectangles (x, y, width, height), mask images, (H, W) bool arrays.
        motions : int, optional
            Number of motions, the background's included, where it is known.
        audio : bool, optional
            Whether the video keeps the sound.
        products : Products, optional
            Places of further outputs: objects, masks, tracks, clips, a summary.
        progress : callable, optional
            ``progress(stage, done, total)``, called after every step.

        Returns
        -------
        Result

        Raises
        ------
        UsageError, InputError, OutputError
            Then nothing was written, and what stood in the outputs' places is untouched.
        """
        video, csv = (Path(path) if path is not None else None for path in (output, labels))
        if motions is not None and motions < 1:
            raise UsageError(f"motions must be at least 1, got {motions}")
        clip = open_clip(source, _exact(fps), start, end)
        products = products or Products()
        if products.clips is not None and fps is not None:
            raise UsageError("clips are cut by the video's own times; leave out fps, or the clips")
        check_outputs(clip, video, csv, products)
        if video is not None:
            check_wishes(video, self.config.overlay)
        if ignore and clip.frames is None:
            raise UsageError(f"{clip.name}: tracks hold no pictures; leave out ignore")
        mask = ignore_mask(ignore, clip.info)
        log = _Log(progress)
        with Outputs() as outputs:
            trajectories = _ordered(clip.trajectories or self._track(clip.frames, mask, log))
            found = self._label(trajectories, motions, log)
            found = self._check_borders(clip.frames, trajectories, found, log)
            table = LabelTable(
                trajectories.frame, trajectories.ids, trajectories.xy, found, trajectories.frames
            )
            further = ProductsSink(products, clip.info, clip.path, outputs)
            sinks: list[Sink] = [further] if any(products.named()) else []
            if csv is not None:
                sinks.append(LabelSink(csv, outputs))
            if video is not None:
                sound = clip.path if audio and clip.info.has_audio else None
                overlay = OverlaySink(video, clip.info, self.renderer, outputs, sound, self.config.overlay)
                sinks.append(overlay)
            self._feed(sinks, clip, table, log)
            if video is not None:
                log.warnings.extend(overlay.warnings)
            log.warnings.extend(further.warnings)
            log.warnings[:0] = [*(clip.frames.warnings if clip.frames else ()), *_remarks(table)]
            objects = _objects(table, clip.info)
            result = Result(clip.info, table, objects, video, csv, tuple(log.warnings), log.seconds)
            result = further.described(result)
            told = {"motions": motions, "fps": fps, "start": start, "end": end, "ignore": list(ignore)}
            further.summarise(result, {**told, "config": asdict(self.config)})
        return result

    def _track(self, source: FrameSource | None, mask: Bools | None, log: _Log) -> Trajectories:
        assert source is not None, "a clip without trajectories has frames"
        info = source.info
        with log.stage("tracking"), closing(source.frames()) as frames:
            counted = _Counted(frames)
            steps = log.each("tracking", self.tracker.track(counted, mask), info.frames)
            found = Trajectories.collect(steps, (info.width, info.height), float(info.fps))
        if found.frames != counted.count:
            raise ValueError(f"the tracker gave points for {found.frames} of {counted.count} frames")
        return found

    def _label(self, points: Trajectories, motions: int | None, log: _Log) -> NDArray[np.int32]:
        """Label of every row of the trajectories."""
        if not len(points.frame) or points.frames == 1:
            return np.full(len(points.frame), UNDECIDED, dtype=np.int32)
        with log.stage("segmenting"):
            told = log.teller("segmenting")
            return label_clip(points, self.segmenter, self.config.objects, motions, told)

    def _check_borders(
        self, source: FrameSource | None, points: Trajectories, labels: NDArray[np.int32], log: _Log
    ) -> NDArray[np.int32]:
        """The labels without what rides along outside an object's outline; as they are without pictures."""
        config = self.config.objects
        if source is None or not config.check_borders or not (labels > BACKGROUND).any():
            return labels
        check = FigureGround(points, labels)
        with log.stage("checking borders"), closing(source.frames()) as frames:
            for image in log.each("checking borders", frames, points.frames):
                check.add(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY).astype(np.uint8, copy=False))
            on_ground = check.on_ground(config.least_ground_misfit)
        return settle(points, np.where(on_ground, BACKGROUND, labels).astype(np.int32), config)

    def _feed(self, sinks: Sequence[Sink], clip: Clip, table: LabelTable, log: _Log) -> None:
        """Give every frame to every sink."""
        if not sinks:
            return
        scenes = Scenes(clip.info, look_of(self.config.overlay).trail_s)
        wanted = clip.frames is not None and any(sink.wants_image for sink in sinks)
        pictures = clip.frames.frames() if clip.frames and wanted else _none(table.frames)
        with log.stage("writing"), closing(pictures):
            for frame, image in enumerate(log.each("writing", pictures, table.frames)):
                rows = table.at(frame)
                scene = scenes.next(FramePoints(table.ids[rows], table.xy[rows]), table.labels[rows])
                for sink in sinks:
                    sink.add(scene, image)
            for sink in sinks:
                sink.finish()


def _none(frames: int) -> Generator[None, None, None]:
    """No picture, for every frame."""
    for _ in range(frames):
        yield None


class _Log:
    """What a run tells: progress while it runs, seconds and warnings when it is done."""

    def __init__(self, progress: Progress | None) -> None:
        self.progress: Progress = progress or (lambda stage, done, total: None)
        self.seconds: dict[str, float] = {}
        self.warnings: list[str] = []

    @contextmanager
    def stage(self, name: str) -> Generator[None, None, None]:
        begun = time.perf_counter()
        yield
        self.seconds[name] = time.perf_counter() - begun

    def each(self, stage: str, items: Iterable[_Item], total: int | None) -> Iterator[_Item]:
        self.progress(stage, 0, total)
        for done, item in enumerate(items, 1):
            yield item
            self.progress(stage, done, total)

    def teller(self, stage: str) -> Callable[[int, int], None]:
        """A callback ``(done, total)`` for a part that does not know the name of its stage."""
        return lambda done, total: self.progress(stage, done, total)


class _Counted:
    """Frames, counted as they pass."""

    def __init__(self, frames: Iterable[Image]) -> None:
        self.count = 0
        self._frames = frames

    def __iter__(self) -> Iterator[Image]:
        for frame in self._frames:
            self.count += 1
            yield frame


def _exact(fps: Fraction | float | None) -> Fraction | None:
    """A rate as a fraction: 29.97 is meant as written, not as the nearest binary number."""
    if fps is None or isinstance(fps, Fraction):
        return fps
    if not 0 < fps < float("inf"):
        raise UsageError(f"fps must be positive, got {fps}")
    return Fraction(fps).limit_denominator(100_000)


def _ordered(points: Trajectories) -> Trajectories:
    """The same rows, by frame, then track."""
    order = np.lexsort((points.ids, points.frame))
    frame, ids = points.frame[order], points.ids[order]
    twice = np.flatnonzero((np.diff(frame) == 0) & (np.diff(ids) == 0))
    if len(twice):
        raise ValueError(f"track {ids[twice[0]]} has two points in frame {frame[twice[0]]}")
    return replace(points, frame=frame, ids=ids, xy=points.xy[order])


def _remarks(table: LabelTable) -> list[str]:
    """What a user should know of the labels."""
    if table.frames == 1:
        return ["only one frame: nothing can be seen to move"]
    if len(table.frame) == 0:
        return ["no corner to track was found: the pictures show too little texture"]
    return []


def _objects(table: LabelTable, info: VideoInfo) -> tuple[MovingObject, ...]:
    """The moving objects of a table, by number."""
    found = []
    for label in np.unique(table.labels[table.labels > 0]).tolist():
        rows = np.flatnonzero(table.labels == label)
        first, last = (info.time_of(int(table.frame[row])) for row in rows[[0, -1]])
        found.append(MovingObject(label, first, last, len(np.unique(table.ids[rows]))))
    return tuple(found)
