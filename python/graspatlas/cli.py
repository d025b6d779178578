"""Command line: the commands of graspatlas."""

from __future__ import annotations

import argparse
import importlib
import signal
import sys
import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING, NoReturn, TextIO

from graspatlas.commands.shared.arguments import INTERRUPTED, MISUSE
from graspatlas.errors import GraspAtlasError
from graspatlas.start_up import hear_interrupts
from graspatlas.support.interrupts import stoppable, stopped_by
from graspatlas.support.terminal import finish_output, printable, say, shortened, silence_output

if TYPE_CHECKING:
    from _typeshed import SupportsWrite

__all__ = ["main"]

#: Modules of ``commands`` and the commands that they add, in the order in which help lists them.
COMMANDS = {
    "listing": ("list", "doctor", "regions"),
    "problem": ("new", "check", "schema", "pads"),
    "propose": ("propose",),
    "optimize": ("optimize",),
    "ladder": ("ladder",),
    "result": ("view", "export", "check-result"),
    "analysis": ("pareto", "densify", "path"),
    "simulate": ("simulate",),
    "sweep": ("sweep",),
    "reproduce": ("reproduce",),
}

#: Requests to end, besides Ctrl-C: of a cluster whose time is up, and of a terminal that is closed.
_REQUESTS = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: The words after ``graspatlas``; those of the process by default.

    Returns:
        Exit status: 0, 1 where no grasp meets the requirements or a check fails, 2 for wrong input, 130 when
        interrupted, 143 when terminated: a request to terminate keeps what there is, as Ctrl-C does.
    """
    hear_interrupts()
    try:
        with stoppable(also=_REQUESTS), warnings.catch_warnings():
            warnings.showwarning = _say_warning
            status = _run(arguments)
            finish_output()
            return 128 + stopped_by() if status == INTERRUPTED and stopped_by() else status
    except GraspAtlasError as error:
        return _misuse(error)
    except BrokenPipeError:  # the reader of our output has seen enough
        silence_output()
        return 0
    except KeyboardInterrupt as error:
        say("graspatlas: interrupted", file=sys.stderr)
        return 128 + int(getattr(error, "signal", signal.SIGINT))


def _run(arguments: Sequence[str] | None) -> int:
    """Run a command; its exit status."""
    try:
        words = sys.argv[1:] if arguments is None else list(arguments)
        parser = parser_for(words)
        options, unknown = parser.parse_known_args(words)
        if unknown:
            parser.prog += f" {words[0]}"  # whose help lists what there is
            parser.error(f"unrecognized arguments: {' '.join(unknown)}")
        return int(options.run(options))
    except SystemExit:  # help is printed, or a word is wrong
        finish_output()
        raise
    except MemoryError:
        return _misuse("there is not enough memory for this; choose a larger radius or a smaller input")
    except RecursionError:
        return _misuse("the input is nested too deeply to be one; correct it")
    except BrokenPipeError:
        raise
    except OSError as error:
        place = f" '{error.filename}'" if error.filename else ""
        return _misuse(f"{error.strerror or error}{place}; make sure that it can be read and written")


def _say_warning(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    """Print a warning as one line, as errors are."""
    kind = "" if category is RuntimeWarning else f"{category.__name__}: "
    say(shortened(" ".join(f"graspatlas: warning: {kind}{message}".split("\n"))), file=sys.stderr)


def _misuse(reason: object) -> int:
    say(shortened(" ".join(f"graspatlas: error: {reason}".split("\n"))), file=sys.stderr)
    return MISUSE


class _Parser(argparse.ArgumentParser):
    """A parser whose errors are one line, like all others."""

    def _print_message(self, message: str, file: SupportsWrite[str] | None = None) -> None:
        """Help and version; argparse keeps quiet where they cannot be written."""
        say(message, file=None if file is sys.stdout else file, end="")

    def error(self, message: str) -> NoReturn:
        line = shortened(printable(f"graspatlas: error: {message}; see '{self.prog} --help'"))
        self.exit(MISUSE, line + "\n")


class _Version(argparse.Action):
    """Prints the versions of the package and of what it stands on."""

    def __init__(self, option_strings: Sequence[str], dest: str) -> None:
        super().__init__(option_strings, argparse.SUPPRESS, nargs=0, help="show versions and exit")

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> NoReturn:
        from graspatlas.doctor import versions  # slow to import

        say(versions())
        parser.exit()


def parser_for(words: Sequence[str]) -> argparse.ArgumentParser:
    """The parser of a command line: it knows the command that comes first, and all of them where none does."""
    parser: argparse.ArgumentParser = _Parser(
        prog="graspatlas",
        description="Find the globally best grasp of an object by a robotic hand when the contacts are given.",
    )
    parser.add_argument("--version", action=_Version)
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    named = [module for module, names in COMMANDS.items() if words and words[0] in names]
    for module in named or COMMANDS:
        importlib.import_module(f"graspatlas.commands.{module}").add_commands(commands)
    return parser


if __name__ == "__main__":
    sys.exit(main())
