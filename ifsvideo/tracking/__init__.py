"""Shi-Tomasi corners, pyramidal KLT, the birth and death of a track."""
