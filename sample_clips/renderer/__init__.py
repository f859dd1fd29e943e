"""A small perspective renderer for the sample clips: textured planar faces, numpy and OpenCV only.

World, object and camera axes are all x right, y down, z forward, in metres; the ground is y = 0.
Pixel coordinates have the centre of the top-left pixel at (0, 0).
"""
