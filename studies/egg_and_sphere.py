"""The two grasps of the composite-finger paper, printed numbers beside ours: egg pinched, sphere held."""

from __future__ import annotations

import io
import math
import textwrap
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import brentq

from fem_spa.output.files import write_whole
from fem_spa.reduced.curvature import along, pose, tip
from fem_spa.reduced.curvature_inverse import Reach, inverse
from fem_spa.reduced.finger import Finger, finger
from fem_spa.reduced.gripper import EGG_BASE, EGG_GLOBAL, RADIUS, SPHERE_GLOBAL, gripper

SUMMARY = "the paper's two grasps, egg and sphere of 100 mm: printed angles, pressures and points beside ours"
EGG_PRESSURE = np.array([[20e3, 13.9e3]])
EGG_ANGLE = 100.4
SPHERE_PRESSURE = 28.7e3
SPHERE_CHAMBER = 7
SPHERE_RADIUS = 50e-3
EGG_AXES = (22e-3, 28.5e-3)
"""m: half axes of an egg, across and along the approach, for the picture; chosen, the paper prints none."""
HEIGHT = 22e-3
"""m: of both modules over the paper, t1 + h1 + r2 and t1 + h2 + r4, for the picture."""
VARIANTS: dict[str, dict[str, str]] = {
    "(7), crowns": {},
    "(8), crowns": {"stress": "linear"},
    "(8), (20) as printed": {"stress": "linear", "reading": "printed"},
    "cantilever": {"method": "cantilever"},
}


def run(out: Path) -> int:
    """Print both examples, write egg_and_sphere.csv and a picture of finger and object."""
    out.mkdir(parents=True, exist_ok=True)
    rows: list[tuple[str, float, float, str]] = []
    model = finger()
    egg = _egg(model, rows)
    sphere = _sphere(model, rows)
    lines = ["quantity,printed,ours,unit"]
    lines += [f'"{name}",{printed:.6g},{ours:.6g},{unit}' for name, printed, ours, unit in rows]
    write_whole(out / "egg_and_sphere.csv", "\n".join(lines) + "\n")
    _draw(out / "egg_and_sphere.png", model, egg, sphere)
    return 0


def _egg(model: Finger, rows: list[tuple[str, float, float, str]]) -> Reach:
    both = gripper(model)
    point = both.to_base(np.array(EGG_GLOBAL), 2)
    for name, printed, ours in zip("xyz", EGG_BASE, point, strict=True):
        rows.append((f"egg: point A in finger 2, {name}", 1e3 * printed, 1e3 * ours, "mm"))
    print(f"Egg. Point A in finger 2's frame: ours {_mm(point)}, printed {_mm(np.array(EGG_BASE))} mm")
    print(f"(the roots' radius, {1e3 * RADIUS:.2f} mm, is taken from it).")
    print(f"Angle at 20 and 13.9 kPa, printed {EGG_ANGLE} deg:")
    print(f"{'':24} {'slow':>7} {'fast':>7} {'total':>7}   less 100.4")
    for name, words in VARIANTS.items():
        beta, alpha = np.degrees(finger(**words).module_angles(EGG_PRESSURE)[0])
        total = beta + alpha
        print(f"{name:24} {beta:7.1f} {alpha:7.1f} {total:7.1f}   {total - EGG_ANGLE:+.1f}")
        rows.append((f"egg: angle at 20 and 13.9 kPa {name}", EGG_ANGLE, total, "deg"))
    paragraph(
        "theta_2 of (20) is half the opening of a bulged lateral wall; a chamber's turn follows from "
        "the contact of neighbours and is half of it (fem_spa/reduced/finger_fast.py). The print "
        "takes theta_2 for the turn."
    )
    beta = float(model.module_angles(EGG_PRESSURE)[0, 0])
    needed = float(model.pressures(np.array([[beta, math.radians(EGG_ANGLE) - beta]]))[0, 1])
    rows.append(("egg: fast pressure for 100.4 deg at 20 kPa", 13.9, needed / 1e3, "kPa"))
    print(f"Fast pressure for 100.4 deg at 20 kPa: ours {needed / 1e3:.1f}, printed 13.9 kPa.")
    there = tip(*model.chain(model.module_angles(EGG_PRESSURE)))[0]
    away = 1e3 * float(np.linalg.norm(there - EGG_BASE))
    print(f"At 20 and 13.9 kPa our tip is at {_mm(there)} mm, {away:.1f} mm from the printed point.")
    rows.append(("egg: tip from point A at 20 and 13.9 kPa", 0.0, away, "mm"))
    slow, fast, angles = printed_lengths()
    paragraph(
        "A total angle alone does not say where the tip is: the modules may share it in many ways. "
        f"Printed point and angle go together with a slow module of {1e3 * slow:.1f} mm at "
        f"{np.degrees(angles[0]):.1f} deg and a fast one of {1e3 * fast:.1f} mm at "
        f"{np.degrees(angles[1]):.1f} deg: its own length with the gaps ((28) as printed has 30 mm), "
        "but nine times 7 mm where Table 1 has l1 = 9 mm. With the table's lengths the point needs "
        "other angles, beyond the bench's pressures:"
    )
    found = both.reach(np.array(EGG_GLOBAL), 2)
    print(f"Point A is {found.message}.")
    rows.append(("egg: point A, distance that is left", 0.0, 1e3 * found.distance, "mm"))
    return found


def printed_lengths() -> tuple[float, float, np.ndarray]:
    """Lengths (m) of slow and fast module whose tip is the egg's printed point at the printed angle.

    The fast module's length is its own, 40 mm; the slow one's and the split of the angle follow.
    """
    fast = float(finger(slow_chambers=0).links().sum())
    total = math.radians(EGG_ANGLE)

    def lengths(beta: float) -> np.ndarray:
        columns = [
            tip(np.array([beta]), np.ones(1))[:2],
            tip(np.array([beta, total - beta]), np.array([0.0, 1.0]))[:2],
        ]
        return np.asarray(np.linalg.solve(np.column_stack(columns), EGG_BASE[:2]))

    beta = float(brentq(lambda b: lengths(b)[1] - fast, math.radians(20), math.radians(45)))
    return float(lengths(beta)[0]), fast, np.array([beta, total - beta])


def _sphere(model: Finger, rows: list[tuple[str, float, float, str]]) -> Reach:
    point = gripper(model).to_base(np.array(SPHERE_GLOBAL), 2)
    print(f"\nSphere. Point A in finger 2's frame: {_mm(point)} mm.")
    print("Slow pressure that brings chamber 7 nearest to it, printed 28.7 kPa:")
    for name, words in (("(8), as (10) has it", {"stress": "linear"}), ("(7)", {})):
        for place, where in ((SPHERE_CHAMBER, "end"), (SPHERE_CHAMBER - 0.5, "middle")):
            found = inverse(finger(**words), point, place)
            kilopascals, left = found.pressures[0] / 1e3, 1e3 * found.distance
            print(f"{name:20} {where:>6} of it: {kilopascals:.1f} kPa, {left:.1f} mm left")
            title = f"sphere: slow pressure {name}, {where} of chamber 7"
            rows.append((title, SPHERE_PRESSURE / 1e3, kilopascals, "kPa"))
    touch, place = first_touch(model, point)
    rows.append(("sphere: first touch of the finger's face", SPHERE_PRESSURE / 1e3, touch / 1e3, "kPa"))
    paragraph(
        "The paper's number is that of (8) at the end of chamber 7, the joint of (28); no posture of "
        "that joint meets the point, the middle of the chamber does. With (7), which FE confirms, "
        "less pressure is needed. But a finger that bends freely to A runs through the sphere beyond "
        f"it: its face touches the sphere first at {touch / 1e3:.1f} kPa, {place:.1f} chambers from "
        "the root. From the touch on neither model holds; shape and force are then FE's (obstacles "
        "of a deck)."
    )
    return inverse(model, point, SPHERE_CHAMBER - 0.5)


def first_touch(model: Finger, nearest: np.ndarray) -> tuple[float, float]:
    """Slow pressure (Pa) at which the face under the paper first touches the sphere, and where (chambers).

    nearest : (3,) m, the sphere's nearest point to the root's line, in the finger's frame
    """
    centre = nearest[:2] + np.array([0.0, SPHERE_RADIUS])
    parts = 30
    layer = model.parameters["t2"].value

    def gap(pressure: float) -> tuple[float, float]:
        frames = along(*model.chain(model.module_angles(np.array([[pressure, 0.0]]))), parts)[0]
        face = frames[:, :2, 3] + layer * frames[:, :2, 1]
        distance = np.linalg.norm(face - centre, axis=1) - SPHERE_RADIUS
        return float(distance.min()), int(np.argmin(distance)) / parts

    pressure = float(brentq(lambda p: gap(p)[0], 0.0, SPHERE_PRESSURE, xtol=1.0))
    return pressure, gap(pressure)[1]


def _mm(point: np.ndarray) -> str:
    return "(" + ", ".join(f"{1e3 * x:.1f}" for x in point) + ")"


def _draw(file: Path, model: Finger, egg: Reach, sphere: Reach) -> None:
    """Finger 2's plane twice: at the printed pressures and where our inverse puts it, with the object."""
    from fem_spa.output.style import figure, tidy

    drawing = figure(11.0, 5.2)
    left, right = drawing.subplots(1, 2)
    for axes, title in ((left, "Egg: 20 and 13.9 kPa"), (right, "Sphere: 28.7 kPa")):
        axes.set_title(title, loc="left")
        axes.set_xlabel("x, along the finger at rest [mm]")
        axes.set_ylabel("y, towards the gripper's axis [mm]")
        axes.set_aspect("equal")
    around = np.linspace(0.0, 2 * np.pi, 200)
    axis = 1e3 * RADIUS
    high = EGG_AXES[1] * math.sqrt(1.0 - ((RADIUS - EGG_BASE[1]) / EGG_AXES[0]) ** 2)
    centre = 1e3 * (EGG_BASE[0] - high)
    across, along = (1e3 * a for a in EGG_AXES)
    left.fill(centre + along * np.cos(around), axis + across * np.sin(around), color="#f3e3c3", zorder=1)
    radius = 1e3 * SPHERE_RADIUS
    right.fill(55.0 + radius * np.cos(around), axis + radius * np.sin(around), color="#dbe7f3", zorder=1)
    _finger(left, model, model.module_angles(EGG_PRESSURE), egg.angles[None], EGG_BASE, len(model.links()))
    target = 1e3 * gripper(model).to_base(np.array(SPHERE_GLOBAL), 2)
    printed = model.module_angles(np.array([[SPHERE_PRESSURE, 0.0]]))
    _finger(right, model, printed, sphere.angles[None], 1e-3 * target, SPHERE_CHAMBER - 0.5)
    for axes in (left, right):
        axes.axhline(axis, color="#6b7280", linewidth=0.9, linestyle="-.")
        axes.annotate(
            "axis", (0.99, axis), xycoords=("axes fraction", "data"), ha="right", va="bottom", fontsize=9
        )
        tidy(axes, zero=False)
        axes.legend(frameon=False, fontsize=9, loc="lower right")
    buffer = io.BytesIO()
    drawing.savefig(buffer, format="png", dpi=130)
    write_whole(file, buffer.getvalue())


def _finger(
    axes: Any, model: Finger, printed: np.ndarray, ours: np.ndarray, point: Any, place: float
) -> None:
    """The body at the printed pressures, the paper layer where our inverse puts it, point A."""
    from fem_spa.output.style import ACCENT, GREY, SECOND, WARN

    for modules, colour, style, label in (
        (printed, ACCENT, "-", "at the printed pressures"),
        (ours, SECOND, "--", "nearest to A, by our inverse"),
    ):
        turns, lengths = model.chain(modules)
        poses = 1e3 * along(turns, lengths, 20)[0, :, :2]
        line, normal = poses[:, :, 3], 1e-3 * poses[:, :, 1]
        if style == "-":
            top = line - 1e3 * HEIGHT * normal
            under = line + 2.0 * normal
            body = np.concatenate([under, top[::-1]])
            axes.fill(body[:, 0], body[:, 1], color=GREY, alpha=0.18, zorder=2)
        axes.plot(line[:, 0], line[:, 1], style, color=colour, linewidth=2.0, label=label, zorder=4)
        at = 1e3 * pose(turns, lengths, place)[0, :2, 3]
        axes.plot(
            *at, "o", color="white", markeredgecolor=colour, markeredgewidth=1.6, markersize=6, zorder=5
        )
    axes.plot(1e3 * point[0], 1e3 * point[1], "x", color=WARN, markersize=9, markeredgewidth=2.2, zorder=6)
    axes.annotate(
        "A", (1e3 * point[0], 1e3 * point[1]), xytext=(-4, -17), textcoords="offset points", color=WARN
    )


def paragraph(text: str) -> None:
    """Print a sentence or more in lines of 100 characters."""
    print(textwrap.fill(text, 100))
