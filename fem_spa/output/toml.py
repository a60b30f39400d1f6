"""Plain tables as TOML text: the deck that a result was made from, to run again."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any


def to_toml(tables: Mapping[str, Any], prefix: str = "") -> str:
    """Plain tables as TOML text, scalars before tables."""
    lines, below = [], []
    for key, value in tables.items():
        word = key if key.replace("_", "").replace("-", "").isalnum() and key.isascii() else json.dumps(key)
        if isinstance(value, Mapping) and value:
            below.append(f"\n[{prefix}{word}]\n{to_toml(value, f'{prefix}{word}.')}")
        elif not isinstance(value, Mapping):
            lines.append(f"{word} = {_toml_value(value)}\n")
    return "".join(lines) + "".join(below)


def _toml_value(value: Any) -> str:
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_toml_value(item) for item in value) + "]"
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{json.dumps(k)} = {_toml_value(v)}" for k, v in value.items()) + " }"
    if isinstance(value, float):
        return repr(value) if value == value and abs(value) != float("inf") else str(value)
    return json.dumps(value, ensure_ascii=False)
