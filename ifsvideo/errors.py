"""What can go wrong, as exceptions that carry the command's exit status.

::

    IfsVideoError           1  a fault of the program
    ├── UsageError          2  the call itself: options, configuration, output equal to input
    ├── InputError          3  the input cannot be read
    └── OutputError         4  the output cannot be written

A message is one line: it names the file, what is wrong with it, and what to do.
"""


class IfsVideoError(Exception):
    """Base of every error that the package raises on purpose."""

    exit_status: int = 1


class UsageError(IfsVideoError):
    """The call is wrong: an option, a configuration value, a range of time."""

    exit_status = 2


class InputError(IfsVideoError):
    """The input is missing, unreadable or holds no pictures."""

    exit_status = 3


class OutputError(IfsVideoError):
    """The output cannot be written: folder missing, no permission, disk full."""

    exit_status = 4
