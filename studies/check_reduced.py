"""Every reduced model against the FE of its own actuator: as published, calibrated, and from FE directly.

Small actuators (seven folds, seven chambers, the whole arm), meshes coarse enough for minutes: what is
compared is one model with another of the same body, not with a bench. Contact is off below the first touch of
walls, and on in the fast module beyond it. Of each FE curve every third inner pressure is held out; errors
are on those alone, in per cent of the curve's range. The FE curves stay in DIR/fe and are not solved again
while decks are the same. The elements of "kelvin-voigt" have nothing here to be held against: FE does not
creep.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fem_spa.calibration.holdout import split
from fem_spa.calibration.observation import Run, read_runs
from fem_spa.calibration.outcome import rmse
from fem_spa.calibration.reduced import calibrate, measured, model_table, predicted
from fem_spa.calibration.segment import SegmentLaw, chamber_law
from fem_spa.deck import parse_deck
from fem_spa.output.files import write_whole
from fem_spa.output.style import ACCENT, GREY, figure, tidy
from fem_spa.prepare import prepare
from fem_spa.reduced.model import Drive
from fem_spa.reduced.registry import read_model
from fem_spa.reduced.tables import factor, toml_text
from fem_spa.solid.path import solve
from fem_spa.solid.problem import Row
from geometry.registry import SHAPES

SUMMARY = "every reduced model against the FE of its own actuator, before and after calibration, in minutes"
AIM = 2.0
"""Per cent of the range, on pressures that were not used."""

TPU = {"body": {"law": "neo-hooke", "C10": "1 MPa"}}
RUBBER = {"body": {"card": "dragon-skin-30"}}
ARM = {"body": {"law": "neo-hooke", "C10": "0.2744 MPa"}}  # E 1.6464 MPa, the arm paper's Table 1
FROM_FE = "law of a shorter piece"
PAPER = {"paper": {"modulus": "2 GPa", "thickness": "0.1 mm"}}


@dataclass(frozen=True)
class Scale:
    """How large the study is: sizes of elements, and points a curve; tests take a smaller one.

    touching : Pa, ends of the fast module's curves with contact
    """

    zigzag: str = "4 mm"
    finger: str = "5 mm"
    arm: str = "9 mm"
    points: int = 15
    folds: int = 7
    chambers: int = 7
    piece: int = 5
    arm_length: str = "180 mm"
    arm_rings: int = 8
    touching: tuple[float, ...] = (5e3, 40e3)


@dataclass(frozen=True)
class Check:
    """One model against one curve.

    before, after : held-out RMSE, SI; None where there is no such state
    lines : words -> (pressure Pa, output SI) for the picture
    """

    model: str
    actuator: str
    output: str
    span: float
    before: float | None
    after: float | None
    lines: dict[str, tuple[np.ndarray, np.ndarray]]
    remark: str = ""


def run(out: Path, scale: Scale | None = None, parts: Sequence[str] = ()) -> int:
    """Solve what is not there yet, calibrate, print the table, draw it; models are in DIR/models."""
    scale = scale or Scale()
    (out / "fe").mkdir(parents=True, exist_ok=True)
    (out / "models").mkdir(exist_ok=True)
    known = {"chains": chains, "fingers": fingers, "arcs": arcs, "arms": arms, "curves": curves}
    checks = [check for part in parts or known for check in known[part](out, scale)]
    write_whole(out / "check.csv", _csv(checks))
    print("\n".join(words(checks)))
    draw(checks, out / "check.png")
    print(f"See {out / 'check.png'}; the calibrated models are in {out / 'models'}")
    return 0


# -- the actuators -----------------------------------------------------------------------------------


def chains(out: Path, scale: Scale) -> list[Check]:
    """The zig-zag chain: the linear actuator's extension gives the torque, the bending one k_layer."""
    shape = {"shape": "zigzag", "chambers": scale.folds, "size": scale.zigzag}
    top = 60e3
    loads = {"pressure": f"{top} Pa", "points": scale.points, "contact": False}
    straight = fe(out, "zigzag_linear", deck(shape, TPU, loads))
    bent = fe(out, "zigzag_bending", deck(shape | {"layer": "1 mm"}, TPU, loads))
    grown = straight.outputs["x"] - straight.outputs["x"][0]
    pressure = straight.drive.pressure[:, 0]
    rows = [[float(p / 1e3), float(1e3 * x)] for p, x in zip(pressure, grown, strict=True)]
    extension = {"columns": ["pressure [kPa]", "displacement [mm]"], "rows": rows}
    table = {"kind": "chain", "segments": scale.folds, "gravity": False, "extension": extension}
    linear = read_model({"model": table | {"layer": "0"}})
    way = replace(straight, outputs={"displacement": grown})
    own = "its own extension"
    found = [check(out, "chain", "zig-zag, linear", linear, way, ["k_theta"], "displacement", own)]
    layered = read_model({"model": table | {"layer": "1"}})
    stiff = layered.with_values(k_layer=layered.parameters["k_theta"].value)
    # the chain's angle is that of the base-tip line
    x, z = bent.outputs["x"], bent.outputs["z"]
    chord = replace(bent, outputs={"angle": np.abs(np.arctan2(z - z[0], x))})
    same = "before: k_layer = k_theta"
    for words_, vary in ((", linear springs", ["k_layer"]), ("", ["k_layer", "layer_stiffening"])):
        found.append(check(out, "chain", f"zig-zag, bending{words_}", stiff, chord, vary, "angle", same))
    # a row of pieces from FE turns the tip itself
    drawn: Any = vars(SHAPES["zigzag"]())
    pitch = drawn["height"] * math.tan(drawn["fold_angle"] / 2)
    piece = deck(shape | {"layer": "1 mm", "chambers": scale.piece}, TPU, loads)
    law = piece_law(out, "piece_zigzag", piece, "main", top, pitch, scale.piece)
    row = law.segments(scale.folds, pitch)
    turned = replace(bent, outputs={"angle": np.abs(bent.outputs["angle"])})
    found.append(check(out, "segments", "zig-zag, bending", row, turned, ["gain"], "angle", FROM_FE))
    return found


def fingers(out: Path, scale: Scale) -> list[Check]:
    """The finger's modules, the fast one to its walls' first touch and beyond, rows from FE of a piece."""
    found = []
    cases = [("slow", 40e3, 9e-3, False), ("fast", 1.2e3, 7e-3, False)]
    cases += [("fast", top, 7e-3, True) for top in scale.touching]
    for module, top, pitch, contact in cases:
        other = "fast" if module == "slow" else "slow"
        loads = {"pressure": f"{top} Pa", "points": scale.points, "contact": contact}

        def body(count: int, module: str = module, other: str = other) -> dict[str, Any]:
            size = {"size": scale.finger, f"{module}_chambers": count, f"{other}_chambers": 0}
            return {"shape": "pneunet"} | size

        count, name = scale.chambers, module + f"_touching_{top / 1e3:g}_kPa" * contact
        words_ = f"{module} module" + f" to {top / 1e3:g} kPa" * contact
        whole = fe(out, f"finger_{name}", deck(body(count), RUBBER, loads, layers=PAPER))
        piece = deck(body(scale.piece), RUBBER, loads, layers=PAPER)
        law = piece_law(out, f"piece_{name}", piece, module, top, pitch, scale.piece)
        kind = {"kind": "pneunet", f"{module}_chambers": count, f"{other}_chambers": 0}
        model = read_model({"model": kind})
        vary, remark, start = [f"{module}_stiffness"], "", model
        if module == "fast":
            found.append(check(out, "pneunet", f"{words_}, (20) alone", model, whole, vary, "angle"))
            vary = ["fast_bending", "fast_touch", "fast_squeezing"] if contact else ["fast_bending"]
            if not contact:  # these data end before the walls meet
                start, remark = model.with_values(fast_touch=top), f"fast_touch {top:g} Pa"
        found.append(check(out, "pneunet", words_, model, whole, vary, "angle", remark, start))
        row = law.segments(count, pitch)
        found.append(check(out, "segments", words_, row, whole, ["gain"], "angle", FROM_FE))
    return found


def arcs(out: Path, scale: Scale) -> list[Check]:
    """Curvature kinematics: the tip's place from its angle alone, along the slow module."""
    from scipy.optimize import least_squares

    from fem_spa.reduced.curvature import tip

    whole = read_runs([out / "fe" / "finger_slow" / "curve.csv"])[0]
    angle, x, z = whole.outputs["angle"], whole.outputs["x"], whole.outputs["z"]
    turns = np.repeat(angle[:, None] / scale.chambers, scale.chambers, axis=1)
    moved = np.column_stack([x - x[0], z[0] - z])

    def way(length: float, high: float) -> np.ndarray:
        line = tip(turns, np.full(scale.chambers, length / scale.chambers))[:, :2]
        face = line + high * np.column_stack([np.sin(angle), 1.0 - np.cos(angle)])
        return np.asarray(face - face[0])

    # what bends, at first all of it; the tip face's middle stands `high` over the paper
    drawn = np.array([float(x[0]), float(z[0]) - vars(SHAPES["pneunet"]())["lower_layer"]])
    held = split([whole])[1][0].use
    best = least_squares(
        lambda f: (way(*(f * drawn))[~held] - moved[~held]).ravel() / drawn[0], [1.0, 1.0], bounds=(0.8, 1.25)
    ).x
    span = float(np.linalg.norm(moved, axis=1).max())
    states = {"before": drawn, "after": best * drawn}
    errors = [rmse([(way(*state) - moved)[held]]) for state in states.values()]
    p = whole.drive.pressure[:, 0]
    lines = {"FE": (p, np.linalg.norm(moved, axis=1))}
    for name, state in states.items():
        lines[name] = (p, np.linalg.norm(way(*state), axis=1))
    remark = ", ".join(
        f"{word} {1e3 * a:.4g} -> {1e3 * b:.4g} mm"
        for word, a, b in zip(("length", "height of the tip"), drawn, best * drawn, strict=True)
    )
    return [Check("curvature", "slow module", "tip's way", span, errors[0], errors[1], lines, remark)]


def arms(out: Path, scale: Scale) -> list[Check]:
    """The rod: one chamber of the whole arm, then the two others together; its law from a piece of it."""
    shape = {"shape": "arm-segment", "half": True, "size": scale.arm, "chamber_length": scale.arm_length}
    shape |= {"rings": scale.arm_rings}
    found = []
    pitch = _mm(scale.arm_length) / (scale.arm_rings + 1)
    length = _mm(scale.arm_length) + 10e-3
    short = dict(shape) | {"chamber_length": f"{4e3 * pitch:g} mm", "rings": 3}
    top = 60e3
    loads = {"pressure": {"1": f"{top} Pa", "2": "0 kPa"}, "points": scale.points, "contact": False}
    law = piece_law(out, "piece_arm", deck(short, ARM, loads), "1", top, pitch, 4)
    table = {"kind": "rod", "preset": "am-i-support", "gravity": False, "valve": False}
    table |= {"strain_gains": [1.0, 1.0, 1.0], "length": f"{1e3 * length} mm"}
    rod = read_model({"model": table})
    from_fe = replace(rod, law=law.rod_law())  # type: ignore[type-var]
    for words_, one, two in (("chamber 1", top, 0.0), ("chambers 2 and 3", 0.0, top)):
        pressures = {"1": f"{one} Pa", "2": f"{two} Pa"}
        run_ = fe(out, f"arm_{words_.split()[1]}", deck(shape, ARM, loads | {"pressure": pressures}))
        p1, p2 = run_.drive.pressure.T
        run_ = replace(
            run_, drive=Drive(run_.drive.time, np.column_stack([p1, p2, p2])), chambers=("1", "2", "3")
        )
        vary = ["strain_gain_1"] if one else ["strain_gain_2", "strain_gain_3"]
        found.append(check(out, "rod", f"arm, {words_}", rod, run_, vary, None))
        found.append(check(out, "rod", f"arm, {words_}, law", from_fe, run_, vary, None, FROM_FE))
    return found


def curves(out: Path, scale: Scale) -> list[Check]:
    """A curve: what is left between the points that it was given."""
    found = []
    for name, words_ in (("finger_slow", "slow module"), ("zigzag_bending", "zig-zag, bending")):
        run_ = read_runs([out / "fe" / name / "curve.csv"])[0]
        train, held = split([run_])
        p, y = run_.drive.pressure[:, 0], run_.outputs["angle"]
        keep = train[0].use
        from fem_spa.reduced.curve import from_points

        model: Any = from_points(p[keep], y[keep], "angle", name)
        error = rmse([predicted(model, held[0], ["angle"]) - measured(held[0], ["angle"])])
        lines = {"FE": (p, y), "after": (p, model.at(p))}
        found.append(Check("curve", words_, "angle", float(np.ptp(y)), None, error, lines))
    return found


# -- FE, kept ------------------------------------------------------------------------------------


def deck(
    geometry: Mapping[str, Any],
    materials: Mapping[str, Any],
    loads: Mapping[str, Any],
    layers: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """The tables of a deck."""
    out = {"geometry": dict(geometry), "materials": dict(materials), "loads": dict(loads)}
    return out | {"observe": {"angle": "tip-face"}} | ({"layers": dict(layers)} if layers else {})


def fe(out: Path, name: str, tables: dict[str, Any]) -> Run:
    """The curve of a deck at its load points, solved or read from DIR/fe/<name>."""
    folder = out / "fe" / name
    key = hashlib.sha256(json.dumps(tables, sort_keys=True).encode()).hexdigest()
    if not _kept(folder, key, "curve.csv"):
        print(f"solving {name}", flush=True)
        setup = prepare(parse_deck(tables))
        result = solve(setup.problem, setup.steps)
        rows = [row for row in result.rows if row.is_point]
        if result.status != "done":
            print(f"{name}: {result.message}")
        write_whole(folder / "curve.csv", _curve(rows, setup.problem.mesh.cavities))
        write_whole(folder / "key.txt", key)
    return read_runs([folder / "curve.csv"])[0]


def _curve(rows: Sequence[Row], cavities: Sequence[str]) -> str:
    """The points of an FE curve as CSV, columns as in curve.csv of `fem-spa solve`."""
    heads = [f"pressure {name} [kPa]" for name in cavities] if len(cavities) > 1 else ["pressure [kPa]"]
    lines = [",".join([*heads, "angle [deg]", "tip x [mm]", "tip y [mm]", "tip z [mm]"])]
    for row in rows:
        numbers = [row.pressure[name] / 1e3 for name in cavities]
        numbers += [math.degrees(row.angle), *(1e3 * row.tip)]
        lines.append(",".join(f"{number:.10g}" for number in numbers))
    return "\n".join(lines) + "\n"


def piece_law(
    out: Path, name: str, tables: dict[str, Any], cavity: str, top: float, pitch: float, count: int
) -> SegmentLaw:
    """The law of one chamber of a short piece, solved or read from DIR/fe/<name>.

    The gauge spans the inner pitches: for a finger from the middle of the second chamber to the middle of the
    last but one, for the arm from ring to ring.
    """
    folder = out / "fe" / name
    given = json.dumps([tables, cavity, top, pitch, count], sort_keys=True)
    key = hashlib.sha256(given.encode()).hexdigest()
    numbers = ("pressure", "curvature", "stretch")
    if not _kept(folder, key, "law.json"):
        print(f"solving {name}", flush=True)
        setup = prepare(parse_deck(tables))
        points = setup.problem.mesh.points
        if cavity == "main":  # the zig-zag bends about its layer, at z = 0
            first = 0.5 * (float(np.ptp(points[:, 0])) - count * pitch)
            near, far, reach = first + pitch, first + (count - 1) * pitch, 0.5 * pitch
            axis = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
        elif cavity == "1":  # the arm: base plate of 5 mm, rings a pitch apart
            near, far, reach = 5e-3 + pitch, 5e-3 + 3 * pitch, 1.1e-3
            axis = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
        else:
            total = float(np.ptp(points[:, 0]))
            first = 0.5 * (total - count * pitch)
            near, far, reach = first + 1.5 * pitch, first + (count - 1.5) * pitch, 0.5 * pitch
            axis = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
        law = chamber_law(setup.problem, cavity, top, near, far, reach, axis, setup.steps)
        table = {n: getattr(law, n).tolist() for n in numbers}
        table |= {n: getattr(law, n) for n in ("bending_stiffness", "axial_stiffness", "gauge", "source")}
        write_whole(folder / "law.json", json.dumps(table, indent=1))
        write_whole(folder / "key.txt", key)
    kept: dict[str, Any] = json.loads((folder / "law.json").read_text(encoding="utf-8"))
    columns: dict[str, Any] = {n: np.array(kept[n]) for n in numbers}
    return SegmentLaw(**(kept | columns))


def _kept(folder: Path, key: str, name: str) -> bool:
    folder.mkdir(parents=True, exist_ok=True)
    found = folder / "key.txt"
    return found.is_file() and (folder / name).is_file() and found.read_text(encoding="utf-8") == key


def _mm(text: str) -> float:
    return float(text.removesuffix(" mm")) * 1e-3


# -- comparison ----------------------------------------------------------------------------------


def check(
    out: Path,
    kind: str,
    actuator: str,
    model: Any,
    run_: Run,
    vary: Sequence[str],
    output: str | None,
    remark: str = "",
    start: Any = None,
) -> Check:
    """A model before and after calibration on the held-out pressures; its file goes to DIR/models.

    start : the model from which the calibration starts, where that is not `model`
    """
    train, held = split([run_])
    fitted, outcome = calibrate(start or model, train, held, vary, output=output)
    name = f"{kind}_{actuator}".replace(", ", "_").replace(" ", "_")
    write_whole(out / "models" / f"{name}.toml", toml_text(model_table(fitted, outcome)))
    every = replace(run_, use=np.ones(len(run_.use), dtype=bool))
    names = outcome.outputs
    p = run_.drive.pressure.max(axis=1)
    true = measured(every, names)
    lines = {"FE": (p, _size(true, true[0]))}
    for words_, candidate in (("before", model), ("after", fitted)):
        lines[words_] = (p, _size(predicted(candidate, every, names), true[0]))
    numbers = ", ".join(
        f"{n.name} {n.start:.4g} -> {n.value:.4g}" for n in outcome.parameters if not n.refused
    )
    refused = [n for n in outcome.parameters if n.refused]
    if refused:
        wants = ", ".join(f"{n.name} would go to {n.wanted:.3g}" for n in refused)
        numbers = f"{numbers} not accepted: {wants}".strip()
    words_ = f"{remark}; {numbers}" if remark else numbers
    show = "tip's way" if len(names) > 1 else names[0]
    span = outcome.span if len(names) == 1 else float(np.ptp(_size(true, true[0])))
    before = rmse([predicted(model, held[0], names) - measured(held[0], names)])
    return Check(kind, actuator, show, span, before, outcome.after[1], lines, words_)


def _size(values: np.ndarray, rest: np.ndarray) -> np.ndarray:
    return values[:, 0] if values.shape[1] == 1 else np.asarray(np.linalg.norm(values - rest, axis=1))


def words(checks: Sequence[Check]) -> list[str]:
    """The table for the terminal, and what is above the aim."""

    def cell(value: float | None, span: float) -> str:
        return f"{'-':>8s}" if value is None else f"{100 * value / span:8.2f}"

    lines = ["error on pressures not used, % of the range"]
    lines.append(f"{'model':10s} {'actuator':33s} {'output':13s} {'before':>8s} {'after':>8s}")
    for c in checks:
        numbers = " ".join(cell(v, c.span) for v in (c.before, c.after))
        lines.append(f"{c.model:10s} {c.actuator:33s} {c.output:13s} {numbers}  {c.remark}".rstrip())
    for c in checks:
        share = 100 * (c.after or 0.0) / c.span
        if share > AIM:
            lines.append(f"Above {AIM:g} %: {c.model}, {c.actuator}: {share:.1f} %. {WHY.get(c.model, '')}")
    return lines


WHY = {
    "chain": "Its torque is from the extension of the linear actuator, its springs are linear; folds at the "
    "layer grow stiffer as they open, which layer_stiffening tells.",
    "pneunet": "(20) starts as the root of the pressure, at walls that touch at rest; they are 2 mm apart, "
    "and chambers first bend alone, in proportion. No modulus changes that; fast_bending, fast_touch do.",
    "rod": "Pressure enters (24) in proportion; a plain round tube of rubber that keeps its volume hardly "
    "lengthens at first and then ever faster, so no gain fits. Its law from FE does.",
    "curvature": "Ends and chambers do not bend alike.",
    "segments": "The first and the last chamber bend less than those of the gauge.",
}


def _csv(checks: Sequence[Check]) -> str:
    lines = ["model,actuator,output,span,before [%],after [%]"]
    for c in checks:
        cells = ["" if v is None else f"{100 * v / c.span:.4g}" for v in (c.before, c.after)]
        lines.append(",".join([c.model, f'"{c.actuator}"', c.output, f"{c.span:.6g}", *cells]))
    return "\n".join(lines) + "\n"


def draw(checks: Sequence[Check], path: Path) -> None:
    """Each model's curve beside the FE's."""
    columns = 4
    rows = math.ceil(len(checks) / columns)
    picture = figure(4.2 * columns, 3.2 * rows)
    panels = np.atleast_1d(picture.subplots(rows, columns)).ravel()
    styles: dict[str, dict[str, Any]] = {
        "FE": {"color": "black", "ls": "none", "marker": "o", "ms": 4, "mfc": "none"},
        "before": {"color": GREY, "ls": "--"},
        "after": {"color": ACCENT},
    }
    for axes, c in zip(panels, checks, strict=False):
        unit = "deg" if c.output == "angle" else "mm"
        for words_, (p, y) in c.lines.items():
            axes.plot(p / 1e3, y / factor(unit), label=words_, **styles[words_])
        axes.set_title(f"{c.model}: {c.actuator}", fontsize=10)
        axes.set(xlabel="pressure [kPa]", ylabel=f"{c.output} [{unit}]")
        true = c.lines["FE"][1] / factor(unit)
        room = 0.6 * float(np.ptp(true))
        axes.set_ylim(float(true.min()) - 0.3 * room, float(true.max()) + room)
        tidy(axes)
        axes.legend(frameon=False, fontsize=8)
    for axes in panels[len(checks) :]:
        axes.set_visible(False)
    picture.savefig(path, dpi=100)
