"""Checkpoints of a run on disk: what the rest of it depends on, whole, and which problem it belongs to.

A checkpoint is `checkpoint_N.json`, which names the files of its arrays with their checksums. An array that
was in the checkpoint before is not written again. The last two are kept: should the last be damaged (a power
cut), the one before still serves.
"""

from __future__ import annotations

import json
import re
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fem_spa.errors import InputError
from fem_spa.output.files import whole, write_whole

FOLDER = "checkpoint"
FORMAT = 2
"""Counted on where what a checkpoint holds is another: an older one cannot be gone on with."""
_SMALL = 16  # numbers: fewer stand in the .json itself
_ARRAY, _VALUES, _BLOCK = "<array>", "<values>", "<block>"
_NAME = re.compile(r"\d{8}\.(npy|json)")
Written = dict[int, tuple[Any, list[Any]]]
"""id of an array or tuple -> itself, so that the id stays its own, and what names its file."""


class Damaged(Exception):
    """A checkpoint is not whole."""


class _Other(Exception):
    """A checkpoint is of another format."""


class Checkpoints:
    """The checkpoints in one folder.

    Content is plain: tables with texts as keys, lists, texts, numbers, None, arrays, and tuples of plain
    values. Arrays and tuples must never change once they were given; the same object is written once.

    Parameters
    ----------
    folder : made when the first one is written
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._serial = 0
        self._written: Written = {}
        self._names: list[set[str]] = []  # files of the last checkpoints

    def save(self, content: Mapping[str, Any]) -> None:
        """Write a checkpoint; only when it is whole are those before the last one removed."""
        self.folder.mkdir(parents=True, exist_ok=True)
        used: Written = {}
        encoded = self._encode(content, used)
        name = f"checkpoint_{self._next():08d}.json"
        text = json.dumps(encoded)
        write_whole(
            self.folder / name,
            json.dumps({"format": FORMAT, "crc": _crc(text)})[:-1] + f', "content": {text}}}\n',
        )
        self._written = used
        self._names = [*self._names[-1:], {name, *(reference[1] for _, reference in used.values())}]
        keep = set().union(*self._names)
        for path in self.folder.iterdir():
            if path.name not in keep:
                path.unlink(missing_ok=True)

    def load(self) -> dict[str, Any] | None:
        """The last checkpoint that is whole; None where there is none. What is saved next replaces it.

        Raises
        ------
        InputError
            There is none, but another version of the program has left one.
        """
        other: _Other | None = None
        for path in _manifests(self.folder):
            try:
                content, used = self._read(path)
            except _Other as found:
                other = other or found
                continue
            except (Damaged, OSError, ValueError, KeyError, TypeError, IndexError):
                continue
            self._serial = max(_numbers(self.folder), default=0)
            self._written = used
            self._names = [{path.name, *(reference[1] for _, reference in used.values())}]
            return content
        if other is not None:
            raise InputError(
                f"given --resume: the checkpoint in {self.folder} is of another version of fem-spa ({other}; "
                f"this one goes on from format {FORMAT}); end the run with that version, or leave out "
                "--resume to start anew"
            )
        return None

    def remove(self) -> None:
        """Remove all of it: the run has ended and needs none. Those that name files go first."""
        for path in [*_manifests(self.folder), *self._files()]:
            path.unlink(missing_ok=True)
        if self.folder.is_dir():
            self.folder.rmdir()

    def _files(self) -> Iterator[Path]:
        if self.folder.is_dir():
            yield from self.folder.iterdir()

    def _next(self) -> int:
        self._serial += 1
        return self._serial

    # -- writing ---------------------------------------------------------------------------------

    def _encode(self, value: Any, used: Written) -> Any:
        if isinstance(value, np.ndarray):
            if value.size <= _SMALL:
                return [_VALUES, value.dtype.str, list(value.shape), value.ravel().tolist()]
            return self._reference(_ARRAY, value, used)
        if isinstance(value, tuple):
            return self._reference(_BLOCK, value, used)
        if isinstance(value, Mapping):
            return {key: self._encode(item, used) for key, item in value.items()}
        if isinstance(value, list):
            return [self._encode(item, used) for item in value]
        return value.item() if isinstance(value, np.generic) else value

    def _reference(self, kind: str, value: Any, used: Written) -> list[Any]:
        known = used.get(id(value)) or self._written.get(id(value))
        if known is None:
            if kind == _ARRAY:
                name = f"{self._next():08d}.npy"
                with whole(self.folder / name) as file:
                    np.save(file, value, allow_pickle=False)
                crc = zlib.crc32(np.ascontiguousarray(value).data.cast("B"))
            else:
                text = json.dumps(self._encode(list(value), used))
                name, crc = f"{self._next():08d}.json", _crc(text)
                write_whole(self.folder / name, text)
            known = (value, [kind, name, crc])
        used[id(value)] = known
        return known[1]

    # -- reading ---------------------------------------------------------------------------------

    def _read(self, path: Path) -> tuple[dict[str, Any], Written]:
        told = json.loads(path.read_text(encoding="utf-8"))
        if told["crc"] != _crc(json.dumps(told["content"])):
            raise Damaged(path.name)
        if told["format"] != FORMAT:
            raise _Other(f"format {told['format']}")
        used: Written = {}
        by_name: dict[str, Any] = {}
        content = self._decode(told["content"], used, by_name)
        return content, used

    def _decode(self, value: Any, used: Written, by_name: dict[str, Any]) -> Any:
        if isinstance(value, Mapping):
            return {key: self._decode(item, used, by_name) for key, item in value.items()}
        if not isinstance(value, list):
            return value
        if value and value[0] == _VALUES:
            _, kind, shape, numbers = value
            return np.array(numbers, dtype=np.dtype(kind)).reshape(shape)
        if value and value[0] in (_ARRAY, _BLOCK):
            kind, name, crc = value
            if name not in by_name:
                by_name[name] = found = self._object(kind, name, crc)
                used[id(found)] = (found, value)
            return by_name[name]
        return [self._decode(item, used, by_name) for item in value]

    def _object(self, kind: str, name: str, crc: int) -> Any:
        """An array or block, once its checksum is right."""
        if not _NAME.fullmatch(name):
            raise Damaged(name)
        if kind == _BLOCK:
            text = (self.folder / name).read_text(encoding="utf-8")
            if _crc(text) != crc:
                raise Damaged(name)
            return tuple(self._decode(json.loads(text), {}, {}))
        array = np.load(self.folder / name, allow_pickle=False)
        if zlib.crc32(np.ascontiguousarray(array).data.cast("B")) != crc:
            raise Damaged(name)
        return array


def _crc(text: str) -> int:
    return zlib.crc32(text.encode("utf-8"))


def _numbers(folder: Path) -> list[int]:
    """Serial numbers of what is there."""
    return [int(found[1]) for path in folder.iterdir() if (found := re.search(r"(\d{8})\.", path.name))]


def _manifests(folder: Path) -> list[Path]:
    """The checkpoints that are there, the last first."""
    return sorted(folder.glob("checkpoint_*.json"), reverse=True) if folder.is_dir() else []


def difference(was: Mapping[str, Any], now: Mapping[str, Any]) -> str | None:
    """What differs between the problem of an earlier run and this one, in words; None where nothing does.

    Parameters
    ----------
    was, now : tables as result.json holds them: `deck`, `mesh_hash`, `materials`. Where files lie does not
        count, what is in them does.
    """
    old, new = _flat(_identity(was)), _flat(_identity(now))
    found = []
    for key in dict.fromkeys([*new, *old]):
        if old.get(key) != new.get(key):
            before, after = (_text(table[key]) if key in table else "nothing" for table in (old, new))
            found.append(f"{key} was {before} and is {after}")
    if not found and was.get("mesh_hash") != now.get("mesh_hash"):
        found.append("the mesh is another one (its points, elements or names)")
    if not found:
        return None
    return "; ".join(found[:3]) + (f"; and {len(found) - 3} more" if len(found) > 3 else "")


def _identity(table: Mapping[str, Any]) -> dict[str, Any]:
    """What makes a problem what it is, as JSON has it."""
    deck = json.loads(json.dumps(table["deck"]))
    deck.get("geometry", {}).pop("file", None)
    for material in deck.get("materials", {}).values():
        material.pop("card", None)
    materials = json.loads(json.dumps(table["materials"]))
    for material in materials.values():
        material.pop("source", None)
    return {**deck, "law": materials}


def _flat(table: Mapping[str, Any], where: str = "") -> dict[str, Any]:
    """Dotted key -> value; lists count as values."""
    out: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, Mapping):
            out |= _flat(value, f"{where}{key}.")
        else:
            out[f"{where}{key}"] = value
    return out


def _text(value: Any) -> str:
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 60 else text[:57] + "..."
