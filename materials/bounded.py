"""Files of the user's, read as far as they can be meant: a slip of name must not take all memory.

What is too large is an OSError, as is any other reason why a file cannot be read: callers need no case more.
"""

from __future__ import annotations

import errno
import tomllib
from pathlib import Path
from typing import Any

MOST_TEXT = 10_000_000
"""Bytes of a deck, a card or a model file."""
_DEEPEST = 30  # tables and lists in one another
MOST_ROWS = 100_000_000
"""Bytes of a table of measured data: some millions of rows."""


def read_bytes(path: Path, most: int) -> bytes:
    """The content of a file (or pipe) of at most `most` bytes.

    Raises
    ------
    OSError
        It cannot be read, or is larger; seen before memory is taken.
    """
    with open(path, "rb") as file:
        data = b""
        if path.stat().st_size <= most:
            data = file.read(most + 1)
        if len(data) > most or (not data and path.stat().st_size > most):
            size = max(path.stat().st_size, most + 1)
            raise OSError(
                errno.EFBIG,
                f"it is larger than {most / 1e6:g} MB ({size / 1e6:.4g} MB), which cannot be meant",
            )
        return data


def read_text(path: Path, most: int = MOST_TEXT, encoding: str = "utf-8") -> str:
    """The text of a file of at most `most` bytes, its line ends as ``\\n``.

    Raises
    ------
    OSError, UnicodeDecodeError
        as `read_bytes`; it is not text
    """
    return read_bytes(path, most).decode(encoding).replace("\r\n", "\n").replace("\r", "\n")


def parse_toml(text: str) -> dict[str, Any]:
    """The tables of a TOML text.

    Raises
    ------
    tomllib.TOMLDecodeError
        also where tables or lists are nested beyond any use
    """
    try:
        tables = tomllib.loads(text)
        _refuse_depth(tables)
        return tables
    except RecursionError:
        raise tomllib.TOMLDecodeError("it is nested too deeply") from None
    except ValueError as error:  # an integer of more digits than Python converts
        if isinstance(error, tomllib.TOMLDecodeError):
            raise
        raise tomllib.TOMLDecodeError(str(error).partition(";")[0]) from None


def _refuse_depth(tables: dict[str, Any]) -> None:
    level: list[Any] = [tables]
    for _ in range(_DEEPEST):
        level = [
            item
            for table in level
            for item in (table.values() if isinstance(table, dict) else table)
            if isinstance(item, (dict, list))
        ]
        if not level:
            return
    raise RecursionError


def read_toml(path: Path) -> dict[str, Any]:
    """The tables of a TOML file; errors as `read_text` and `parse_toml`."""
    return parse_toml(read_text(path))
