"""Between two passes of stage 5: the world as those points see it that are surely static.

Stage 1 fits one world to everything that a window shows, and so to parts of what moves: with a few movers at
depths of its own choice a camera path is found on which halves of two of them stand still. So segments merge
cautiously at first. The widest group is then one motion, the static world's; a world that is fitted to it
alone tells truly how all others move.
"""

from __future__ import annotations

import numpy as np

from ifsvideo.segmentation.agglomeration import Agglomeration, Window
from ifsvideo.segmentation.background import static_group
from ifsvideo.segmentation.config import SegmenterConfig
from ifsvideo.segmentation.cues import Cues, median
from ifsvideo.segmentation.leeway import Leeway
from ifsvideo.segmentation.similarity import Similarity
from ifsvideo.segmentation.world import World


def in_static_core(
    cues: Cues, window: Window, world: World | None, rule: Similarity, config: SegmenterConfig
) -> tuple[Cues, Window]:
    """What is measured in the world of what is surely static, and the segments from which merging starts.

    Segments of the first pass's widest group that also fit the world of that group are one segment then: what
    was known to be one does not fall apart again, where a window is so short, or a scene so deep, that shear
    and subspaces tell its near parts from its far ones.

    Parameters
    ----------
    cues : Cues
        What is measured in the world of stage 1.
    window : Window
    world : World or None
        That of stage 1; where there is none, nothing changes.
    rule : Similarity
        Which segments are one motion, in a world that may be wrong.
    config : SegmenterConfig
        ``core_doubt`` 0 leaves out this pass.
    """
    if world is None or config.core_doubt == 0:
        return cues, window
    groups = Agglomeration(cues, rule).run(window, stop=config.core_doubt)
    widest = groups[static_group(groups, cues.anchor, window.size)]
    own = world.fitted_to(widest.reliable)
    leeway = Leeway(own, widest.reliable, config.evidence_threshold) if own is not world else None
    again = cues.in_world(own.evidence(config.evidence_threshold), own.nearness, leeway)
    held = np.unique(window.segments[widest.members])
    fits = [median(again.evidence[reliable]) < 1 for _, reliable in window.parts()]
    return again, window.joined(held[np.array(fits)[held]])
