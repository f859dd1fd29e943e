"""Windows over a long clip; labels of windows become objects that keep their number."""
