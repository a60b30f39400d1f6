"""The sentences of a result: what the pictures, the report and the last line on the terminal say alike."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from fem_spa.solid.problem import Problem, Result, Row

VERDICT = {
    "done": "Done",
    "limit": "Stopped: the load cannot be borne",
    "diverged": "Stopped: no equilibrium was found",
    "interrupted": "Interrupted",
}


def number(value: float, digits: int = 4) -> str:
    """A number as people write it: four significant digits, no exponent for everyday sizes."""
    if not math.isfinite(value):
        return "none"
    if value == 0.0 or 1e-3 <= abs(value) < 1e6:
        decimals = digits if value == 0.0 else max(0, digits - 1 - math.floor(math.log10(abs(value))))
        text = f"{value:.{decimals}f}"
        text = text.rstrip("0").rstrip(".") if "." in text else text
        return "0" if text == "-0" else text
    return f"{value:.{digits}g}"


def pressures(values: Mapping[str, float], digits: int = 4) -> str:
    """Pressures in kPa: "20 kPa", or "slow 40 kPa, fast 20 kPa"."""
    if len(values) == 1:
        return f"{number(next(iter(values.values())) / 1e3, digits)} kPa"
    if len(values) > 1 and len({f"{value:.9g}" for value in values.values()}) == 1:
        return f"{number(next(iter(values.values())) / 1e3, digits)} kPa in {', '.join(values)}"
    return ", ".join(
        f"{name}{':' if name[-1:].isdigit() else ''} {number(value / 1e3, digits)} kPa"
        for name, value in values.items()
    )


def millimetres_cubed(volume: float) -> str:
    """A volume, ml where it is large: "29.3 ml", "412 mm³"."""
    return f"{number(volume * 1e6)} ml" if abs(volume) >= 1e-6 else f"{number(volume * 1e9)} mm³"


def end_wanted(problem: Problem) -> str:
    """The end of the load path that the deck asks for."""
    point, control = problem.loads.points[-1], problem.loads.control
    if control == "pressure":
        return pressures(point)
    if control == "volume":
        return f"an enclosed volume of {millimetres_cubed(sum(point.values()))}"
    return f"gas mass times {', '.join(number(value) for value in point.values())}"


def by_stroke(problem: Problem, row: Row) -> bool:
    """Whether its stroke is what it does: a linear shape, or planes of symmetry keep it straight."""
    if row.motion is None or row.step == 0:
        return False
    return problem.linear or (row.angle == 0.0 and row.motion.chord == 0.0)


def held(problem: Problem) -> bool:
    """Whether the tip stays where the deck puts it, so that only its force tells anything."""
    return problem.blocked or problem.loads.tip_displacement is not None


def done(problem: Problem, row: Row) -> str | None:
    """The stroke in mm where it is what the actuator does, else the angle; None where the deck says it is 0,
    and without a tip."""
    if row.motion is not None and by_stroke(problem, row):
        moved = 1e3 * row.motion.extension
        return None if held(problem) and abs(moved) < 1e-6 else f"{number(moved, 3)} mm"
    return f"{number(math.degrees(row.angle), 3)}°" if math.isfinite(row.angle) else None


def outcome(problem: Problem, row: Row) -> str:
    """What a row shows in a few words: its angle or stroke, or its volume where there is no tip."""
    did = done(problem, row)
    parts = []
    if did is not None:
        parts.append(f"the tip has {'moved' if by_stroke(problem, row) else 'turned'} by {did}")
    elif row.force is None:
        parts.append(f"{millimetres_cubed(row.volume)} are enclosed")
    if row.force is not None:
        parts.append(f"the held tip pushes with {number(row.force)} N")
    words = " and ".join(parts)
    if row.obstacle_force is not None and len(row.obstacle_force):
        forces = np.linalg.norm(np.reshape(row.obstacle_force, (len(row.obstacle_force), -1)), axis=1)
        each = ", ".join(f"{number(float(force), 3)} N" for force in forces)
        words += f"; on the obstacle{'s' if len(forces) > 1 else ''} press {each}"
    return words


def verdict(problem: Problem, result: Result, rows: Sequence[Row]) -> str:
    """One sentence: did it reach its end, and what is there."""
    head = VERDICT.get(result.status, result.status)
    if not rows:
        return f"{head}, before the first load step."
    last = rows[-1]
    if result.status == "done":
        sentence = f"{head}: at {pressures(last.pressure)} {outcome(problem, last)}."
    else:
        sentence = (
            f"{head}: reached {pressures(last.pressure)} of {end_wanted(problem)}; "
            f"there {outcome(problem, last)}."
        )
    if result.touch_pressure:
        first = pressures(result.touch_pressure, 3)
        if ended_at_touch(result):
            sentence = f"{sentence[:-1]}; walls touch at {first}, and the path ends before, as asked."
        elif holds(problem):
            sentence += f" First touch at {first}."
        else:
            sentence += f" Contact is off: walls pass through one another from {first} on."
    peak = highest(rows)
    if peak is not None:
        sentence += f" The pressure had its highest value, {pressures(peak.pressure)}, on the way."
    return sentence


def highest(rows: Sequence[Row]) -> Row | None:
    """The row of a limit point: the highest pressure of a single cavity, where the path falls after it."""
    if not rows or len(rows[0].pressure) != 1:
        return None
    values = [next(iter(row.pressure.values())) for row in rows]
    top = max(range(len(values)), key=values.__getitem__)
    return rows[top] if top + 1 < len(values) and values[top] > 1.001 * max(values[-1], 0.0) else None


def ended_at_touch(result: Result) -> bool:
    """Whether the path ended before walls would pass through one another (`solver.stop_at_touch`)."""
    return result.status == "done" and bool(result.touch_pressure) and "path ends there" in result.message


def holds(problem: Problem) -> bool:
    """Whether a touch is simulated: walls, or walls and obstacles, cannot pass through one another."""
    return problem.contact or bool(problem.obstacles)


def touch(problem: Problem, result: Result) -> str | None:
    """The sentence of a warning about walls that touch; None where they do not, or contact holds them."""
    if not result.touch_pressure or problem.contact:
        return None
    if ended_at_touch(result):
        return f"{result.message[0].upper()}{result.message[1:]}. Contact is switched off."
    first = pressures(result.touch_pressure, 3)
    if problem.obstacles:
        return (
            f"First touch at {first}. The obstacles hold, but the body's contact with itself is switched "
            "off: where its walls pass through one another the curve is not to be trusted."
        )
    return (
        f"Walls touch from {first} on, and contact is switched off: beyond that pressure the curve is "
        "that of walls which pass through one another, and not to be trusted. Try loads.contact = true."
    )


def all_warnings(problem: Problem, result: Result) -> list[str]:
    """Every warning once; that of touching walls first."""
    first = touch(problem, result)
    said = any("touch" in text or "pass through" in text for text in result.warnings)
    return list(dict.fromkeys([*([first] if first and not said else []), *result.warnings]))
