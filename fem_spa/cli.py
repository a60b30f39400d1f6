"""The command `fem-spa`. Thin: it knows the commands' names, exit statuses, and nothing else.

0: done. 1: the job ran and did not reach its end. 2: the input is wrong; one line to stderr.
"""

from __future__ import annotations

import argparse
import errno
import importlib
import os
import sys
from collections.abc import Sequence
from typing import NoReturn

from fem_spa import __version__
from fem_spa.commands import SUMMARIES

DONE, UNFINISHED, WRONG_INPUT = 0, 1, 2


class Parser(argparse.ArgumentParser):
    """argparse that says what is wrong in one line."""

    def error(self, message: str) -> NoReturn:
        """One line to stderr, exit status 2."""
        line = " ".join(message.split())
        print(f"{self.prog}: {line} (see {self.prog} --help)", file=sys.stderr)
        raise SystemExit(WRONG_INPUT)


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command line and return its exit status; never a traceback for wrong input."""
    words = list(sys.argv[1:] if argv is None else argv)
    if any("\0" in word for word in words):  # no shell gives one, a caller may; no file can have it
        print("fem-spa: an argument holds a null character; leave it out", file=sys.stderr)
        return WRONG_INPUT
    try:
        return _run(words)
    except KeyboardInterrupt:
        print("fem-spa: interrupted before there was a result", file=sys.stderr)
        return UNFINISHED
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return UNFINISHED
    except SystemExit as done:
        return done.code if isinstance(done.code, int) else DONE
    except Exception as error:
        if os.environ.get("FEM_SPA_DEBUG"):
            raise
        if _wrong_input(error):
            print(f"fem-spa: {' '.join(str(error).split())}", file=sys.stderr)
            return WRONG_INPUT
        if (why := _cut_short(error)) is not None:
            print(f"fem-spa: {' '.join(why.split())}", file=sys.stderr)
            return UNFINISHED
        what = f"{type(error).__name__}: {' '.join(str(error).split())}"
        print(f"fem-spa: a fault of the program: {what} (FEM_SPA_DEBUG=1 shows where)", file=sys.stderr)
        return UNFINISHED


def _run(words: list[str]) -> int:
    """Parse, load the one command that is asked for, call it."""
    parser = Parser(
        prog="fem-spa",
        description="Soft pneumatic actuators: from drawing and rubber test to an angle-pressure curve.",
        epilog="fem-spa COMMAND --help says more. A first run: fem-spa study --list",
    )
    parser.add_argument("--version", action="version", version=f"fem-spa {__version__}")
    commands = parser.add_subparsers(metavar="COMMAND", dest="command", parser_class=Parser)
    asked = next((word for word in words if not word.startswith("-")), None)
    module = None
    for name, summary in SUMMARIES.items():
        sub = commands.add_parser(name, help=summary, formatter_class=argparse.RawDescriptionHelpFormatter)
        if name == asked:
            module = importlib.import_module(f"fem_spa.commands.{name}")
            sub.description = getattr(module, "DESCRIPTION", summary)
            module.add_arguments(sub)
    arguments = parser.parse_args(words)
    if arguments.command is None or module is None:
        parser.error(f"a command is needed: {', '.join(SUMMARIES)}")
    return int(module.run(arguments))


def _wrong_input(error: Exception) -> bool:
    """Whether one of the three rooms has refused its input."""
    from fem_spa.errors import InputError
    from geometry.errors import GeometryError
    from materials.errors import MaterialError

    return isinstance(error, (InputError, GeometryError, MaterialError))


_NO_ROOM = (
    *(errno.ENOSPC, errno.EFBIG, errno.EROFS, errno.EACCES, errno.EPERM, errno.EIO, errno.ENOTDIR),
    *(errno.EISDIR, errno.ENOENT, errno.ENAMETOOLONG, getattr(errno, "EDQUOT", errno.ENOSPC)),
)


def _cut_short(error: Exception) -> str | None:
    """The line of a job that the machine would not let go on, not the program: no room, no memory."""
    from fem_spa.errors import Unfinished

    if isinstance(error, Unfinished):
        return str(error)
    if isinstance(error, OSError) and error.errno in _NO_ROOM:
        where = f"{error.filename}: " if error.filename else ""
        return (
            f"{where}{error.strerror}; what was finished before stays: make room there, or give another --out"
        )
    if isinstance(error, MemoryError):
        return f"not enough memory ({error or 'none is left'}); a coarser mesh or a shorter record needs less"
    return None


if __name__ == "__main__":
    raise SystemExit(main())
