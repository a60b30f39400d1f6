"""report.html: one self-contained page. First the verdict, then what one would ask next."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from fem_spa.output.files import write_whole
from fem_spa.output.page import document, escaped, facts, notes, pictures, tiles
from fem_spa.output.table import columns, header, obstacle_forces, values
from fem_spa.output.toml import to_toml
from fem_spa.output.words import by_stroke, done, number, pressures, verdict
from fem_spa.solid.obstacles import Cylinder, Obstacle, Plane
from fem_spa.solid.problem import Problem, Result, Row
from fem_spa.units import show

MOST_ROWS = 24
PICTURES = (
    ("shape.png", "Deformed shape, and in grey the shape at rest, seen on the bending plane."),
    ("curve.png", "Dots are converged load steps, rings the load points that the deck names."),
)


def write_report(path: Path, problem: Problem, result: Result, record: Mapping[str, Any]) -> None:
    """Write the page beside curve.png and shape.png, which it holds as data.

    Parameters
    ----------
    path : the .html
    record : content of result.json
    """
    name = path.parent.resolve().name
    sections = [
        _verdict(problem, result, name),
        _tiles(problem, result),
        notes("To know beside the curve", [escaped(text) for text in record["warnings"]]),
        pictures(path.parent, PICTURES),
        _table(problem, result.rows),
        _what_was_run(problem, record),
        _again(record["deck"]),
        _cost(record),
    ]
    write_whole(path, document(name, sections))


def _verdict(problem: Problem, result: Result, name: str) -> str:
    kind = result.status if result.status in ("done", "interrupted") else "stopped"
    message = f"<p>{escaped(result.message)}</p>" if result.message and result.status != "done" else ""
    return (
        f'<header class="{kind}"><p class="name">{escaped(name)}: a finite-element run of fem_spa</p>'
        f"<h1>{escaped(verdict(problem, result, result.rows))}</h1>{message}</header>\n"
    )


def _tiles(problem: Problem, result: Result) -> str:
    """The numbers that people look for first."""
    if not result.rows:
        return ""
    last = result.rows[-1]
    numbers = [("pressure at the end", pressures(last.pressure))]
    did = done(problem, last)
    if did is not None:
        numbers.append(("stroke of the tip" if by_stroke(problem, last) else "bending angle", did))
    if last.force is not None:
        numbers.append(("force of the held tip", f"{number(last.force)} N"))
    numbers.append(("largest stretch in the rubber", f"{number(last.max_stretch, 3)} times"))
    for k, force in enumerate(obstacle_forces(last, len(problem.obstacles))):
        numbers.append((f"force on obstacle {k + 1}", f"{number(force)} N"))
    if result.touch_pressure:
        numbers.append(("first touch at", pressures(result.touch_pressure, 3)))
    for row in result.rows:
        if row.step == result.unstable_step:
            held = "" if problem.loads.control == "pressure" else "with pressure held "
            numbers.append((f"{held}not stable from", pressures(row.pressure, 3)))
    numbers.append(("enclosed air", f"{number(last.volume * 1e6)} ml"))
    return tiles(numbers)


def _table(problem: Problem, rows: Sequence[Row]) -> str:
    """curve.csv; a long one shows the named load points, and all of it on demand."""
    if not rows:
        return ""
    if len(rows) <= MOST_ROWS:
        return f"<section><h2>The curve in numbers</h2>{_rows(problem, rows)}</section>\n"
    named = [row for row in rows if row.is_point]
    few = _rows(problem, named) if named else ""
    return (
        f"<section><h2>The curve in numbers</h2>{few}"
        f"<details><summary>all {len(rows)} steps (curve.csv)</summary>"
        f"{_rows(problem, rows)}</details></section>\n"
    )


def _rows(problem: Problem, rows: Sequence[Row]) -> str:
    """The rows as a table; a column without a number (the angle of a body without tip) is left out."""
    chosen = replace(columns(problem), motion=False, chord=False)  # the page has the deck's angle
    if problem.symmetry:
        chosen = replace(chosen, leans=False)  # which says the way, too
    names = header(chosen)
    numbers = [values(row, chosen) for row in rows]
    shown = [i for i in range(len(names)) if any(math.isfinite(row[i]) for row in numbers)]
    head = "".join(f"<th>{escaped(names[i])}</th>" for i in shown)
    body = "".join(
        f'<tr class="{"point" if row.is_point else ""}">'
        + "".join(f"<td>{_cell(names[i], cells[i])}</td>" for i in shown)
        + "</tr>"
        for row, cells in zip(rows, numbers, strict=True)
    )
    table = f'<table class="numbers"><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>'
    return f'<div class="scroll">{table}</div>'


def _cell(name: str, value: float) -> str:
    """A number with as many decimals as its column needs."""
    decimals = {"angle [deg]": 2, "volume [mm^3]": 0, "max stretch": 3}.get(
        name, 2 if name.startswith("tip ") else None
    )
    return number(value, 5) if decimals is None or value != value else f"{value:.{decimals}f}"


def _what_was_run(problem: Problem, record: Mapping[str, Any]) -> str:
    mesh, loads = record["mesh"], problem.loads
    pairs: list[tuple[str, Any]] = [
        (
            "mesh",
            f"{escaped(mesh['source'])}<br>{record['elements']} ten-node tetrahedra, "
            f"{record['dofs']} unknowns <small>sha256 {mesh['hash'][:16]}</small>",
        )
    ]
    pairs += [("", escaped(note)) for note in mesh["notes"]]
    pairs += [(f"material of {name}", _material(table)) for name, table in record["materials"].items()]
    for name, layer in problem.layers.items():
        words = f"membrane, modulus {show(layer.modulus, 'Pa')}, thickness {show(layer.thickness, 'm')}"
        pairs.append((f"layer {name}", escaped(f"{words}, Poisson's ratio {number(layer.poisson)}")))
    pairs.append(
        ("held", escaped(", ".join([*problem.fixed, *(["tip"] if problem.blocked else [])]) or "nothing"))
    )
    if problem.symmetry:
        planes = ", ".join(f"{surface} (normal {axis})" for surface, axis in problem.symmetry.items())
        pairs.append(("symmetry", escaped(f"{planes}; forces and volumes are those of the whole")))
    points = "1 load point" if len(loads.points) == 1 else f"{len(loads.points)} load points"
    pairs.append(("driven by", escaped(f"{loads.control}, {points}")))
    if any(loads.gravity):
        pairs.append(("gravity", escaped(", ".join(number(g) for g in loads.gravity) + " m/s²")))
    if any(loads.tip_force):
        pairs.append(("force on the tip", escaped(", ".join(number(f) for f in loads.tip_force) + " N")))
    pairs.append(("contact", escaped(_contact(problem))))
    pairs += [(f"obstacle {k + 1}", escaped(_obstacle(o))) for k, o in enumerate(problem.obstacles)]
    return f"<section><h2>What was run</h2>{facts(pairs)}</section>\n"


def _contact(problem: Problem) -> str:
    if problem.contact:
        return "on: frictionless, of the whole boundary with itself; nothing passes through anything"
    return (
        "switched off: walls may pass through one another; they are watched, and what they do is said above"
    )


def _obstacle(obstacle: Obstacle) -> str:
    """A rigid body in words, mm."""

    def place(point: Sequence[float]) -> str:
        return "(" + ", ".join(number(1e3 * c) for c in point) + ") mm"

    def direction(d: Sequence[float]) -> str:
        return "(" + ", ".join(number(c) for c in d) + ")"

    if isinstance(obstacle, Plane):
        return f"plane through {place(obstacle.point)}, normal {direction(obstacle.normal)}"
    if isinstance(obstacle, Cylinder):
        size = number(1e3 * obstacle.radius)
        return f"cylinder, radius {size} mm, axis {direction(obstacle.axis)} through {place(obstacle.point)}"
    if isinstance(obstacle.radius, tuple):
        return f"ellipsoid round {place(obstacle.centre)}, semi-axes {place(obstacle.radius)}"
    return f"sphere round {place(obstacle.centre)}, radius {number(1e3 * obstacle.radius)} mm"


def _material(table: Mapping[str, Any]) -> str:
    numbers = ", ".join(
        f"{key} {show(item['value'], item['unit'])}" for key, item in table["parameters"].items()
    )
    bulk = table["bulk"]["value"]
    squeeze = "incompressible" if bulk == "inf" else f"bulk modulus {show(bulk, 'Pa')}"
    density = "" if table["density"] is None else f", {number(table['density']['value'])} kg/m³"
    young = show(float(f"{table['youngs_modulus']['value']:.4g}"), "Pa")
    words = f"{table['law']}: {numbers}; {squeeze}{density}; Young's modulus at rest {young}"
    return f"{escaped(words)}<br><small>source: {escaped(table['source'])}</small>"


def _again(deck: Mapping[str, Any]) -> str:
    return (
        "<section><h2>How to run it again</h2><p>Save this deck as <code>again.toml</code>; "
        "every default is written out."
        "</p><pre>fem-spa solve again.toml --out again</pre>"
        f"<details><summary>the deck</summary><pre>{escaped(to_toml(deck).strip())}</pre></details>"
        "</section>\n"
    )


def _cost(record: Mapping[str, Any]) -> str:
    seconds = ", ".join(f"{name} {number(value, 3)} s" for name, value in record["seconds"].items() if value)
    memory = record["peak_rss_mb"]
    pairs = [
        (
            "work",
            f"{record['steps']} steps, {record['newton_iterations']} Newton iterations, "
            f"{record['factorizations']} factorizations",
        ),
        ("time", seconds),
        *([("memory", f"{memory:.0f} MB at most")] if memory else []),
        ("versions", escaped(", ".join(f"{name} {text}" for name, text in record["versions"].items()))),
        (
            "files beside this page",
            "curve.csv, centre_line.csv, result.json, fields.pvd (open in ParaView), curve.png, shape.png",
        ),
    ]
    return f"<section><h2>What it took</h2>{facts(pairs)}</section>\n"
