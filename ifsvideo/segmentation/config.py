"""Settings of the segmenter: what the thesis leaves open, stated."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Literal

from ifsvideo.errors import UsageError
from ifsvideo.lens import check_k1


@dataclass(frozen=True)
class SegmenterConfig:
    """In-frame shear segmentation (section ``[segmentation]``).

    Lengths are pixels of a 640x480 picture and are scaled with the diagonal of the one at hand.
    """

    distortion: float = 0.0
    """k1 of the lens, taken out of the tracks before anything else (`ifsvideo.lens` has the model): above
    -4/27, negative for a wide lens. By default the lens bends nothing."""
    smoothing: float = 1.0
    """How much noisy tracks are smoothed, once cleared of what they do not share with others
    (`ifsvideo.segmentation.smoothing`): not at all below a quarter of a pixel of noise; at one pixel this
    holds back what changes within six frames. 0, the thesis's, leaves tracks as they are."""
    lasting: float = 0.75
    """Share of a sequence's frames in which the typical track must be seen for them to be one window; where
    tracks are shorter, the sequence is cut into windows (`ifsvideo.segmenting`). 0, the thesis's: always one.
    A clip has windows of its own (`ifsvideo.config.ObjectsConfig`)."""
    split: Literal["world", "epipolar"] = "world"
    """Stage 1: ``epipolar`` is the thesis's (fundamental matrices against the first frame), ``world`` fits
    one rigid perspective scene to all frames at once, which also sees a point behind the camera or below the
    road."""
    epipolar_error: float = 0.5
    """Distance below which a point is an epipolar inlier, pixels; the thesis asks for a low one, 0.3 to
    0.5."""
    models: int = 100
    """Affine models sampled (M); 60 do for the few objects of Hopkins-155, a street has more."""
    disk_radius: float = 40.0
    """Radius of a model's disk (r), pixels: a car 30 m ahead."""
    foreground_share: float = 0.5
    """Probability that a disk is centred on a foreground point (t_samp)."""
    ransac_iterations: int = 10
    """Triples tried in a disk; the thesis found 10 to be enough."""
    through_centre: bool = True
    """Whether a disk's model must explain the point in its centre. The thesis does not ask for it, and then a
    small object's disk is won by the background around it."""
    inlier_error: float = 2.0
    """Transfer error below which a point fits a triple in a frame (t_in), pixels."""
    nearest_models: int = 5
    """Models of least residual among which the nearest wins (k)."""
    centred: bool = True
    """Whether the inliers' mean is taken off before the subspace is fitted: rank 2 is then exactly affine
    motion; the thesis does without."""
    data_weight: float = 1.0
    """lambda_1, weight of the residual (eq. 3.4)."""
    motion_weight: float = 0.5
    """lambda_2, weight of motion coherence: two neighbours that move alike are worth half a pixel of
    residual."""
    attribute_weight: float = 1.0
    """lambda_3, weight of attribute coherence."""
    attribute_cost: float = 0.1
    """E_c: cost of neighbours with different attributes."""
    attribute_data: bool = False
    """Whether a point refuses every model of the other attribute (eq. 3.5). Points on a boundary suffer from
    it when the split of stage 1 is wrong, so the default leaves the choice to the residual."""
    moving_weight: float = 0.5
    """Cost of a model whose inliers surely move to a point that surely does not, pixels: the softer form of
    the same."""
    label_cost: float = 4.0
    """What a model costs, pixels: one is kept if it explains forty points better by a tenth of a pixel, or
    four by one (`ifsvideo.segmentation.selection`). 0 keeps all, as the thesis does."""
    outlier_cost: float = 3.0
    """sigma_out: what a point pays that no model explains, pixels."""
    motion_sigma: float = 5.0
    """sigma of eq. 3.7: at a distance of 20 px a difference in velocity of 0.3 px a frame halves the
    coherence."""
    iterations: int = 20
    """Iterations of TRW-S at most."""
    merging: Literal["evidence", "shear"] = "evidence"
    """Stage 5: ``shear`` is the thesis's Algorithm 3, ``evidence`` weighs shear with cross prediction,
    nearness and the static world."""
    pairs: int = 10
    """Point pairs between two segments in which shear is measured."""
    shear_ratio: float = 3.0
    """lambda of Algorithm 2: segments are apart if the shear between them exceeds so many times that
    inside."""
    core_doubt: float = 0.25
    """Probability of being two motions up to which segments merge at first: the widest group is then surely
    static, the world is fitted anew to it alone, and merging starts again. 0 leaves the world as stage 1
    found it."""
    narrow_core_doubt: float = 0.15
    """The same in a sequence that is one window, where the core grows once more."""
    wider_core_doubt: float = 0.3
    """The same in the world of that narrow core, by the rule of the last pass: the core that the world is
    fitted to in the end. 0 leaves it at ``core_doubt``. A clip's window has one core: others overlap it."""
    evidence_threshold: float = 5.0
    """How many times farther than usual in the window a point must be from a static point's way to be as
    likely moving as not."""
    least_points: int = 5
    """Points of a moving object; fewer are a mistake more often than a thing."""
    few_points_doubt: float = 20.0
    """Log odds by which a group must be another motion than the background, over the number of its points,
    and beyond ten over its square: five are believed at 55 to 1, ten at 7 to 1, twenty at 3 to 2. What
    slips along an edge is seldom more than a handful."""
    gap: float = 50.0
    """Distance at which what moves alike is several things, pixels: no part of a car is so far from the next.
    Faults of tracking are spread over the picture, and each is then judged by itself."""
    gap_doubt: float = 0.3
    """Probability of being two motions up to which parts that a gap cut are one thing all the same, if each
    is believed to move: a lorry and its trailer."""
    contest: bool = True
    """Whether a mover may take from the static world what its own motion predicts better
    (`ifsvideo.segmentation.contest`), in a sequence that is one window. In windows of clips it takes a fifth
    of the time and none is won."""
    votes: int = 7
    """How often a sequence that is one window is segmented at most, where that is doubtful
    (`ifsvideo.segmentation.voting`). A window of a clip is segmented once: the next one overlaps it."""

    def core_doubts(self, alone: bool) -> tuple[float, ...]:
        """How far segments merge before each fit of the static core's world, in a sequence that is one window
        (``alone``), or in a window of a clip."""
        if self.core_doubt == 0:
            return ()
        twice = alone and self.wider_core_doubt > 0
        return (self.narrow_core_doubt, self.wider_core_doubt) if twice else (self.core_doubt,)

    def __post_init__(self) -> None:
        for name, values in (("split", ("world", "epipolar")), ("merging", ("evidence", "shear"))):
            if getattr(self, name) not in values:
                raise UsageError(
                    f"segmentation.{name} must be one of {', '.join(values)}, got {getattr(self, name)!r}"
                )
        for entry in fields(self):
            value = getattr(self, entry.name)
            if isinstance(value, bool | str) or entry.name == "distortion":
                continue
            if not 0 <= value < float("inf"):
                raise UsageError(f"segmentation.{entry.name} must not be negative, got {value}")
        for name in (
            "evidence_threshold",
            "models",
            "disk_radius",
            "ransac_iterations",
            "inlier_error",
            "nearest_models",
            "motion_sigma",
            "pairs",
        ):
            if not getattr(self, name) > 0:
                raise UsageError(f"segmentation.{name} must be positive, got {getattr(self, name)}")
        check_k1(self.distortion, "segmentation.distortion")
        if self.foreground_share > 1:
            raise UsageError(f"segmentation.foreground_share must be at most 1, got {self.foreground_share}")

    @classmethod
    def thesis(cls) -> SegmenterConfig:
        """The literal algorithm of the thesis.

        Only k is free of choice nowhere: the thesis gives lambda = 3 and 10 RANSAC iterations and leaves the
        rest open. M = 60, r = 40 at 640x480, t = 0.5, t_in = 2, t_samp = 0.5, k = 5 and 10 pairs are the
        start that its restatement proposes.
        """
        return cls(
            smoothing=0.0,
            lasting=0.0,
            split="epipolar",
            models=60,
            through_centre=False,
            centred=False,
            attribute_data=True,
            label_cost=0.0,
            merging="shear",
        )
