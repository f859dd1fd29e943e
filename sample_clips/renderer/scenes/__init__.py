"""The four scenes, by clip name."""

from collections.abc import Callable

from renderer.film import Scene
from renderer.scenes import dashcam_drive, follow_car, handheld_pan, static_drive

SCENES: dict[str, Callable[[], Scene]] = {
    "dashcam_drive": dashcam_drive.build,
    "follow_car": follow_car.build,
    "static_drive": static_drive.build,
    "handheld_pan": handheld_pan.build,
}
