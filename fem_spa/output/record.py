"""result.json: what was run, how it ended, what it cost."""

from __future__ import annotations

import json
import math
import platform
import sys
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from fem_spa.output.table import obstacle_forces
from fem_spa.output.words import all_warnings
from fem_spa.solid.problem import Problem, Result, Row

PACKAGES = (
    "fem-spa",
    "numpy",
    "scipy",
    "scikit-fem",
    "numba",
    "pypardiso",
    "gmsh",
    "meshio",
    "vtk",
    "matplotlib",
)


def versions() -> dict[str, str]:
    """Package -> version of those that are installed, Python's among them."""
    found = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found


def peak_memory() -> float | None:
    """Largest resident memory of this process so far, MB; None where the system does not tell."""
    try:
        import resource
    except ImportError:
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / 1e6 if sys.platform == "darwin" else peak / 1024.0


def material_table(problem: Problem, sources: Mapping[str, str]) -> dict[str, dict[str, Any]]:
    """Volume -> law, parameters, small-strain constants and source, each with its unit."""
    from materials.registry import small_strain

    table: dict[str, dict[str, Any]] = {}
    for name, material in problem.materials.items():
        law = material.law
        rest = small_strain(law, material.parameters, material.bulk)
        table[name] = {
            "law": law.name,
            "parameters": {
                key: {"value": value, "unit": law.parameters[key]}
                for key, value in material.parameters.items()
            },
            "bulk": {"value": "inf" if math.isinf(material.bulk) else material.bulk, "unit": "Pa"},
            "density": None if material.density is None else {"value": material.density, "unit": "kg/m^3"},
            "shear_modulus": {"value": rest.mu, "unit": "Pa"},
            "youngs_modulus": {"value": rest.E, "unit": "Pa"},
            "poissons_ratio": rest.nu,
            "source": sources.get(name, "the deck"),
        }
    return table


def mesh_table(problem: Problem) -> dict[str, Any]:
    """Counts, names, source and digest of the mesh."""
    mesh = problem.mesh
    return {
        "hash": mesh.hash(),
        "points": len(mesh.points),
        "elements": len(mesh.tets),
        "volumes": sorted(mesh.volumes),
        "surfaces": sorted(mesh.surfaces),
        "source": mesh.source,
        "notes": list(mesh.notes),
    }


def row_table(row: Row) -> dict[str, Any]:
    """A row with the unit in every key."""
    return {
        "step": row.step,
        "pressure [kPa]": {name: value / 1e3 for name, value in row.pressure.items()},
        "angle [deg]": math.degrees(row.angle),
        "tip [mm]": [float(x) * 1e3 for x in row.tip],
        "volume [mm^3]": row.volume * 1e9,
        "max stretch": row.max_stretch,
        "force [N]": row.force,
        "min gap [mm]": None if row.gap is None else row.gap * 1e3,
        "force obstacle [N]": None
        if row.obstacle_force is None
        else obstacle_forces(row, len(row.obstacle_force)),
    }


def record(
    problem: Problem,
    result: Result,
    deck: Mapping[str, Any],
    sources: Mapping[str, str],
    seconds: Mapping[str, float],
) -> dict[str, Any]:
    """The content of result.json.

    Parameters
    ----------
    problem, result : what was solved, and how far it came
    deck : the deck as resolved; written as TOML it gives the same run
    sources : volume -> where its material's numbers are from
    seconds : `mesh`, `assembly`, `linear`, `contact`, `total`, and `output`
    """
    touch = result.touch_pressure
    mesh = mesh_table(problem)
    return {
        "status": result.status,
        "message": result.message,
        "warnings": all_warnings(problem, result),
        "not stable from step": result.unstable_step,
        "first touch [kPa]": None if not touch else {name: value / 1e3 for name, value in touch.items()},
        "contact": problem.contact,
        "obstacles": len(problem.obstacles),
        "steps": len(result.rows),
        "last": row_table(result.rows[-1]) if result.rows else None,
        "dofs": result.dofs,
        "elements": result.elements,
        "newton_iterations": result.newton_iterations,
        "factorizations": result.factorizations,
        "seconds": {name: round(value, 3) for name, value in seconds.items()},
        "peak_rss_mb": peak_memory(),
        "versions": versions(),
        "deck": dict(deck),
        "materials": material_table(problem, sources),
        "mesh": mesh,
        "mesh_hash": mesh["hash"],
    }


def to_json(table: Mapping[str, Any]) -> str:
    """Strict JSON: a number that is not finite becomes null."""
    return json.dumps(_finite(table), indent=2, ensure_ascii=False) + "\n"


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(item) for item in value]
    if hasattr(value, "item") and getattr(value, "ndim", 0) == 0:
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
