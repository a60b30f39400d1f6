"""report.html of a diagnosis: one page for a person, first the verdict."""

from __future__ import annotations

import html
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fem_spa.output.files import write_whole

if TYPE_CHECKING:
    from fem_spa.loop.diagnose import Study


def write_page(study: Study, report: dict[str, Any], out: Path) -> None:
    """Write the page."""
    from fem_spa.loop.diagnose import sentence

    write_whole(out / "report.html", f"<!doctype html><p>{html.escape(sentence(report))}</p>")
