"""What the pages of all commands have in common: shell, tiles, facts, notes, pictures."""

from __future__ import annotations

import base64
import html
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from fem_spa.output.report_style import STYLE


def escaped(value: Any) -> str:
    """A value as text that HTML shows as it is."""
    return html.escape(str(value))


def document(name: str, sections: Iterable[str], style: str = "", script: str = "") -> str:
    """A whole page.

    Parameters
    ----------
    name : stands in its title;  sections : HTML, in order;  style, script : besides the common ones
    """
    behind = f"<script>{script}</script>" if script else ""
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        f"<title>{escaped(name)} - fem_spa</title>"
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<style>{STYLE}{style}</style></head>\n"
        f"<body><main>\n{''.join(sections)}</main>{behind}</body></html>\n"
    )


def tiles(pairs: Iterable[tuple[str, str]]) -> str:
    """Labels and the numbers that people look for first, in large."""
    cells = "".join(
        f"<div><strong>{escaped(value)}</strong><span>{escaped(label)}</span></div>" for label, value in pairs
    )
    return f'<section class="tiles">{cells}</section>\n'


def facts(pairs: Iterable[tuple[str, str]]) -> str:
    """A table of names and what there is to say of each, as HTML."""
    rows = "".join(f"<tr><th>{escaped(name)}</th><td>{value}</td></tr>" for name, value in pairs)
    return f"<table>{rows}</table>"


def notes(title: str, items: Sequence[str]) -> str:
    """A list that must not be overlooked, its items HTML; nothing where it is empty."""
    if not items:
        return ""
    rows = "".join(f"<li>{item}</li>" for item in items)
    return f'<section class="warnings"><h2>{escaped(title)}</h2><ul>{rows}</ul></section>\n'


def pictures(folder: Path, words: Iterable[tuple[str, str]]) -> str:
    """Pictures with their captions, held as data.

    Parameters
    ----------
    words : name of a .png in `folder`, and what it shows; one that is not there is left out. Its `figure` has
        the name without .png as class
    """
    figures = []
    for file, caption in words:
        picture = folder / file
        if picture.is_file():
            data = base64.b64encode(picture.read_bytes()).decode("ascii")
            figures.append(
                f'<figure class="{picture.stem}"><img alt="{escaped(caption)}" '
                f'src="data:image/png;base64,{data}"><figcaption>{escaped(caption)}</figcaption></figure>'
            )
    return f'<section class="pictures">{"".join(figures)}</section>\n' if figures else ""
