"""A checked deck -> the problem in SI: mesh, materials, layers, supports, load path."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fem_spa.deck import Deck, Drawing, end_of_path, nearest, refuse_unknown
from fem_spa.deck_tables import PRESSURE_LIMITS, RATIO_LIMITS, VOLUME_LIMITS, MaterialTable, Measure
from fem_spa.errors import InputError
from fem_spa.rigid import obstacles
from fem_spa.solid.base_spring import check_base
from fem_spa.solid.problem import Layer, Loads, Material, Problem, StepControl
from fem_spa.symmetry import check_across, check_declared, find_symmetry
from fem_spa.units import brief, quantity, show
from geometry.tagged import TaggedMesh

SMALLEST, LARGEST = 1e-3, 2.0
"""m: a body whose largest size is outside is a slip of unit."""


@dataclass(frozen=True)
class Setup:
    """What is solved and what the report says of it.

    sources : volume -> where its material's numbers are from;  warnings : plain sentences
    resolved : the deck with every default filled in, units as text
    mesh_seconds : spent on meshing or reading
    """

    problem: Problem
    steps: StepControl
    resolved: dict[str, Any]
    sources: dict[str, str]
    warnings: list[str]
    mesh_seconds: float


def prepare(deck: Deck) -> Setup:
    """Everything that the solver needs.

    Raises
    ------
    InputError, geometry.errors.GeometryError, materials.errors.MaterialError
        In one line: what was given, what is there, what to try.
    """
    shape, materials, sources = before_mesh(deck)
    begun = time.perf_counter()
    mesh = make_mesh(deck, shape)
    seconds = time.perf_counter() - begun
    check_names(deck, mesh.volumes, mesh.surfaces)
    symmetry = find_symmetry(deck, mesh)
    _check_held(deck, symmetry)
    _check_gravity(deck, materials)
    check_across(deck, mesh, symmetry, shape)
    loads = deck.loads
    problem = Problem(
        mesh=mesh,
        materials={name: materials[name] for name in mesh.volumes},
        layers={n: Layer(t.modulus.si, t.thickness.si, t.poisson) for n, t in deck.layers.items()},
        loads=Loads(
            points=load_points(deck, mesh, symmetry),
            control=loads.control,
            gravity=_three(loads.gravity) or (0.0, 0.0, 0.0),
            tip_force=_three(loads.tip_force) or (0.0, 0.0, 0.0),
            tip_displacement=_three(loads.tip_displacement),
        ),
        fixed=tuple(deck.supports.fixed),
        symmetry=symmetry,
        angle=deck.observe.angle,
        blocked=deck.observe.blocked,
        contact=loads.contact and not deck.solver.stop_at_touch,
        obstacles=obstacles(deck, mesh, symmetry),
        linear=shape is not None and shape.linear,
        base_compliance=deck.supports.base_compliance.si if deck.supports.base_compliance else 0.0,
    )
    solver = deck.solver
    steps = StepControl(
        solver.imposed_steps,
        solver.tolerance,
        solver.max_iterations,
        stop_at_touch=solver.stop_at_touch,
        contact_distance=solver.contact_distance,
        factors=solver.factors,
    )
    bare = [name for name in mesh.layers if name not in deck.layers]
    warnings = [
        f"The mesh has a surface 'layer {name}', but the deck has no [layers.{name}]: it carries no membrane."
        for name in bare
    ] + check_base(problem)
    if shape is None and "tip" not in mesh.surfaces:
        warnings.append(
            "The mesh has no surface 'tip', so there is no angle: name the face at the free end so."
        )
    return Setup(problem, steps, resolved_deck(deck, shape, symmetry), sources, warnings, seconds)


def before_mesh(deck: Deck) -> tuple[Any, dict[str, Material], dict[str, str]]:
    """The built-in shape (None for a file), and material and source of every volume: all that can be refused
    before there is a mesh; see `prepare`."""
    materials, sources = _materials(deck)
    shape = built_in(deck) if deck.geometry.shape is not None else None
    if shape is not None:
        check_names(deck, shape.volume_names(), shape.surface_names())
        if deck.supports.symmetry is not None:
            check_declared(deck.supports.symmetry, shape.surface_names())
    return shape, materials, sources


def built_in(deck: Drawing) -> Any:
    """The built-in shape of a deck with the deck's parameters, validated but not meshed."""
    from geometry.parameters import parameters
    from geometry.registry import SHAPES

    geometry = deck.geometry
    name = geometry.shape or ""
    if name not in SHAPES:
        raise InputError(
            f"given {brief(name)} for geometry.shape: there is no such shape{nearest(name, SHAPES)}"
        )
    if geometry.unit is not None:
        raise InputError(
            "given geometry.unit with geometry.shape: it is the unit of a file's numbers; leave it out"
        )
    known = {item.name: item for item in parameters(SHAPES[name])}
    refuse_unknown(geometry.parameters, [*known, "shape", "size"], "geometry")
    given: dict[str, Any] = {}
    for key, value in geometry.parameters.items():
        item = known[key]
        given[key] = (
            value if item.kind in ("flag", "pattern") else quantity(value, item.unit, f"geometry.{key}")
        )
        if item.kind == "count" and float(given[key]).is_integer():
            given[key] = int(given[key])
    shape = SHAPES[name](**given)
    shape.validate()
    return shape


def make_mesh(deck: Drawing, shape: Any = None) -> TaggedMesh:
    """The mesh of a deck: a built-in shape's, or that of a file (its path starts at the deck's folder).

    Where the deck names a folder of meshes, it is taken from there, or made and kept there.
    """
    if deck.meshes is None:
        return _new_mesh(deck, shape)
    from fem_spa.mesh_store import kept

    shape = shape or (built_in(deck) if deck.geometry.shape is not None else None)
    return kept(deck.meshes, deck, shape, lambda: _new_mesh(deck, shape))


def _new_mesh(deck: Drawing, shape: Any) -> TaggedMesh:
    geometry = deck.geometry
    size = None if geometry.size is None else geometry.size.si
    if geometry.shape is not None:
        mesh = (shape or built_in(deck)).mesh(size) if size is not None else (shape or built_in(deck)).mesh()
    else:
        refuse_unknown(geometry.parameters, ("file", "unit", "size"), "geometry")
        from geometry.files import UNITS, read_mesh

        if geometry.unit is not None and geometry.unit not in UNITS:
            raise InputError(
                f"given {brief(geometry.unit)} for geometry.unit: allowed are {', '.join(UNITS)}"
            )
        mesh = read_mesh(deck.folder / str(geometry.file), unit=geometry.unit, size=size, required=())
    extent = float(np.ptp(mesh.points, axis=0).max())
    if not SMALLEST <= extent <= LARGEST:
        size_text, allowed = (
            show(float(f"{extent:.3g}"), "m"),
            f"{show(SMALLEST, 'm')} to {show(LARGEST, 'm')}",
        )
        unit = geometry.unit or "the size's"
        raise InputError(
            f"the body's largest size is {size_text}; {allowed} is allowed: is geometry.unit ({unit}) right?"
        )
    return mesh


def _materials(deck: Deck) -> tuple[dict[str, Material], dict[str, str]]:
    """Material and source of every [materials.X]."""
    built, sources = {}, {}
    for name, table in deck.materials.items():
        where = f"materials.{name}"
        built[name], sources[name] = (
            _from_card(deck, table, where) if table.card is not None else _from_law(table, where)
        )
    return built, sources


def _from_card(deck: Deck, table: MaterialTable, where: str) -> tuple[Material, str]:
    from materials.card import load_card

    card = load_card(_card_path(deck, str(table.card)))
    _check_bulk(card.law, table, where)
    bulk = card.bulk if table.bulk is None else table.bulk.si
    density = card.density if table.density is None else table.density.si
    bulk = _bulk(card.law, card.parameters, bulk, where)
    return Material(card.law, dict(card.parameters), bulk, density, card), f"card {card.name}: {card.source}"


def _card_path(deck: Deck, card: str) -> str:
    """A card's name, or its path from the deck's folder."""
    is_path = card.endswith(".toml") or "/" in card or "\\" in card
    return str(deck.folder / card) if is_path else card


def _from_law(table: MaterialTable, where: str) -> tuple[Material, str]:
    from materials.registry import law, resolve

    try:
        chosen = law(str(table.law))
    except ValueError as error:
        raise InputError(f"given {brief(table.law)} for {where}.law: {error}") from None
    refuse_unknown(table.parameters, [*chosen.parameters, "law", "bulk", "density"], where)
    given = {
        key: quantity(value, chosen.parameters[key], f"{where}.{key}")
        for key, value in table.parameters.items()
    }
    full = resolve(chosen, given, where)
    _check_bulk(chosen, table, where)
    bulk = float("inf") if table.bulk is None else table.bulk.si
    bulk = _bulk(chosen, full, bulk, where)
    return Material(chosen, full, bulk, None if table.density is None else table.density.si), "the deck"


def _check_bulk(law: Any, table: MaterialTable, where: str) -> None:
    """Refuse a bulk modulus beside a law whose own parameters give it."""
    if table.bulk is not None and law.bulk is not None:
        raise InputError(
            f"given {brief(table.bulk.text)} for {where}.bulk: the law {law.name} gives its own from "
            f"{', '.join(law.parameters)}; leave bulk out"
        )


def _bulk(law: Any, parameters: Mapping[str, float], bulk: float, where: str) -> float:
    """The bulk modulus, Pa, once it is seen to fit the shear modulus."""
    from materials.errors import MaterialError
    from materials.registry import small_strain

    try:
        return small_strain(law, parameters, bulk).K
    except MaterialError as error:
        raise InputError(f"{where}: {error}") from None


def check_names(
    deck: Deck, volumes: Sequence[str] | Mapping[str, Any], surfaces: Sequence[str] | Mapping[str, Any]
) -> None:
    """Every name that the deck speaks of must be there, and every volume needs a material."""
    for name in deck.materials:
        if name not in volumes:
            raise InputError(
                f"given materials.{name}: the mesh has no volume '{name}'{nearest(name, volumes)}"
            )
    for name in volumes:
        if name not in deck.materials:
            raise InputError(
                f"materials.{name} is missing: the volume '{name}' needs a material, for example "
                f'[materials.{name}] with card = "dragon-skin-30"'
            )
    layers = [name[6:] for name in surfaces if name.startswith("layer ")]
    for name in deck.layers:
        if name not in layers:
            raise InputError(
                f"given layers.{name}: the mesh has no surface 'layer {name}'{nearest(name, layers)}"
            )
    for name in deck.supports.fixed:
        _need_surface(name, surfaces, "supports.fixed")
    for name in deck.supports.symmetry or {}:
        _need_surface(name, surfaces, "supports.symmetry")
    cavities = [name[7:] for name in surfaces if name.startswith("cavity ")]
    if not cavities:
        raise InputError(
            "the mesh has no cavity: name at least one surface 'cavity NAME', closed around its air"
        )
    for key in ("tip_force", "tip_displacement"):
        if getattr(deck.loads, key) is not None:
            _need_surface("tip", surfaces, f"loads.{key}")
    if deck.observe.blocked:
        _need_surface("tip", surfaces, "observe.blocked")
    key, end = end_of_path(deck.loads)
    _spread(end, sorted(cavities), f"loads.{key}")


def _need_surface(name: str, surfaces: Any, where: str) -> None:
    if name not in surfaces:
        raise InputError(f"given {where}: the mesh has no surface '{name}'{nearest(name, surfaces)}")


def _check_held(deck: Deck, symmetry: Mapping[str, str]) -> None:
    if not deck.supports.fixed and set(symmetry.values()) != {"x", "y", "z"}:
        raise InputError(
            "supports.fixed is empty: the body would float; name a surface, or symmetry planes of x, y and z"
        )


def _check_gravity(deck: Deck, materials: Mapping[str, Material]) -> None:
    if any(deck.loads.gravity or ()):
        for name, material in materials.items():
            if material.density is None:
                raise InputError(
                    f'materials.{name}.density is missing: gravity acts, for example density = "1080 kg/m^3"'
                )


def _three(values: Any) -> tuple[float, float, float] | None:
    if values is None:
        return None
    x, y, z = (value.si if isinstance(value, Measure) else float(value) for value in values)
    return x, y, z


_UNIT: dict[str, tuple[str, dict[str, Any]]] = {
    "pressure": ("Pa", PRESSURE_LIMITS),
    "volume": ("m^3", VOLUME_LIMITS),
    "volume_ratio": ("1", RATIO_LIMITS),
    "gas_mass_ratio": ("1", RATIO_LIMITS),
}


def load_points(deck: Deck, mesh: TaggedMesh, symmetry: Mapping[str, str]) -> list[dict[str, float]]:
    """The load points in the unit of the control (Pa, m^3, or ratio of gas mass), the last the end.

    Parameters
    ----------
    deck : its [loads] pressure, volume, volume_ratio or gas_mass_ratio, and path or points
    mesh : for the cavities and their rest volumes
    symmetry : surface -> axis; each plane doubles the enclosed volume
    """
    key, given = end_of_path(deck.loads)
    cavities = mesh.cavities
    last = _spread(given, cavities, f"loads.{key}")
    order = list(given)
    if "" in given:
        order = list(cavities)
        if len(cavities) > 1 and any(isinstance(entry, list) for entry in deck.loads.path or []):
            raise InputError(
                f"given lists in loads.path, and loads.{key} has one value for all of {', '.join(cavities)}: "
                f"name them: {{ {', '.join(f'{name} = ...' for name in cavities)} }}"
            )
    points = [_path_point(entry, key, cavities, order, i) for i, entry in enumerate(deck.loads.path or [])]
    rest = dict.fromkeys(cavities, 1.0 if key in ("volume_ratio", "gas_mass_ratio") else 0.0)
    if key == "volume":
        rest = rest_volumes(mesh, symmetry)
    if deck.loads.points:
        count = deck.loads.points
        points = [{c: rest[c] + (last[c] - rest[c]) * i / count for c in cavities} for i in range(1, count)]
    if not points or points[-1] != last:
        points.append(last)
    if key == "volume_ratio":
        volumes = rest_volumes(mesh, symmetry)
        return [{c: point[c] * volumes[c] for c in cavities} for point in points]
    return points


def _spread(given: Mapping[str, Measure], cavities: Sequence[str], where: str) -> dict[str, float]:
    """A value for every cavity from the deck's value or table."""
    if "" in given:
        return dict.fromkeys(cavities, given[""].si)
    for name in given:
        if name not in cavities:
            raise InputError(
                f"given {where}.{name}: the mesh has no cavity '{name}'{nearest(name, cavities)}"
            )
    for name in cavities:
        if name not in given:
            raise InputError(f"{where}.{name} is missing: every cavity needs a value ({', '.join(cavities)})")
    return {name: given[name].si for name in cavities}


def _path_point(
    entry: Any, key: str, cavities: Sequence[str], order: Sequence[str], number: int
) -> dict[str, float]:
    """One entry of loads.path: a value for all, a list in the order of the end's table, or a table."""
    where = (
        f"loads.{key.replace('pressure', 'path')}.{number}" if key == "pressure" else f"loads.path.{number}"
    )
    unit, limits = _UNIT[key]

    def read(value: Any, name: str) -> Measure:
        return Measure(value, quantity(value, unit, f"{where}{name}", **limits))

    if isinstance(entry, Mapping):
        return _spread({name: read(value, f".{name}") for name, value in entry.items()}, cavities, where)
    if isinstance(entry, list):
        if len(entry) != len(order):
            raise InputError(
                f"given {brief(entry)} for {where}: {len(order)} values are needed ({', '.join(order)})"
            )
        return _spread(
            {name: read(value, f".{name}") for name, value in zip(order, entry, strict=True)}, cavities, where
        )
    return _spread({"": read(entry, "")}, cavities, where)


def rest_volumes(mesh: TaggedMesh, symmetry: Mapping[str, str]) -> dict[str, float]:
    """Cavity -> enclosed volume of the whole actuator at rest, m^3."""
    from fem_spa.solid.cavity import Cavity, closing, plane_levels
    from geometry.second_order import to_second_order

    mesh = to_second_order(mesh)
    origin, share = closing(plane_levels(symmetry, mesh.surfaces, mesh.points))
    copies = 2.0 ** len(set(symmetry.values()))
    return {
        c: copies * Cavity(mesh.surfaces[f"cavity {c}"], origin, share).volume(mesh.points)
        for c in mesh.cavities
    }


def resolved_deck(deck: Deck, shape: Any, symmetry: Mapping[str, str]) -> dict[str, Any]:
    """The deck with defaults filled in; written as TOML anywhere, it gives the same run."""
    table = deck.table()
    geometry = table["geometry"]
    if shape is not None:
        from geometry.parameters import parameters

        written = {item.name: getattr(shape, item.name) for item in parameters(shape)}
        for item in parameters(shape):
            if item.name not in geometry:
                plain = item.kind in ("count", "flag", "pattern")
                geometry[item.name] = written[item.name] if plain else show(written[item.name], item.unit)
        geometry.setdefault("size", show(shape.default_size, "m"))
    else:
        geometry["file"] = str((deck.folder / str(deck.geometry.file)).resolve())
    for material in table["materials"].values():
        if "card" in material and _card_path(deck, material["card"]) != material["card"]:
            material["card"] = str(Path(_card_path(deck, material["card"])).resolve())
    table["supports"]["symmetry"] = dict(symmetry)
    return table
