"""The command ``ifsvideo``, and ``python -m ifsvideo``: catches Ctrl-C from the first moment on."""

import sys


def main() -> int:
    """Run the command; returns the exit status."""
    try:
        # Imported here because it takes half a second, in which somebody may think better of it.
        from ifsvideo.cli import main as command

        return command()
    except KeyboardInterrupt:
        print("ifsvideo: interrupted", file=sys.stderr)
        return 130


if __name__ == "__main__":
    raise SystemExit(main())
