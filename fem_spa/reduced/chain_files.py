"""`[model]` tables of chains: presets, torque from a table or from the extension of a linear actuator."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fem_spa.errors import InputError
from fem_spa.reduced import chain_actuator
from fem_spa.reduced.chain import OUTPUTS, Chain, actuator, in_series
from fem_spa.reduced.chain_stiffness import torque_of_extension
from fem_spa.reduced.curve import Curve, from_columns, from_points, read_columns, rows_of
from fem_spa.reduced.hysteresis import BoucWen
from fem_spa.reduced.tables import amount, common_table, factor, read_parameters, read_valid, refuse_unknown
from fem_spa.units import brief

TORQUE_UNIT = "N*m"
PRESETS = {"linear": "0", "bending": "1"}
_OWN = ("preset", "segments", "layer", "torques", "torque", "extension")
_LAW = {"A", "beta", "alpha", "n"}
_SWITCHES = ("gravity", "dynamics")
_KEYS = (*_OWN, *_SWITCHES, "hysteresis", "series")


def read_chain(table: Mapping[str, Any], where: Path) -> Chain:
    """A chain of a `[model]` table, or several in series.

    Raises
    ------
    InputError : an unknown key, a value out of range, a file that cannot be read
    """
    numbers = chain_actuator.parameters("")
    if "series" not in table:
        refuse_unknown(table, (*_KEYS, *numbers))
        return _switched(_one(table, where), table)
    parts = table["series"]
    if not isinstance(parts, list) or not all(isinstance(part, Mapping) for part in parts):
        raise InputError(f"given {brief(parts)} for model.series: a list of tables is needed")
    joined_names = [f"{name}_{i}" for i in range(1, len(parts) + 1) for name in numbers]
    refuse_unknown(table, ("series", *_SWITCHES, "hysteresis", *joined_names))
    chains = []
    for part in parts:
        refuse_unknown({"kind": "chain"} | dict(part), (*_OWN, *numbers))
        chains.append(_one(part, where))
    chain = in_series(*chains)
    chain = replace(chain, parameters=read_parameters(table, chain.parameters))
    return _switched(replace(chain, valid=read_valid(table, OUTPUTS) or chain.valid), table)


def _one(table: Mapping[str, Any], where: Path) -> Chain:
    """One actuator; keys are known already."""
    preset = table.get("preset", "bending" if "1" in str(table.get("layer", "0")) else "linear")
    if preset not in PRESETS:
        raise InputError(f"given {brief(preset)} for model.preset: allowed are 'linear' and 'bending'")
    segments = table.get("segments", chain_actuator.SEGMENTS)
    if isinstance(segments, bool) or not isinstance(segments, int):
        raise InputError(f"given {brief(segments)} for model.segments: a whole number is needed")
    layer = table.get("layer", PRESETS[preset])
    if not isinstance(layer, str):
        raise InputError(f"given {brief(layer)} for model.layer: a pattern such as '1' or '10101' is needed")
    chain = actuator(assumed_extension(1.0), layer, segments)
    chain = replace(chain, parameters=read_parameters(table, chain.parameters))
    torques = None
    if "torques" in table:
        given = table["torques"]
        if not isinstance(given, list) or not all(isinstance(t, (int, float)) for t in given):
            raise InputError(f"given {brief(given)} for model.torques: factors are needed, one a fold")
        torques = tuple(float(t) for t in given)
    chain = replace(chain, actuators=(replace(chain.actuators[0], torques=torques),))
    if "torque" in table:
        torque = _curve(table["torque"], where, "torque")
    else:
        given = "extension" in table
        extension = _curve(table["extension"], where, "displacement") if given else _usual(chain)
        torque = torque_map(chain, extension)
    part = replace(chain.actuators[0], torque=torque)
    return replace(chain, actuators=(part,), valid=read_valid(table, OUTPUTS) or torque.valid)


def _switched(chain: Chain, table: Mapping[str, Any]) -> Chain:
    """With the switches and the hysteresis of a table."""
    switches = {}
    for name in _SWITCHES:
        given = table.get(name, getattr(chain, name))
        if not isinstance(given, bool):
            raise InputError(f"given {brief(given)} for model.{name}: true or false is needed")
        switches[name] = given
    law = table.get("hysteresis")
    if law is not None and law is not False:
        if not isinstance(law, Mapping) or not {"A", "beta", "alpha"} <= set(law) <= _LAW:
            raise InputError("model.hysteresis: A, beta, alpha and n are its keys, u in rad")
        law = BoucWen(**{key: amount(value, "", f"model.hysteresis.{key}") for key, value in law.items()})
    return replace(chain, hysteresis=law or None, gravity=switches["gravity"], dynamics=switches["dynamics"])


def _curve(given: Any, where: Path, name: str) -> Curve:
    """`torque` or `extension`: a table with `file`, or with `columns` and `rows`."""
    key = "torque" if name == "torque" else "extension"
    if isinstance(given, Mapping) and "file" in given:
        path = where / str(given["file"])
        columns, rows = read_columns(path)
        source = path.name
    elif isinstance(given, Mapping) and {"columns", "rows"} <= set(given):
        columns, source = [str(cell) for cell in given["columns"]], "the model file"
        rows = rows_of(given["rows"], columns)
    else:
        raise InputError(f"given {brief(given)} for model.{key}: a file, or columns and rows, are needed")
    return from_columns(columns, rows, name, source)


def assumed_extension(scale: float) -> Curve:
    """Extension over pressure of the paper's linear actuator: 40 mm at 350 kPa, straight in between;
    times `scale`."""
    share = np.linspace(0.0, 1.0, 15)
    pressure, reach = chain_actuator.REACH
    return from_points(
        pressure * share, scale * reach * share, "displacement", "zig-zag paper, Table I; straight"
    )


def _usual(chain: Chain) -> Curve:
    """The paper's extension, in the proportion of this chain's folded length to the paper's."""
    values, paper = chain.values(0), chain_actuator.parameters("")
    folded = chain.actuators[0].segments * values["length"] * np.sin(values["fold"])
    usual = chain_actuator.SEGMENTS * paper["length"].value * np.sin(paper["fold"].value)
    return assumed_extension(float(folded / usual))


def torque_map(chain: Chain, extension: Curve) -> Curve:
    """Torque over pressure (N m) from the extension of the linear actuator, with k_theta of `chain`.

    Parameters
    ----------
    chain : its segments, length, fold and k_theta are those of the linear actuator
    extension : displacement over pressure, m; the first value at zero pressure is taken off
    """
    values = chain.values(0)
    pressure = extension.points[:, 0]
    grown = extension.points[:, 1] - float(extension.at(np.array(0.0)))
    torque = torque_of_extension(
        grown, values["length"], values["fold"], chain.actuators[0].segments, values["k_theta"]
    )
    source = extension.valid.source if extension.valid else ""
    return from_points(pressure, torque, "torque", source)


def chain_table(chain: Chain) -> dict[str, Any]:
    """The `[model]` table that `read_chain` reads back."""
    if len(chain.actuators) == 1:
        table = common_table("chain", chain.parameters, chain.valid, OUTPUTS) | _part(chain, 0)
    else:
        kept = chain.valid
        table = common_table("chain", chain.parameters, kept, OUTPUTS)
        table["series"] = [_part(chain, i) for i in range(len(chain.actuators))]
    table |= {name: getattr(chain, name) for name in _SWITCHES}
    law = chain.hysteresis
    if law is not None:
        table["hysteresis"] = {"A": law.A, "beta": law.beta, "alpha": law.alpha, "n": law.n}
    return table


def _part(chain: Chain, i: int) -> dict[str, Any]:
    """What of actuator i is no parameter."""
    part = chain.actuators[i]
    units = np.array([1e3, factor(TORQUE_UNIT)])
    rows = [[float(f"{x:.12g}") for x in row] for row in part.torque.points / units]
    columns = ["pressure [kPa]", f"torque [{TORQUE_UNIT}]"]
    table: dict[str, Any] = {"segments": part.segments, "layer": part.layer}
    table |= {"torque": {"columns": columns, "rows": rows}}
    return table if part.torques is None else table | {"torques": list(part.torques)}
