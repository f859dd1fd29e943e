"""``python -m ifsvideo.benchmark``: datasets, metrics, tables."""
