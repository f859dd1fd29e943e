"""From a clip to labels and an overlay: read, track, segment, link, check borders, write; all at once.

Three threads and a process, with queues of limited length between them: one thread reads and tracks, the
process labels the windows (one more thread waits for it), and the caller's own thread links these, and draws
and writes what is final. What comes out does not depend on who is faster.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import asdict
from fractions import Fraction
from pathlib import Path

import numpy as np

from ifsvideo.ahead import Ahead
from ifsvideo.allocator import give_back
from ifsvideo.clip import Clip, Source, check_outputs, open_clip
from ifsvideo.config import Config
from ifsvideo.errors import UsageError
from ifsvideo.ignore import Area, ignore_mask
from ifsvideo.objects.labelling import label_frames
from ifsvideo.objects.shot import BeginWindow, Frame
from ifsvideo.objects.windows import WindowLabeller, WindowLabels, WindowSize
from ifsvideo.output.atomic import Outputs
from ifsvideo.output.census import Census, TableSink
from ifsvideo.output.labels import LabelSink
from ifsvideo.output.overlay import OverlayRenderer
from ifsvideo.output.overlay_video import OverlaySink, check_wishes
from ifsvideo.output.products import Products, ProductsSink
from ifsvideo.output.scenes import Scenes
from ifsvideo.output.styles import look_of
from ifsvideo.segmentation.segmenter import IFSSegmenter
from ifsvideo.stopwatch import Stopwatch
from ifsvideo.tracking.steps import Step, follow, steps_of
from ifsvideo.tracking.tracker import KltTracker
from ifsvideo.types import Bools, Counts, Progress, Renderer, Result, Segmenter, Sink, Tracker, Tracks
from ifsvideo.worker import Caller, Worker

_AHEAD = 16
"""Frames that may be tracked before those behind are labelled: the objects of half a second are looked at in
one go, and the tracker should not have to wait for that."""
_STAGES = ("reading", "tracking", "segmenting", "linking", "writing")
"""Stages whose seconds are told; they run side by side."""
_GIVEN_BACK = 250
"""Frames after which free memory is given back: often enough for it not to grow, too seldom to cost time."""
_WORTH_A_PROCESS = 3
"""Windows from which on a process of its own pays: it takes as long to start as a window to label."""


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
        self.tracker = tracker
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
        preview: int | None = None,
        ignore: Sequence[Area] = (),
        motions: int | None = None,
        audio: bool = True,
        products: Products | None = None,
        keep_table: bool = True,
        progress: Progress | None = None,
    ) -> Result:
        """Run all stages over one clip, which is read once; frames are never all held in memory.

        Parameters
        ----------
        source : path, list of paths, FrameSource, Tracks or array
            A video (``-``: from standard input), a list of the chapters of one recording, a folder of images,
            a file of tracks (.npz, .mat), or tracks: (F, P, 2) float, pixels, NaN where a point is not seen.
            Of tracks only labels can be written.
        output, labels : path, optional
            Overlay (.mp4, .mov, .mkv, .gif, .webp) and CSV; they appear together when all is done.
        fps : Fraction or float, optional
            Frames per second of a folder or of tracks (10 unless told), or in place of a video's own.
        start, end : float, optional
            Stretch of the input, seconds.
        preview : int, optional
            Read every so manyth second only, for a quick look.
        ignore : sequence of areas, optional
            What is not looked at: rectangles (x, y, width, height), mask images, (H, W) bool arrays.
        motions : int, optional
            Number of motions, the background's included, where it is known.
        audio : bool, optional
            Whether the video keeps the sound.
        products : Products, optional
            Places of further outputs: objects, masks, tracks, clips, a summary.
        keep_table : bool, optional
            Whether the result holds every row of the labels; without, memory does not grow with the clip.
        progress : callable, optional
            ``progress("frames", done, total)``, called as each frame is written.

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
        clip = open_clip(source, _exact(fps), start, end, preview)
        products = products or Products()
        if products.clips is not None and fps is not None:
            raise UsageError("clips are cut by the video's own times; leave out fps, or the clips")
        check_outputs(clip, video, csv, products)
        if video is not None:
            check_wishes(video, self.config.overlay)
        if ignore and clip.frames is None:
            raise UsageError(f"{clip.name}: tracks hold no pictures; leave out ignore")
        mask = ignore_mask(ignore, clip.info)
        watch = Stopwatch()
        census, table = Census(), TableSink()
        with Outputs() as outputs:
            sound = clip.frames.sound if audio and clip.frames else None
            further = ProductsSink(products, clip.info, clip.path, outputs, sound)
            sinks: list[Sink] = [census]
            sinks += [table] if keep_table else []
            sinks += [further] if any(products.named()) else []
            if csv is not None:
                sinks.append(LabelSink(csv, outputs))
            if video is not None:
                overlay = OverlaySink(video, clip.info, self.renderer, outputs, sound, self.config.overlay)
                sinks.append(overlay)
            with self._tracked(clip, mask, watch) as steps, self._segmenting(clip, motions, watch) as label:
                size = (clip.info.width, clip.info.height)
                frames = label_frames(
                    steps, label, self.config.objects, size, float(clip.info.fps), self.config.tracking.scale
                )
                self._feed(sinks, clip, watch.each("linking", frames), watch, progress)
            with watch.stage("writing"):
                for sink in sinks:
                    sink.finish()
            warnings = [*(clip.frames.warnings if clip.frames else ()), *_remarks(census.counts)]
            warnings += [*(overlay.warnings if video is not None else ()), *further.warnings]
            kept = table.table if keep_table else None
            result = Result(
                clip.info,
                census.counts,
                census.objects,
                video,
                csv,
                tuple(warnings),
                watch.seconds_of(_STAGES),
                kept=kept,
            )
            result = further.described(result)
            told = {"motions": motions, "fps": fps, "start": start, "end": end, "preview": preview}
            further.summarise(result, {**told, "ignore": list(ignore), "config": asdict(self.config)})
        return result

    @contextmanager
    def _tracked(
        self, clip: Clip, mask: Bools | None, watch: Stopwatch
    ) -> Generator[Iterable[Step], None, None]:
        """The steps of a clip, made in a thread of its own where there are pictures."""
        if clip.frames is None:
            assert clip.trajectories is not None, "a clip has frames or trajectories"
            yield steps_of(clip.trajectories)
            return
        tracker = self.tracker or KltTracker(self.config.tracking, float(clip.info.fps))
        pictures = watch.each("reading", clip.frames.pictures())
        steps = watch.each("tracking", follow(tracker, pictures, mask, clip.frames.shot_frames))
        with Ahead(steps, _AHEAD, clip.frames.stop) as ahead:
            yield watch.each("waiting", ahead)

    @contextmanager
    def _segmenting(
        self, clip: Clip, motions: int | None, watch: Stopwatch
    ) -> Generator[BeginWindow, None, None]:
        """What labels windows: in a process of its own, or a thread where that would not pay.

        A segmenter of the user's own stays in this process too: it may keep state, and need not be picklable.
        """
        config = self.config.objects
        labeller = WindowLabeller(self.segmenter, config, motions)
        worth = _WORTH_A_PROCESS * WindowSize.at(float(clip.info.fps), config).length
        long = clip.info.frames is None or clip.info.frames >= worth
        with ExitStack() as stack:
            call: Callable[[Tracks], WindowLabels] = labeller
            if long and isinstance(self.segmenter, IFSSegmenter):
                call = stack.enter_context(Worker(labeller, "segments", keeps_memory=True))

            def label(tracks: Tracks) -> WindowLabels:
                with watch.stage("segmenting"):
                    return call(tracks)

            yield stack.enter_context(Caller(label, watch)).begin

    def _feed(
        self,
        sinks: Sequence[Sink],
        clip: Clip,
        frames: Iterable[Frame],
        watch: Stopwatch,
        progress: Progress | None,
    ) -> None:
        """Give every frame to every sink, as often as it is shown."""
        tell: Progress = progress or (lambda stage, done, total: None)
        wanted = any(sink.wants_image for sink in sinks)
        scenes = Scenes(clip.info, look_of(self.config.overlay).trail_s if wanted else 0.0)
        done = 0
        tell("frames", done, clip.info.frames)
        for frame in frames:
            for _ in range(frame.shown):
                with watch.stage("writing"):
                    image = frame.picture.rgb if wanted and frame.picture is not None else None
                    scene = scenes.next(frame.points, frame.labels.astype(np.int32))
                    for sink in sinks:
                        sink.add(scene, image)
                done += 1
                tell("frames", done, clip.info.frames)
                if done % _GIVEN_BACK == 0:
                    give_back()


def _exact(fps: Fraction | float | None) -> Fraction | None:
    """A rate as a fraction: 29.97 is meant as written, not as the nearest binary number."""
    if fps is None or isinstance(fps, Fraction):
        return fps
    if not 0 < fps < float("inf"):
        raise UsageError(f"fps must be positive, got {fps}")
    return Fraction(fps).limit_denominator(100_000)


def _remarks(counts: Counts) -> list[str]:
    """What a user should know of the labels."""
    if counts.frames == 1:
        return ["only one frame: nothing can be seen to move"]
    if counts.rows == 0:
        return ["no corner to track was found: the pictures show too little texture"]
    return []
