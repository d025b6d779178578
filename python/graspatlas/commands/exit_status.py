"""Exit statuses of the commands; 0 is success."""

__all__ = ["FAILED", "INTERRUPTED", "MISUSE"]

#: No grasp meets the requirements, or a check fails.
FAILED = 1
#: Wrong input.
MISUSE = 2
#: Ctrl-C, as shells report it.
INTERRUPTED = 130
