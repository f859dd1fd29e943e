"""``python -m ifsvideo`` is the command ``ifsvideo``."""

from ifsvideo.cli import main

if __name__ == "__main__":
    raise SystemExit(main())
