"""What a person reads while and after a diagnosis: progress on stderr, the verdict, the figures."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any

from fem_spa.loop.words import SENTENCE


def sentence(report: dict[str, Any]) -> str:
    """The verdict for a person."""
    effects = " and ".join(e["name"] for e in report["effects"])
    rivals = [r for e in report["effects"] for r in e["rivals"]]
    text = SENTENCE[report["verdict"]].format(
        effects=effects or "an effect", rivals=", ".join(dict.fromkeys(rivals)) or "others", why=""
    )
    if report["verdict"] == "ambiguous" and not rivals:
        return f"The records are consistent with {effects}; provisional: there was one record only to fit."
    if report["verdict"] == "none" and report["reasons"]:
        return f"Nothing to add: {report['reasons'][0]}."
    if report["verdict"] == "attributed" and rivals:
        text += f" One output alone cannot tell it from {', '.join(dict.fromkeys(rivals))}."
    return text


def figures(report: dict[str, Any]) -> str:
    """Error before and after on records not used."""
    held, unit = report["error"]["heldout"], report["error"]["unit"]
    if held["before"] is None:
        return "No record was held out."
    return (
        f"Error on records not used: {held['before']:.4g} {unit} before, {held['after']:.4g} {unit} after "
        f"(floor {held['floor']:.4g} {unit}, span {report['error']['span']:.4g} {unit})."
    )


def progress() -> Callable[[str], None]:
    """Progress on stderr: a moving line on a terminal, nothing else elsewhere but one line a stage."""
    begun = time.perf_counter()
    live = sys.stderr.isatty()

    def say(text: str) -> None:
        line = f"{time.perf_counter() - begun:5.1f} s  {text}"
        print(f"\r\033[K{line}" if live else line, end="" if live else "\n", file=sys.stderr, flush=True)

    def done() -> None:
        if live:
            print("\r\033[K", end="", file=sys.stderr, flush=True)

    say.done = done  # type: ignore[attr-defined]
    return say
