"""Zig-zag actuator: torque of the air from the extension, joint stiffness a layer, from FE and from the
print.

The paper prints joint stiffnesses but neither the number and length of its links nor a curve; its figures
are not in the text. So the chain is laid on the drawing (23 segments as high as the actuator), FE of six
chambers gives extension and bending angles, and what the choice of links does to the numbers is shown.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from fem_spa.errors import InputError
from fem_spa.reduced.chain import Chain, in_series, task_space
from fem_spa.reduced.chain_fit import StiffnessFit, fit_stiffness
from fem_spa.reduced.chain_stiffness import WEIGHT, linear_stiffness, torque_of_extension
from fem_spa.reduced.curve import Curve, from_columns, from_points, read_columns
from fem_spa.reduced.model import Drive
from fem_spa.reduced.registry import read_model
from fem_spa.reduced.responses import sine_drive, sine_figures, step_drive, step_figures
from fem_spa.run import run_deck

SUMMARY = (
    "zig-zag chain: torque map from the extension, joint stiffness of each layer by FE, beside the printed"
)
DECK = Path(__file__).with_suffix(".toml")
LAYERS = (1.0, 1.5, 2.0)
"""mm; thickness of the limiting layer."""
PRINTED = {0.0: 1.3296, 1.0: 0.14791, 1.5: 0.1538, 2.0: 0.1659}
"""N m/rad; section IV A and Table II."""
SEGMENTS, HEIGHT, FOLD = 23, 13e-3, math.pi / 8
"""Of the chain: assumed; m, Table I; rad, half of the 45 deg of Table I."""
TOP, REACH, BEND = 350e3, 40e-3, math.radians(100)
"""Pa, m, rad; Table I."""
PIECES = {"T1": "1", "T2": "101", "T6": "10101010101"}
"""Layer whole, in two and in six pieces; their lengths are in a figure that is not at hand."""
LAW = {"A": 0.15, "beta": 4.0, "alpha": 1.0}
"""Bouc-Wen, u in rad; not printed ("tuned iteratively"), assumed."""


@dataclass(frozen=True, eq=False)
class Bench:
    """Curves of the FE pieces: extension of the linear one, angle of one a layer, and the modulus scale."""

    extension: Curve
    angles: dict[float, Curve]
    scale: float
    segments: int
    end: float


def run(out: Path) -> int:
    """Solve, calibrate, compare; prints tables, writes torque.csv, stiffness.csv and zigzag.png into
    `out`."""
    out.mkdir(parents=True, exist_ok=True)
    bench = measure(out)
    fits = calibrate(bench)
    print(assumptions())
    print(stiffnesses(bench, fits))
    print(sensitivity())
    print(pieces())
    print(hysteresis())
    write(out, bench, fits)
    draw(bench, fits, out / "zigzag.png")
    draw_motion(out / "responses.png")
    print(f"See {out / 'zigzag.png'} and {out / 'responses.png'}, and the FE reports in {out}")
    return 0


def measure(out: Path) -> Bench:
    """FE of the linear piece and of one a layer; pressures scaled so that the extension is Table I's.

    Of a neo-Hookean body only pressure over modulus matters: the run at C10 of the deck stands for any other.
    """
    outcome = run_deck(DECK, out / "linear")
    segments = int(outcome.setup.resolved["geometry"]["chambers"])
    columns, rows = read_columns(out / "linear" / "curve.csv")
    extension = from_columns(columns, rows, "displacement", "FE, linear")
    pressure, grown = extension.points.T
    wanted = REACH * segments / SEGMENTS
    if grown[-1] < wanted:
        raise InputError(
            f"given {1e-3 * pressure[-1]:g} kPa for loads.pressure: the piece extends by "
            f"{1e3 * grown[-1]:.3g} mm, {1e3 * wanted:.3g} mm are needed; give a larger pressure"
        )
    scale = TOP / float(np.interp(wanted, grown, pressure))
    angles = {}
    for layer in LAYERS:
        folder = out / f"layer {layer:g} mm"
        run_deck(DECK, folder, [f"geometry.layer='{layer} mm'"])
        bent = from_columns(*read_columns(folder / "curve.csv"), "angle", f"FE, layer {layer:g} mm")
        angles[layer] = from_points(scale * bent.points[:, 0], np.abs(bent.points[:, 1]), "angle")
    length = 1e-3 * float(rows[0, columns.index("tip x [mm]")])
    end = 0.5 * (length - segments * HEIGHT * math.tan(FOLD))
    grown = from_points(scale * pressure, grown, "displacement", "FE, linear")
    return Bench(grown, angles, scale, segments, end)


def piece(bench: Bench, **keys: Any) -> Chain:
    """The chain of the FE piece, without weight as the piece is."""
    rows = (bench.extension.points * 1e-3 ** np.array([1, -1])).tolist()
    extension = {"columns": ["pressure [kPa]", "displacement [mm]"], "rows": rows}
    table = {"kind": "chain", "segments": bench.segments, "end": f"{1e3 * bench.end} mm", "gravity": False}
    model = read_model(table | {"extension": extension} | keys)
    assert isinstance(model, Chain)
    return model


def calibrate(bench: Bench) -> dict[float, StiffnessFit]:
    """Torque from the extension with the printed k_theta, then k_layer of each layer from its angles.

    Only pressures up to TOP, where the torque map ends, are used.
    """
    fits = {}
    for layer, angle in bench.angles.items():
        used = angle.points[(angle.points[:, 0] > 0) & (angle.points[:, 0] <= TOP * 1.001)]
        model = piece(bench, preset="bending")
        fits[layer] = fit_stiffness(model, used[:, 0], used[:, 1], source=f"FE, layer {layer:g} mm")
    return fits


def assumptions() -> str:
    """What is not printed and taken here, and k_l by (5)."""
    d = HEIGHT / math.cos(FOLD)
    by_5 = linear_stiffness(WEIGHT, d, FOLD, SEGMENTS, PRINTED[0.0])
    by_statics = linear_stiffness(WEIGHT, d, FOLD, SEGMENTS, PRINTED[0.0], printed=False)
    lines = [
        f"Not printed, assumed: n = {SEGMENTS} segments of d = {1e3 * d:.2f} mm (as high as the actuator,",
        f"folded to its length), theta = {math.degrees(FOLD):.1f} deg, half of the printed fold angle.",
        f"(5) with k_theta = {PRINTED[0.0]} N m/rad then needs k_l = {by_5:.0f} N/m, "
        f"{1e3 * WEIGHT / by_5:.2f} mm under 50 g.",
        f"Statics of the same chain: {by_statics:.0f} N/m; (5) as printed leaves out the factor "
        f"cos(theta + d_theta) / 2, {math.cos(FOLD) / 2:.2f} at rest.",
        f"Torque on a fold at 350 kPa and 40 mm: {piece_torque(SEGMENTS, d, FOLD):.3f} N m.",
    ]
    return "\n".join(lines)


def piece_torque(segments: int, length: float, fold: float) -> float:
    """Torque on a fold (N m) at the full extension with the printed k_theta."""
    return float(torque_of_extension(np.array(REACH), length, fold, segments, PRINTED[0.0]))


def stiffnesses(bench: Bench, fits: Mapping[float, StiffnessFit]) -> str:
    """k_theta a layer, printed and ours."""
    thin = LAYERS[0]
    lines = [
        "",
        f"FE of {bench.segments} chambers, neo-Hooke, modulus scaled by {bench.scale:.2f}: 350 kPa give",
        "the printed 40 mm (in proportion). Torque from its extension, k_theta a layer from its angles.",
        "layer [mm]   k_theta printed   /linear   /1 mm    ours    /linear   /1 mm   mean error [deg]",
    ]
    for layer, fit in fits.items():
        k, shown = fit.model.parameters["k_layer"].value, PRINTED[layer]
        first = fits[thin].model.parameters["k_layer"].value
        lines.append(
            f"{layer:6.1f} {shown:18.4f} {shown / PRINTED[0.0]:10.3f} {shown / PRINTED[thin]:8.3f} {k:9.3f} "
            f"{k / PRINTED[0.0]:8.3f} {k / first:8.3f} "
            f"{math.degrees(fit.mae):9.2f} +- {math.degrees(fit.deviation):.2f}"
        )
    lines += [
        "(printed mean errors on the bench: 2.03, 1.97, 2.69 deg)",
        "The linear stiffness, 1.3296, scales the torques and so all of ours; only ratios can be compared.",
    ]
    return "\n".join(lines)


def sensitivity() -> str:
    """What other links do: k_l, torque, and the k_theta that Table I's 100 deg at 350 kPa need."""
    folded = SEGMENTS * HEIGHT * math.tan(FOLD)
    lines = [
        "",
        f"Other links of the same folded length, {1e3 * folded:.0f} mm; k_layer for 100 deg at 350 kPa.",
        "Printed: k_layer 0.148 to 0.166, 0.11 to 0.12 of k_theta.",
        " n   theta [deg]   d [mm]   k_l by (5) [N/m]   torque [N m]   k_layer   /1.3296",
    ]
    for n, fold in ((3, FOLD), (7, FOLD), (15, FOLD), (SEGMENTS, FOLD), (40, FOLD), (SEGMENTS, 2 * FOLD)):
        d = folded / (n * math.sin(fold))
        model = bending(n, d, fold)
        k = fit_stiffness(model, np.full(2, TOP), np.full(2, BEND)).model.parameters["k_layer"].value
        soft = linear_stiffness(WEIGHT, d, fold, n, PRINTED[0.0])
        lines.append(
            f"{n:2d} {math.degrees(fold):10.1f} {1e3 * d:11.2f} {soft:14.0f} "
            f"{piece_torque(n, d, fold):17.3f} {k:12.3f} {k / PRINTED[0.0]:9.3f}"
        )
    lines += [
        "The torque for 40 mm does not depend on n, the angle sums over n/2 folds: k_layer goes with n.",
        "The printed pair is that of about three links, eight times as long as the actuator is high; with",
        "links on the folds of the drawing, joints are about as stiff with the layer as without.",
    ]
    return "\n".join(lines)


def bending(n: int, length: float, fold: float) -> Chain:
    """A bending actuator of other links, its torque from the linear one of the same links."""
    extension = {
        "columns": ["pressure [kPa]", "displacement [mm]"],
        "rows": [[0, 0], [1e-3 * TOP, 1e3 * REACH]],
    }
    table = {
        "kind": "chain",
        "preset": "bending",
        "segments": n,
        "length": f"{length} m",
        "fold": f"{fold} rad",
    }
    model = read_model(table | {"extension": extension, "gravity": False})
    assert isinstance(model, Chain)
    return model


def pieces() -> str:
    """Angle at 350 kPa with the layer whole and in pieces; linear and bending actuator in series."""
    lines = ["", "Layer in pieces (patterns assumed), angle and extension at 350 kPa, hanging:"]
    for name, pattern in PIECES.items():
        model = read_model({"kind": "chain", "preset": "bending", "layer": pattern})
        angle, moved = model.simulate(Drive(np.zeros(1), np.full((1, 1), TOP)))[0, :2]
        lines.append(
            f"  {name} '{pattern}': {math.degrees(angle):6.1f} deg, tip {1e3 * moved:6.1f} mm along the axis"
        )
    _, _, x, y = np.moveaxis(1e3 * reach(), -1, 0)
    lines.append(
        f"Linear and bending actuator in series: x {x.min():.0f} to {x.max():.0f} mm, y 0 to {y.max():.0f} mm"
    )
    return "\n".join(lines)


def reach() -> np.ndarray:
    """Task space (9, 15, 4) of a linear actuator with a bending one at its tip."""
    linear, bent = read_model({"kind": "chain"}), read_model({"kind": "chain", "preset": "bending"})
    assert isinstance(linear, Chain) and isinstance(bent, Chain)
    return task_space(in_series(linear, bent), [np.linspace(0, TOP, 9), np.linspace(0, TOP, 15)])


def hysteresis() -> str:
    """Steps and sines of 336 kPa with (6) and (7)."""
    kinds = motion()
    model = next(iter(kinds.values()))
    drive = step_drive(336e3, 1.5, 5e-3)
    lines = [
        "",
        "Step and sines of 336 kPa, linear actuator; assumed: 0.1 s of damping,",
        f"Bouc-Wen {LAW}, u in rad",
    ]
    for name, one in kinds.items():
        figures = step_figures(drive.time, one.simulate(drive)[:, 1])
        lines.append(
            f"  step, {name}: overshoot {100 * figures.overshoot:.1f} %, 63 % after {figures.to_63:.2f} s, "
            f"90 % after {figures.to_90:.2f} s (printed: overdamped)"
        )
    lines.append("  f [Hz]   swing [mm]   lag [deg]   gap of up and down [% of swing]   without damping")
    bare = model.with_values(damping=0.0)
    for frequency in (0.2, 0.4, 0.6, 0.8, 1.0):
        wave = sine_drive(336e3, frequency, 3)
        both = [sine_figures(wave, m.simulate(wave)[:, 1], frequency) for m in (model, bare)]
        lines.append(
            f"{frequency:8.1f} {1e3 * both[0].swing:11.1f} {math.degrees(both[0].lag):11.1f} "
            f"{100 * both[0].gap:18.1f} {100 * both[1].gap:26.1f}"
        )
    lines += [
        "(6) as printed, without the modulus of the velocity, has no hysteresis; here it has the modulus.",
        "Bouc-Wen's loop does not depend on the rate: a loop above 0.6 Hz only, as on the bench, is",
        "the damping of (7) or the valve, not z.",
    ]
    return "\n".join(lines)


def motion() -> dict[str, Chain]:
    """The linear actuator with (6), (7): in equilibrium fold by fold, and, where MuJoCo is there, in
    motion."""
    model = read_model({"kind": "chain", "hysteresis": LAW})
    assert isinstance(model, Chain)
    kinds: dict[str, Chain] = {"fold by fold, (7)": model}
    if find_spec("mujoco") is not None:
        kinds["motion, (1), by MuJoCo"] = replace(model, dynamics=True)
    return kinds


def write(out: Path, bench: Bench, fits: Mapping[float, StiffnessFit]) -> None:
    """torque.csv and stiffness.csv."""
    torque = piece(bench).actuators[0].torque
    lines = ["pressure [kPa],torque [N*m]", *(f"{1e-3 * p:.6g},{t:.6g}" for p, t in torque.points)]
    (out / "torque.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    lines = ["layer [mm],printed [N*m/rad],ours [N*m/rad],low,high,mean error [deg]"]
    for layer, fit in fits.items():
        p = fit.model.parameters["k_layer"]
        low, high = p.interval or (math.nan, math.nan)
        cells = (layer, PRINTED[layer], p.value, low, high, math.degrees(fit.mae))
        lines.append(",".join(f"{cell:.6g}" for cell in cells))
    (out / "stiffness.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")


def draw(bench: Bench, fits: Mapping[float, StiffnessFit], path: Path) -> None:
    """Torque map, angles a layer, task space; PNG."""
    from fem_spa.output.style import ACCENT, GREY, SECOND, figure, tidy

    picture = figure(13.0, 4.2)
    left, middle, right = picture.subplots(1, 3)
    torque = piece(bench).actuators[0].torque
    left.plot(1e-3 * torque.points[:, 0], torque.points[:, 1], "o-", ms=4, color=ACCENT)
    left.set(title="Torque on a fold, from the extension", xlabel="pressure [kPa]", ylabel="torque [N m]")
    for (layer, fit), colour in zip(fits.items(), (ACCENT, SECOND, GREY), strict=False):
        p = bench.angles[layer].points
        fine = np.linspace(0, TOP, 60)
        angle = fit.model.simulate(Drive(np.arange(60.0), fine[:, None]))[:, 0]
        middle.plot(1e-3 * p[:, 0], np.degrees(p[:, 1]), "o", ms=4, color=colour)
        middle.plot(1e-3 * fine, np.degrees(angle), color=colour, label=f"layer {layer:g} mm")
    middle.set(
        title=f"{bench.segments} chambers: FE (dots) and chain", xlabel="pressure [kPa]", ylabel="angle [deg]"
    )
    middle.legend(frameon=False)
    space = 1e3 * reach()
    right.plot(space[..., 2], space[..., 3], color=GREY, lw=0.8)
    right.plot(space[..., 2].T, space[..., 3].T, color=ACCENT, lw=0.8)
    right.set(title="In series: where the tip can go", xlabel="x, along the rest axis [mm]", ylabel="y [mm]")
    right.set_aspect("equal")
    for axes in (left, middle, right):
        tidy(axes)
    picture.savefig(path, dpi=120)


def draw_motion(path: Path) -> None:
    """Step response, and extension over pressure under sines; PNG."""
    from fem_spa.output.style import ACCENT, GREY, SECOND, figure, tidy

    picture = figure(11.0, 4.2)
    left, right = picture.subplots(1, 2)
    kinds = motion()
    drive = step_drive(336e3, 0.8, 5e-3)
    for (name, model), colour, style in zip(kinds.items(), (ACCENT, SECOND), ("-", "--"), strict=False):
        left.plot(drive.time, 1e3 * model.simulate(drive)[:, 1], style, color=colour, lw=2, label=name)
    left.set(title="Step of 336 kPa", xlabel="time [s]", ylabel="extension [mm]")
    model = next(iter(kinds.values()))
    for frequency, colour in ((0.2, ACCENT), (0.6, SECOND), (1.0, GREY)):
        wave = sine_drive(336e3, frequency, 3)
        last = slice(-201, None)
        moved = 1e3 * model.simulate(wave)[last, 1]
        right.plot(1e-3 * wave.pressure[last, 0], moved, color=colour, label=f"{frequency:g} Hz")
    right.set(title="Sines of 336 kPa", xlabel="pressure [kPa]", ylabel="extension [mm]")
    for axes in (left, right):
        tidy(axes)
        axes.legend(frameon=False)
    picture.savefig(path, dpi=120)
