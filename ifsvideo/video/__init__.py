"""Reading and writing through ffmpeg; image folders."""
