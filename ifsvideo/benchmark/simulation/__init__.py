"""Labelled trajectories from a simulated world, to learn weights for which real data is too scarce.

Modelled: a camera with a focal length and one radial lens term on a path with speed, bends, pitch, vibration
or shake; ground, facades, poles, trees, parked cars, a far skyline, or a room with a table; boxes that drive,
follow, cross, turn, stop, slide and spin, with points on the faces that are seen; hiding by movers and by
standing things; birth and death of tracks; a tracker's noise, drift and false corners.

Not modelled: rolling shutter, motion blur, zoom, a principal point off the middle, limbs, wheels, leaves in
the wind, shadows and mirrors, hills, curved bodies, tracks that jump from one thing to another.
"""

from ifsvideo.benchmark.simulation.geometry import Box, Camera, Scene
from ifsvideo.benchmark.simulation.sequence import Simulation, simulate, simulate_window

__all__ = ["Box", "Camera", "Scene", "Simulation", "simulate", "simulate_window"]
