"""Between the passes of stage 5: the world as those points see it that are surely static.

Stage 1 fits one world to everything that a window shows, and so to parts of what moves: with a few movers at
depths of its own choice a camera path is found on which halves of two of them stand still. So segments merge
cautiously at first. The widest group is then one motion, the static world's; a world that is fitted to it
alone tells truly how all others move. In a sequence that is one window they merge still more cautiously, then
a little farther in that world, and the world is fitted once more: what was cautious enough to be pure is
seldom wide enough to hold the cameras everywhere.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ifsvideo.segmentation.agglomeration import Agglomeration, Window
from ifsvideo.segmentation.background import static_group
from ifsvideo.segmentation.cues import Cues, Members
from ifsvideo.segmentation.leeway import Leeway
from ifsvideo.segmentation.median import median
from ifsvideo.segmentation.similarity import Rules, Similarity
from ifsvideo.segmentation.world import World


def in_static_core(
    cues: Cues,
    window: Window,
    world: World | None,
    rules: Rules,
    doubts: Sequence[float],
    threshold: float,
) -> tuple[Cues, Window]:
    """What is measured in the world of what is surely static, and the segments from which merging starts.

    Segments of the widest group that also fit the world of that group are one segment then: what was known to
    be one does not fall apart again, where a window is so short, or a scene so deep, that shear and subspaces
    tell its near parts from its far ones.

    Parameters
    ----------
    cues : Cues
        What is measured in the world of stage 1.
    window : Window
    world : World or None
        That of stage 1; where there is none, nothing changes.
    rules : Rules
        Which segments are one motion, in a world that may be wrong and in that of a core.
    doubts : sequence of float
        Probabilities of being two motions up to which segments merge, for one core after the other; the
        first by the rule of a world that may be wrong. Without any nothing changes.
    threshold : float
        Of the evidence (`SegmenterConfig.evidence_threshold`).
    """
    if world is None or not doubts:
        return cues, window
    rule = rules.core
    for doubt in doubts:
        core = _widest(cues, window, rule, doubt)
        # The same core, too: fitted once more, its world comes nearer.
        cues, world = _in_world_of(core, cues, world, threshold)
        rule = rules.final
    held = np.array([np.isin(reliable, core).all() for _, reliable in window.parts()])
    fits = np.array([median(cues.evidence[reliable]) < 1 for _, reliable in window.parts()])
    return cues, window.joined(np.flatnonzero(held & fits))


def _widest(cues: Cues, window: Window, rule: Similarity, doubt: float) -> Members:
    """The measured points (n,) of the static world's group, where segments merge up to a doubt."""
    groups = Agglomeration(cues, rule).run(window, stop=doubt)
    return groups[static_group(groups, cues.anchor, window.size)].reliable


def _in_world_of(core: Members, cues: Cues, world: World, threshold: float) -> tuple[Cues, World]:
    """What is measured in the world of some points that are surely static, and that world."""
    own = world.fitted_to(core)
    leeway = Leeway(own, core, threshold) if own is not world else None
    return cues.in_world(own.evidence(threshold), own.nearness, leeway), own
