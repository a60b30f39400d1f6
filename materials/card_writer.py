"""A card as the text of a TOML file."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from materials.card import Card

HEAD = "# Material card of fem_spa; format: docs/materials.md\n"


def card_toml(card: Card, folder: Path | None = None) -> str:
    """The text of `card`; `load_card` reads the same card back. Moduli are written in MPa.

    folder : where it will lie; a user's law is named by its path from there
    """
    law = card.law.name
    if card.law.file:
        law = card.law.file if folder is None else os.path.relpath(card.law.file, folder.resolve())
    lines = [HEAD, f"name = {_value(card.name)}", f"law = {_value(law)}"]
    if card.density is not None:
        lines.append(f'density = "{card.density:.6g} kg/m^3"')
    lines.append('bulk = "inf"' if math.isinf(card.bulk) else f'bulk = "{card.bulk / 1e6:.9g} MPa"')
    sources = card.source.split("\n")
    lines.append(f"source = {_value(sources if len(sources) > 1 else card.source)}")
    if card.note:
        lines.append(f"note = {_value(card.note)}")
    if card.trusted_stretch is not None:
        lines.append(f"trusted_stretch = {_value(card.trusted_stretch)}")
    lines.append("\n[parameters]")
    for name, value in card.parameters.items():
        scale, unit = (1e6, "MPa") if card.law.parameters[name] == "Pa" else (1.0, "1")
        row: dict[str, Any] = {"value": value / scale, "unit": unit}
        if name in card.intervals:
            row["low"], row["high"] = (v / scale for v in card.intervals[name])
        lines.append(f"{name} = {_value(row)}")
    for title, table in (("fit", card.fit), ("stability", card.stability), ("inelastic", card.inelastic)):
        if table:
            lines.append(f"\n[{title}]")
            lines += [f"{_key(key)} = {_value(value)}" for key, value in table.items() if value is not None]
    return "\n".join(lines) + "\n"


def _key(name: str) -> str:
    return name if name.replace("-", "").replace("_", "").isalnum() and name.isascii() else json.dumps(name)


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float) or hasattr(value, "dtype"):
        text = f"{float(value):.12g}"
        return text if any(c in text for c in ".einf") else text + ".0"
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(k)} = {_value(v)}" for k, v in value.items()) + " }"
    if isinstance(value, list | tuple):
        items = [_value(v) for v in value]
        flat = "[" + ", ".join(items) + "]"
        return flat if len(flat) < 100 else "[\n" + "".join(f"  {item},\n" for item in items) + "]"
    return json.dumps(str(value), ensure_ascii=False)
