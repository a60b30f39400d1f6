"""`fem-spa study NAME`: a study that comes with the program; `--list` says what each shows.

A study is a module of `studies/` with `SUMMARY: str` and `run(out: Path) -> int`. Listing reads
the text of the modules and runs none of them.
"""

from __future__ import annotations

import argparse
import ast
import importlib
import importlib.util
import json
import sys
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("name", metavar="NAME", nargs="?", help="the study (see --list)")
    parser.add_argument("--list", action="store_true", help="list the studies and what each shows")
    parser.add_argument("--out", metavar="DIR", help="folder of the results (default: out/<name>)")


def run(arguments: argparse.Namespace) -> int:
    """List, or run one."""
    from fem_spa.errors import InputError

    found = summaries()
    if arguments.list:
        wide = max((len(name) for name in found), default=0)
        for name, text in found.items():
            print(f"{name:<{wide}}  {text}")
        return 0
    from fem_spa.deck import nearest
    from fem_spa.run import output_place

    if arguments.name is None:
        raise InputError(f"a study's name is missing{nearest('', found)}; or give --list")
    if arguments.name not in found:
        raise InputError(f"given {arguments.name}: there is no such study{nearest(arguments.name, found)}")
    out = output_place(arguments.out, arguments.name)
    status = int(importlib.import_module(f"studies.{arguments.name}").run(out))
    tell(out)
    return status


def tell(out: Path) -> None:
    """What belongs beside the study's own words: why it stopped, warnings, where the report is."""
    result = out / "result.json"
    if result.is_file():
        record = json.loads(result.read_text(encoding="utf-8"))
        for warning in record["warnings"]:
            print(f"Note: {warning}")
        if record["status"] != "done":
            print(f"{record['status']}: {record['message']}", file=sys.stderr)
    if (out / "report.html").is_file():
        print(f"See {out / 'report.html'}")


def summaries() -> dict[str, str]:
    """Study -> its SUMMARY, in alphabetical order."""
    package = importlib.util.find_spec("studies")
    places = list(package.submodule_search_locations or []) if package is not None else []
    found = {}
    for place in places:
        for path in sorted(Path(place).glob("*.py")):
            text = _summary(path)
            if text is not None:
                found[path.stem] = text
    return found


def _summary(path: Path) -> str | None:
    """The module's `SUMMARY`, a string literal at its top level; None where it has none."""
    for statement in ast.parse(path.read_text(encoding="utf-8")).body:
        targets = (
            statement.targets if isinstance(statement, ast.Assign) else [getattr(statement, "target", None)]
        )
        value = getattr(statement, "value", None)
        if any(isinstance(t, ast.Name) and t.id == "SUMMARY" for t in targets) and isinstance(
            value, ast.Constant
        ):
            return " ".join(str(value.value).split())
    return None
