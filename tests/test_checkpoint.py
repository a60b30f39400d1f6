"""Checkpoints give back what they were given, write no array twice, and never trust what is not whole."""

from __future__ import annotations

import contextlib
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fem_spa.checkpoint import FORMAT, Checkpoints, difference
from fem_spa.errors import InputError

RNG = np.random.default_rng(0)


def content(step: int, *arrays: np.ndarray) -> dict[str, Any]:
    return {
        "step": step,
        "numbers": [0.1 + 0.2, -0.0, math.inf, 1e-320, None, True, "text"],
        "block": (1.5, "kept"),
        "table": {"a b": {"small": np.array([[1.0, math.nan]]), "whole": np.int64(3)}},
        "arrays": list(arrays),
    }


def same(a: Any, b: Any) -> bool:
    """Equal to the last bit, nan to nan."""
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    if isinstance(a, dict):
        return list(a) == list(b) and all(same(a[k], b[k]) for k in a)
    if isinstance(a, (list, tuple)):
        return type(a) is type(b) and len(a) == len(b) and all(map(same, a, b))
    return bool(a == b)


def test_comes_back_to_the_last_bit(tmp_path: Path) -> None:
    given = content(1, RNG.normal(size=(40, 3)), np.arange(50, dtype=np.int32))
    Checkpoints(tmp_path / "c").save(given)
    assert same(given, Checkpoints(tmp_path / "c").load())


def test_an_array_is_written_once_and_the_last_two_stay(tmp_path: Path) -> None:
    keep, other = RNG.normal(size=100), [RNG.normal(size=100) for _ in range(5)]
    checkpoints = Checkpoints(tmp_path / "c")
    for step, array in enumerate(other):
        checkpoints.save(content(step, keep, array))
        if step == 0:
            first = min((tmp_path / "c").glob("*.npy"))
            written = first.stat().st_mtime_ns
    assert first.stat().st_mtime_ns == written
    names = sorted(path.name for path in (tmp_path / "c").iterdir())
    assert sum(name.startswith("checkpoint_") for name in names) == 2
    assert sum(name.endswith(".npy") for name in names) == 3
    again = Checkpoints(tmp_path / "c")
    assert (again.load() or {})["step"] == 4
    again.save(content(5, keep, other[0]))
    assert same(Checkpoints(tmp_path / "c").load(), content(5, keep, other[0]))
    again.remove()
    assert not (tmp_path / "c").exists()


@pytest.mark.parametrize("what", ["cut", "flipped", "gone", "format", "names"])
def test_the_last_good_one(tmp_path: Path, what: str) -> None:
    """Whatever is wrong with the last, the one before serves; with both gone there is none."""
    checkpoints = Checkpoints(tmp_path / "c")
    for step in range(2):
        checkpoints.save(content(step, RNG.normal(size=100)))
    manifest = max((tmp_path / "c").glob("checkpoint_*"))
    array = max((tmp_path / "c").glob("*.npy"))
    text = manifest.read_text()
    match what:
        case "cut":
            manifest.write_text(text[: len(text) // 2])
        case "flipped":
            data = bytearray(array.read_bytes())
            data[-1] ^= 1
            array.write_bytes(data)
        case "gone":
            array.unlink()
        case "format":
            manifest.write_text(text.replace(f'"format": {FORMAT}', '"format": 0'))
        case _:
            manifest.write_text(text.replace(array.name, "../secret.npy"))
    assert (Checkpoints(tmp_path / "c").load() or {})["step"] == 0
    for path in (tmp_path / "c").glob("*.npy"):
        path.unlink()
    with pytest.raises(InputError, match="format 0") if what == "format" else contextlib.nullcontext():
        assert Checkpoints(tmp_path / "c").load() is None


def test_the_difference_is_named() -> None:
    one: dict[str, Any] = {
        "deck": {"geometry": {"file": "a.msh", "size": "3 mm"}, "loads": {"path": ["1 kPa"]}},
        "mesh_hash": "x",
        "materials": {"body": {"law": "gent", "source": "here"}},
    }
    moved = {
        **one,
        "deck": {**one["deck"], "geometry": {"file": "/b/a.msh", "size": "3 mm"}},
        "materials": {"body": {"law": "gent", "source": "there"}},
    }
    assert difference(one, moved) is None
    assert "mesh" in (difference(one, {**one, "mesh_hash": "y"}) or "")
    other = {**one, "deck": {"geometry": {"size": "2 mm"}, "loads": {"path": []}}}
    words = difference(one, other) or ""
    assert 'geometry.size was "3 mm" and is "2 mm"' in words and 'loads.path was ["1 kPa"] and is []' in words
    assert "law" in (difference(one, {**one, "materials": {"body": {"law": "yeoh"}}}) or "")
