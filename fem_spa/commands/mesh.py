"""`fem-spa mesh DECK.toml`: the mesh of a deck, and what is in it."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import Any

UNIT = "mm"
"""Of the numbers in the file: a deck that reads it says unit = "mm"."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments; the shapes are listed below the help, from their metadata."""
    parser.add_argument("deck", metavar="DECK.toml", help="the deck; only its [geometry] is used")
    parser.add_argument(
        "--set", metavar="KEY=VALUE", action="append", default=[], help="replace a value of the deck"
    )
    parser.add_argument(
        "--out",
        metavar="FILE.msh|.vtu",
        type=Path,
        help="the file to write (default: out/<name of the deck>/<name of the deck>.msh)",
    )
    parser.epilog = shapes_help()


def shapes_help() -> str:
    """Every built-in shape: its parameters, defaults, ranges and meaning."""
    from geometry.parameters import parameters
    from geometry.registry import SHAPES

    lines = ["built-in shapes and their parameters (keys of [geometry]):"]
    for name, shape in SHAPES.items():
        lines += ["", f'shape = "{name}"    {shape.title}', f"    from: {shape.source}"]
        lines += [f"    element size by default: {shape.default_size * 1e3:g} mm (size = ...)", ""]
        items = parameters(shape)
        wide = max(len(item.name) for item in items)
        for item in items:
            symbol = f" ({item.symbol})" if item.symbol else ""
            lines.append(
                f"    {item.name:<{wide}}  {item.default_text:>8}   {item.doc}{symbol}; {item.range_text}"
            )
    lines += ["", 'or a file of your own: file = "finger.msh" (or .step), unit = "mm"']
    return "\n".join(lines)


def run(arguments: argparse.Namespace) -> int:
    """Mesh and write; a summary goes to stdout."""
    from fem_spa.deck import read_drawing
    from fem_spa.errors import InputError
    from fem_spa.prepare import make_mesh
    from fem_spa.run import refuse_place

    deck = read_drawing(arguments.deck, arguments.set)
    out = arguments.out or Path("out") / deck.name / f"{deck.name}.msh"
    if out.suffix not in (".msh", ".vtu"):
        raise InputError(f"given {out} for --out: the file's ending must be .msh or .vtu")
    if os.path.isdir(out):
        raise InputError(f"given {out} for --out: this is a folder; give a file ending in .msh or .vtu")
    refuse_place(out.parent)
    mesh = make_mesh(deck)
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        write_mesh(out, mesh)
    except OSError as error:
        raise InputError(
            f"given {out} for --out: it cannot be written ({error.strerror}); give another file"
        ) from None
    print(summary(mesh))
    print(f"See {out} (numbers in {UNIT})")
    return 0


def write_mesh(out: Path, mesh: Any) -> None:
    """Write beside the file's name, then rename: a reader finds it whole or not at all."""
    from geometry.files import write_mesh as write

    part = out.with_name(f".{out.stem}.part{out.suffix}")
    try:
        write(mesh, part, UNIT)
        part.replace(out)
    finally:
        part.unlink(missing_ok=True)


def summary(mesh: Any) -> str:
    """Counts, size and named groups in words."""
    size = " x ".join(f"{1e3 * s:.4g}" for s in mesh.points.max(axis=0) - mesh.points.min(axis=0))
    lines = [f"{mesh.source or 'mesh'}: {len(mesh.tets)} tetrahedra, {len(mesh.points)} nodes, {size} mm"]
    lines += [f"  volume  {name}: {len(found)} tetrahedra" for name, found in sorted(mesh.volumes.items())]
    lines += [f"  surface {name}: {len(found)} triangles" for name, found in sorted(mesh.surfaces.items())]
    return "\n".join([*lines, *(f"  note: {note}" for note in mesh.notes)])
