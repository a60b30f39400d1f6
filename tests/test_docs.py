"""What the documents say of the program is true: keys, defaults, decks, links."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from types import UnionType
from typing import Any, Union, get_args, get_origin

import pytest
from pydantic import BaseModel

from fem_spa.deck import Deck, parse_deck
from materials.laws import LAWS

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / name for name in ("README.md", "CHANGELOG.md", "CONTRIBUTING.md")]
PAGES += sorted((ROOT / "docs").glob("*.md"))
DECK_PAGE = (ROOT / "docs" / "deck.md").read_text(encoding="utf-8")


def keys(model: type[BaseModel], where: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted key and default of everything that a deck may say; obstacles count as one key."""
    for name, item in model.model_fields.items():
        kind, dotted = item.annotation, f"{where}{name}"
        while get_origin(kind) in (Union, UnionType):
            kind = next(k for k in get_args(kind) if k is not type(None))
        if get_origin(kind) is dict and issubclass_of_model(get_args(kind)[1]):
            yield from keys(get_args(kind)[1], f"{dotted}.*.")
        elif issubclass_of_model(kind):
            yield from keys(kind, f"{dotted}.")
        else:
            yield dotted, None if item.is_required() else item.default


def issubclass_of_model(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseModel)


def documented() -> dict[str, list[str]]:
    """Key -> the cells of its row in docs/deck.md."""
    rows = [line.strip().strip("|").split("|") for line in DECK_PAGE.splitlines() if line.startswith("| `")]
    return {r[0].strip().strip("`"): [cell.strip() for cell in r[1:]] for r in rows}


def test_every_key_is_documented_and_no_other() -> None:
    tables = {"geometry", "materials", "layers", "supports", "loads", "observe", "solver"}
    told = {key for key in documented() if key.split(".")[0] in tables and "." in key}
    assert told == {key for key, _ in keys(Deck)}


def test_defaults_are_those_of_the_program() -> None:
    for key, default in keys(Deck):
        if default is not None:
            written = str(default) if isinstance(default, float) else json.dumps(default)
            assert documented()[key][1] == f"`{written}`", key


def test_laws_are_documented() -> None:
    for law in LAWS.values():
        row = " ".join(documented()[law.name])
        assert re.findall(r"`(\w+)`", row) == list(law.parameters), law.name


def test_what_a_result_holds_is_documented() -> None:
    from fem_spa.output.folder import WRITTEN
    from fem_spa.run import EXIT

    for name in WRITTEN:
        assert f"`{name}`" in DECK_PAGE, name
    for status, code in EXIT.items():
        assert documented()[status][0] == str(code)


@pytest.mark.parametrize("page", PAGES, ids=[page.name for page in PAGES])
def test_decks_in_the_documents_are_decks(page: Path) -> None:
    for block in re.findall(r"```toml\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL):
        tables = tomllib.loads(block)
        if "loads" in tables:
            parse_deck(tables)


def test_the_deck_of_the_readme_is_the_one_that_was_run() -> None:
    assert (ROOT / "docs" / "finger.toml").read_text(encoding="utf-8") in PAGES[0].read_text(encoding="utf-8")


def test_no_figure_is_left_open() -> None:
    assert "[FIGURE" not in PAGES[0].read_text(encoding="utf-8")


@pytest.mark.parametrize("page", PAGES, ids=[page.name for page in PAGES])
def test_links_lead_somewhere(page: Path) -> None:
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if not target.startswith(("https://", "#")):
            assert (page.parent / target.split("#")[0]).exists(), f"{page.name}: {target}"


def test_pictures_are_small() -> None:
    for picture in (ROOT / "docs" / "pictures").glob("*"):
        assert picture.stat().st_size < 200_000, picture.name
