"""Between the passes of stage 5: the world as those points see it that are surely static.

Stage 1 fits one world to everything that a window shows, and so to parts of what moves: with a few movers at
depths of its own choice a camera path is found on which halves of two of them stand still. So segments merge
cautiously at first. The widest group is then one motion, the static world's; a world that is fitted to it
alone tells truly how all others move. In that world segments merge a little farther, and the world is fitted
once more: what was cautious enough to be pure is seldom wide enough to hold the cameras everywhere.
"""

from __future__ import annotations

import numpy as np

from ifsvideo.segmentation.agglomeration import Agglomeration, Window
from ifsvideo.segmentation.background import static_group
from ifsvideo.segmentation.config import SegmenterConfig
from ifsvideo.segmentation.cues import Cues, Members
from ifsvideo.segmentation.leeway import Leeway
from ifsvideo.segmentation.median import median
from ifsvideo.segmentation.similarity import Rules, Similarity
from ifsvideo.segmentation.world import World


def in_static_core(
    cues: Cues, window: Window, world: World | None, rules: Rules, config: SegmenterConfig
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
    config : SegmenterConfig
        ``core_doubt`` 0 leaves out all of this, ``wider_core_doubt`` 0 the second core.
    """
    if world is None or config.core_doubt == 0:
        return cues, window
    core = _widest(cues, window, rules.core, config.core_doubt)
    cues, world = _in_world_of(core, cues, world, config)
    if config.wider_core_doubt > 0:
        # The same core, too: fitted once more, its world comes nearer.
        core = _widest(cues, window, rules.final, config.wider_core_doubt)
        cues, _ = _in_world_of(core, cues, world, config)
    held = np.array([np.isin(reliable, core).all() for _, reliable in window.parts()])
    fits = np.array([median(cues.evidence[reliable]) < 1 for _, reliable in window.parts()])
    return cues, window.joined(np.flatnonzero(held & fits))


def _widest(cues: Cues, window: Window, rule: Similarity, doubt: float) -> Members:
    """The measured points (n,) of the static world's group, where segments merge up to a doubt."""
    groups = Agglomeration(cues, rule).run(window, stop=doubt)
    return groups[static_group(groups, cues.anchor, window.size)].reliable


def _in_world_of(core: Members, cues: Cues, world: World, config: SegmenterConfig) -> tuple[Cues, World]:
    """What is measured in the world of some points that are surely static, and that world."""
    own = world.fitted_to(core)
    leeway = Leeway(own, core, config.evidence_threshold) if own is not world else None
    return cues.in_world(own.evidence(config.evidence_threshold), own.nearness, leeway), own
