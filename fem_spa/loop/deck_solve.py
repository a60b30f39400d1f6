"""A deck solved as it is and with changes, each once: what was solved is kept in a folder and found again.

A folder of solves has one folder a run, named after the change and the deck, with the deck as it was solved
(`deck.toml`, and the mesh where its walls were moved), all that `fem-spa solve` leaves, and `solved.json`. A
run that was interrupted goes on from its checkpoint.
"""

from __future__ import annotations

import hashlib
import json
import os
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fem_spa.errors import InputError
from fem_spa.output.files import write_whole
from fem_spa.reduced.curve import read_columns
from fem_spa.units import show

if TYPE_CHECKING:
    from fem_spa.deck import Deck

SOLVES = "solves"
"""Folder of the solves in a folder of results."""
MARK = "solved.json"
Rows = tuple[list[str], np.ndarray]
"""Header cells and rows of a curve."""


@dataclass(frozen=True)
class Loaded:
    """Dead loads beside the deck's own: gravity (3,) m/s^2, a force (3,) N on the tip; `label` in words."""

    label: str = "as it is"
    gravity: tuple[float, float, float] | None = None
    tip_force: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class Frame:
    """How the body stands at rest.

    Attributes
    ----------
    along : (3,) from base to tip;  across : (3,) the way that positive angles turn the tip
    tip : (3,) m, centroid of the tip face;  reach : m, from there to the body's end along `across`
    """

    along: np.ndarray
    across: np.ndarray
    tip: np.ndarray
    reach: float

    def down(self, orientation: float) -> np.ndarray:
        """(3,) gravity's way where the rest axis is inclined by `orientation` (rad) against it."""
        return np.asarray(np.cos(orientation) * self.along - np.sin(orientation) * self.across)


@dataclass(frozen=True, eq=False)
class DeckSolve:
    """A deck and what was solved of it.

    Attributes
    ----------
    path : of the deck's file;  deck : as read
    look : folders of solves that may have what is asked for
    known : what was read or solved in this call, and `seconds` that the last solve as it is took
    keep : folder of solves for new ones; None: they are not kept
    say : told of every solve
    """

    path: Path
    deck: Deck
    look: tuple[Path, ...] = ()
    keep: Path | None = None
    say: Callable[[str], None] = lambda text: None
    known: dict[Any, Any] = field(default_factory=dict)

    def rows(self, loaded: Loaded | None = None) -> Rows:
        """The curve under further dead loads.

        Raises
        ------
        InputError
            The deck so loaded is wrong, or gives no curve.
        KeyboardInterrupt
            The run was interrupted; its folder has what was reached.
        """
        loaded = loaded or Loaded()
        if loaded not in self.known:
            self.known[loaded] = self._rows(loaded)
        return self.known[loaded]  # type: ignore[no-any-return]

    def _rows(self, loaded: Loaded) -> Rows:
        deck = self._with(loaded)
        mark = digest(deck)
        own = self.path.parent
        name = f"{loaded.label.replace(' ', '-')}-{mark[:8]}"
        for folder in (own, *(place / name for place in self.look)):
            if _marked(folder) == mark:
                self.known["seconds"] = _seconds(folder)
                return read_columns(folder / "curve.csv")
        what = own.name if own.parent == self.keep else self.path.name
        self.say(f"solving {what} {loaded.label}")
        begun = time.perf_counter()
        if self.keep is None:
            with tempfile.TemporaryDirectory() as place:
                rows = _solved(deck, Path(place), self.path, mark)
            self.known["seconds"] = time.perf_counter() - begun
            return rows
        folder = own if own.parent == self.keep and loaded == Loaded() else self.keep / name
        if folder != own:
            write_deck(deck, folder)
        rows = _solved(deck, folder, self.path, mark)
        self.known["seconds"] = _seconds(folder)
        return rows

    @property
    def seconds(self) -> float:
        """What a solve takes here, s; zero where that is not known."""
        return float(self.known.get("seconds", 0.0))

    def _with(self, loaded: Loaded) -> Deck:
        changes: dict[str, Any] = {}
        if loaded.gravity is not None:
            own = self.deck.loads.gravity or [0.0, 0.0, 0.0]
            changes["gravity"] = [a + b for a, b in zip(own, loaded.gravity, strict=True)]
        if loaded.tip_force is not None:
            held = self.deck.loads.tip_force
            force = [f.si for f in held] if held else [0.0] * 3  # type: ignore[attr-defined]
            changes["tip_force"] = [
                show(float(f"{a + b:.10g}"), "N") if a + b else 0.0
                for a, b in zip(force, loaded.tip_force, strict=True)
            ]
        if not changes:
            return self.deck
        table = self.deck.table()
        return _parsed(self.deck, {**table, "loads": {**table["loads"], **changes}})

    def with_walls(self, scale: float) -> DeckSolve:
        """The deck with walls `scale` times as thick, as `calibrate` moves them; its files are kept.

        Raises
        ------
        InputError
            The mesh has no cavity, or the walls turn an element inside out.
        """
        from fem_spa.calibration.deck_numbers import moved_mesh, numbers

        if "numbers" not in self.known:
            self.known["numbers"] = numbers(self.deck, ["walls.scale"])
        found = self.known["numbers"]
        values = {"walls.scale": scale}
        return self._derived(
            f"walls {scale:.4g} times",
            found.tables(values, "walls.msh"),
            lambda folder: moved_mesh(found, values, folder / "walls.msh"),
        )

    def with_plane(self, point: np.ndarray, normal: np.ndarray, label: str) -> DeckSolve:
        """The deck with a plane in the way, `point` (3,) m and `normal` (3,) towards the body."""
        table = self.deck.table()
        plane = {
            "point": [show(float(f"{x:.8g}"), "m") if abs(x) > 1e-12 else "0 mm" for x in point],
            "normal": [float(f"{x:.10g}") for x in normal],
        }
        loads = table["loads"]
        loads = {**loads, "obstacles": [*(loads.get("obstacles") or []), {"plane": plane}]}
        return self._derived(label, {**table, "loads": loads}, lambda folder: None)

    def with_base(self, compliance: float) -> DeckSolve:
        """The deck on a base of that compliance, rad/(N m)."""
        table, text = self.deck.table(), f"{np.degrees(compliance):.6g}"
        supports = {**table.get("supports", {}), "base_compliance": f"{text} deg/(N*m)"}
        label = f"base {text} deg a Nm"
        found = self._derived(label, {**table, "supports": supports}, lambda folder: None)
        return replace(found, known={"frame": self.frame()})  # by pressure alone both stand alike

    def moment(self, pull: float, tip: float) -> float:
        """N m about the base of the level body at rest, its weight at `pull` m/s^2, a force of `tip` N on its
        end; zero without both.

        Raises
        ------
        InputError
            `pull` is not zero, and a material has no density.
        """
        from fem_spa.prepare import prepare
        from fem_spa.solid.base_spring import at_rest

        return at_rest(prepare(self.deck).problem, pull, tip) if pull or tip else 0.0

    def _derived(self, label: str, table: dict[str, Any], files: Callable[[Path], None]) -> DeckSolve:
        """A deck with a folder of its own, its files in it; found again where it is there already."""
        key = hashlib.sha256(json.dumps([digest(self.deck), label]).encode()).hexdigest()
        name = f"{label.replace(' ', '-')}-{key[:8]}"
        for place in self.look:
            path = place / name / "deck.toml"
            if path.is_file():
                return self._at(path)
        if self.keep is None:
            raise InputError(f"{self.path.name}: a deck that is changed needs a folder; give --out")
        folder = self.keep / name
        folder.mkdir(parents=True, exist_ok=True)
        files(folder)
        geometry = table["geometry"]
        own = folder if (folder / str(geometry.get("file"))).is_file() else self.deck.folder
        write_deck(_parsed(self.deck, table), folder, own)
        return self._at(folder / "deck.toml")

    def _at(self, path: Path) -> DeckSolve:
        from fem_spa.deck import read_deck

        deck = read_deck(path)
        meshes = self.deck.meshes
        return replace(self, path=path, deck=deck if meshes is None else deck.with_meshes(meshes), known={})

    def frame(self) -> Frame | None:
        """How the body stands; None where nothing turns, or there is no tip."""
        from fem_spa.prepare import prepare
        from fem_spa.solid.observables import Angle
        from fem_spa.solid.space import build_space

        if "frame" in self.known:
            return self.known["frame"]  # type: ignore[no-any-return]
        columns, rows = self.rows()
        problem = prepare(self.deck).problem
        space = build_space(problem.mesh)
        angle = Angle(problem, space)
        found = None
        if angle.known:
            tip = angle.tip(np.zeros((space.n_nodes, 3)))
            way = 1e-3 * rows[:, [columns.index(f"tip {axis} [mm]") for axis in "xyz"]]
            far = way[-1] - way[0]
            across = far - (far @ angle.along) * angle.along
            size = float(np.linalg.norm(across))
            if size > 1e-3 * float(np.ptp(space.points @ angle.along)):
                turned = rows[-1, columns.index("angle [deg]")]
                across *= (-1.0 if turned < 0 else 1.0) / size
                reach = float(((space.points - tip) @ across).max())
                found = Frame(angle.along, across, tip, reach)
        self.known["frame"] = found
        return found


def _solved(deck: Deck, folder: Path, path: Path, mark: str) -> Rows:
    """Run a deck in a folder, or go on with it there, and mark it."""
    from fem_spa.run import run_deck

    quiet, begun = not sys.stderr.isatty(), time.perf_counter()
    try:
        outcome = run_deck(deck, folder, quiet=quiet, resume=True)
    except InputError:
        if not (folder / "checkpoint").exists():
            raise
        outcome = run_deck(deck, folder, quiet=quiet)  # its checkpoint is of a mesh that is no longer there
    status = str(outcome.record.get("status"))
    if status == "interrupted":
        raise KeyboardInterrupt
    curve = folder / "curve.csv"
    if not curve.is_file():
        raise InputError(f"the deck {path} gives no curve; see what `fem-spa solve {path.name}` says")
    told = {"digest": mark, "status": status, "seconds": round(time.perf_counter() - begun, 1)}
    write_whole(folder / MARK, json.dumps(told) + "\n")
    return read_columns(curve)


def _marked(folder: Path) -> str | None:
    """Digest of the deck that was solved in a folder, to its end."""
    try:
        found = json.loads((folder / MARK).read_text(encoding="utf-8"))["digest"]
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return str(found) if (folder / "curve.csv").is_file() else None


def _seconds(folder: Path) -> float:
    """What a marked solve took."""
    try:
        return float(json.loads((folder / MARK).read_text(encoding="utf-8"))["seconds"])
    except (OSError, ValueError, KeyError, TypeError):
        return 0.0


def _parsed(deck: Deck, table: dict[str, Any]) -> Deck:
    from fem_spa.deck import parse_deck

    return parse_deck(table, deck.name, deck.folder, deck.meshes)


def digest(deck: Deck) -> str:
    """What a deck is: its tables, files by what is in them."""
    table = json.loads(json.dumps(deck.table()))
    for _, holder, key in _files(table):
        path = deck.folder / str(holder[key])
        if path.is_file():
            holder[key] = hashlib.sha256(path.read_bytes()).hexdigest()
    return hashlib.sha256(json.dumps(table, sort_keys=True).encode()).hexdigest()


def _files(table: dict[str, Any]) -> list[tuple[str, dict[str, Any], str]]:
    """Places in a deck's tables that may name a file."""
    found = [("geometry", table["geometry"], "file")] if "file" in table["geometry"] else []
    return found + [
        (n, m, k) for n, m in table.get("materials", {}).items() for k in ("card", "law") if k in m
    ]


def write_deck(deck: Deck, folder: Path, own: Path | None = None) -> None:
    """`deck.toml` in a folder, the files it names as seen from there; `own`: where its paths start."""
    from fem_spa.output.toml import to_toml

    table = json.loads(json.dumps(deck.table()))
    start = deck.folder if own is None else own
    for name, holder, key in _files(table):
        path = (start if name == "geometry" else deck.folder) / str(holder[key])
        if path.is_file():
            holder[key] = os.path.relpath(path.resolve(), folder.resolve())
    folder.mkdir(parents=True, exist_ok=True)
    write_whole(folder / "deck.toml", to_toml(table))
