"""ifsvideo tells what moves by itself in a video whose camera moves too."""

__version__ = "0.1.0"
