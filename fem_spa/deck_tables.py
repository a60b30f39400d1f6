"""The tables of a deck, each a pydantic model: which keys there are, and what values they take."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, PlainSerializer, PlainValidator

from fem_spa.units import ATMOSPHERE, quantity


@dataclass(frozen=True)
class Measure:
    """A quantity as it was written, and its value in SI."""

    text: str | float
    si: float


def measure(unit: str, **limits: Any) -> Any:
    """The type of a deck value in `unit`; `limits` are those of `fem_spa.units.quantity`."""
    return Annotated[
        Measure,
        PlainValidator(lambda given: Measure(given, quantity(given, unit, **limits))),
        PlainSerializer(lambda value: value.text),
    ]


def per_cavity(value: Any) -> Any:
    """The type of a value for every cavity, or of a table cavity -> value; the key "" means every cavity."""
    return Annotated[
        dict[str, value],
        BeforeValidator(lambda given: given if isinstance(given, Mapping) else {"": given}),
        PlainSerializer(lambda table: _texts(table[""] if set(table) == {""} else table)),
    ]


def one_or_three(unit: str, **limits: Any) -> Any:
    """The type of a value in `unit`, or of a list of three."""

    def read(given: Any) -> Any:
        if not isinstance(given, list):
            return Measure(given, quantity(given, unit, **limits))
        if len(given) != 3:
            raise ValueError("one value or three are needed")
        return [Measure(value, quantity(value, unit, **limits)) for value in given]

    return Annotated[
        Any,
        PlainValidator(read),
        PlainSerializer(lambda value: [v.text for v in value] if isinstance(value, list) else value.text),
    ]


def _texts(value: Any) -> Any:
    return {k: v.text for k, v in value.items()} if isinstance(value, Mapping) else value.text


HIGHEST_PRESSURE = 100e6
PRESSURE_LIMITS = {"low": -ATMOSPHERE, "high": HIGHEST_PRESSURE}
VOLUME_LIMITS = {"positive": True, "high": 1.0}
RATIO_LIMITS = {"positive": True, "high": 1000.0}

Three = Field(min_length=3, max_length=3)
Strict = ConfigDict(extra="forbid", frozen=True)
Open = ConfigDict(extra="allow", frozen=True)
Axis = Literal["x", "y", "z"]
Flag = Annotated[bool, Field(strict=True)]
Count = Annotated[int, Field(strict=True, ge=1, le=100_000)]
Number = Annotated[float, Field(allow_inf_nan=False, ge=-1000.0, le=1000.0)]
Length = measure("m", high=2.0, low=-2.0, zero=True)
Force = measure("N", high=1e4, low=-1e4, zero=True)


class Geometry(BaseModel):
    """A built-in shape, whose parameters are the remaining keys, or a file."""

    model_config = Open
    shape: str | None = None
    file: str | None = None
    unit: str | None = None
    size: measure("m", low=1e-5, high=0.5) | None = None  # type: ignore[valid-type]

    @property
    def parameters(self) -> dict[str, Any]:
        """The keys that belong to the shape."""
        return dict(self.model_extra or {})


class MaterialTable(BaseModel):
    """A card, or a law whose parameters are the remaining keys."""

    model_config = Open
    card: str | None = None
    law: str | None = None
    bulk: measure("Pa", low=1e3, infinite=True) | None = None  # type: ignore[valid-type]
    density: measure("kg/m^3", low=1.0, high=25e3) | None = None  # type: ignore[valid-type]

    @property
    def parameters(self) -> dict[str, Any]:
        """The keys that belong to the law."""
        return dict(self.model_extra or {})


class LayerTable(BaseModel):
    """A membrane on an inner surface."""

    model_config = Strict
    modulus: measure("Pa", low=1e3, high=1e13)  # type: ignore[valid-type]
    thickness: measure("m", low=1e-7, high=0.1)  # type: ignore[valid-type]
    poisson: Annotated[float, Field(gt=-1.0, le=0.5)] = 0.3


class Supports(BaseModel):
    """What is held."""

    model_config = Strict
    fixed: list[str] = ["base"]
    base_compliance: measure("rad/(N*m)", low=0.0, high=1e3, zero=True) | None = None  # type: ignore[valid-type]
    symmetry: dict[str, Axis] | None = None


class Plane(BaseModel):
    model_config = Strict
    point: Annotated[list[Length], Three]  # type: ignore[valid-type]
    normal: Annotated[list[Number], Three]


class Sphere(BaseModel):
    """A ball, or an egg: an ellipsoid with semi-axes along x, y and z."""

    model_config = Strict
    centre: Annotated[list[Length], Three]  # type: ignore[valid-type]
    radius: one_or_three("m", positive=True, high=2.0)  # type: ignore[valid-type]


class Cylinder(BaseModel):
    model_config = Strict
    point: Annotated[list[Length], Three]  # type: ignore[valid-type]
    axis: Annotated[list[Number], Three]
    radius: measure("m", positive=True, high=2.0)  # type: ignore[valid-type]


class Obstacle(BaseModel):
    """A rigid body in the way: one of three."""

    model_config = Strict
    plane: Plane | None = None
    sphere: Sphere | None = None
    cylinder: Cylinder | None = None


class LoadsTable(BaseModel):
    """What drives the actuator, and in which order."""

    model_config = Strict
    pressure: per_cavity(measure("Pa", **PRESSURE_LIMITS)) | None = None  # type: ignore[valid-type]
    volume: per_cavity(measure("m^3", **VOLUME_LIMITS)) | None = None  # type: ignore[valid-type]
    volume_ratio: per_cavity(measure("1", **RATIO_LIMITS)) | None = None  # type: ignore[valid-type]
    gas_mass_ratio: per_cavity(measure("1", **RATIO_LIMITS)) | None = None  # type: ignore[valid-type]
    path: list[Any] | None = None
    points: Annotated[int, Field(strict=True, ge=1, le=10_000)] | None = None
    gravity: Annotated[list[Number], Three] | None = None
    tip_force: Annotated[list[Force], Three] | None = None  # type: ignore[valid-type]
    tip_displacement: Annotated[list[Length], Three] | None = None  # type: ignore[valid-type]
    control: Literal["pressure", "volume", "gas-mass"] = "pressure"
    contact: Flag = True
    obstacles: list[Obstacle] | None = None


class Observe(BaseModel):
    """What is read off."""

    model_config = Strict
    angle: Literal["tip-face", "chord", "tangent"] = "tip-face"
    blocked: Flag = False


class SolverTable(BaseModel):
    """How the path is walked; the answer does not depend on it."""

    model_config = Strict
    imposed_steps: Count | None = None
    tolerance: Annotated[float, Field(ge=1e-12, le=1e-3)] = 1e-8
    max_iterations: Annotated[int, Field(strict=True, ge=3, le=200)] = 15
    stop_at_touch: Annotated[bool, Field(strict=True)] = False
    contact_distance: Annotated[float, Field(ge=1e-3, le=0.2)] = 0.0133
    factors: Literal["auto", "double", "single"] = "auto"
