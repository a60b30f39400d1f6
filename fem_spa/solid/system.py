"""The discrete equilibrium of one problem: residual, constraints and tangent of all unknowns.

Unknowns x are displacements (3 n_nodes, m) and Lagrange pressures (n_vertices, Pa), and one pressure a
cavity (Pa). Equilibrium is stationarity of

    sum_el  integral W(I1bar, I2bar) + p (J - 1) - p^2 / 2K  +  membranes  -  sum_c P_c V_c(x)  -  f_dead . u

so that the tangent is symmetric. What leaves this module is dimensionless: lengths in units of the element
size L, stresses in units of the stiffest small-strain shear modulus mu, energy in mu L^3.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fem_spa.errors import InputError
from fem_spa.solid import kernel, pattern
from fem_spa.solid.base_spring import spring_of
from fem_spa.solid.cavity import Cavity, closing, plane_levels, triangle_rule
from fem_spa.solid.contact import Contact, Touching
from fem_spa.solid.invariants import stretches
from fem_spa.solid.membrane import make_membrane
from fem_spa.solid.problem import Problem
from fem_spa.solid.space import Space

AXES = {"x": 0, "y": 1, "z": 2}
_DEPTH = 0.1  # of the element size
_BATCH = 8192  # elements whose blocks are held at once


@dataclass(frozen=True)
class Evaluation:
    """Residual and what else one pass over the elements gives.

    residual : (n_free,) dimensionless;  error : dimensionless size of it, what tolerances are compared with
    volume : (n_cavities,) m^3 of the meshed part;  gradient : (n_cavities, n_free) dimensionless dV/dx
    min_jacobian : smallest J at a quadrature point;  worst : its element
    """

    residual: np.ndarray
    error: float
    volume: np.ndarray
    gradient: np.ndarray
    min_jacobian: float
    worst: int


class System:
    """Everything of a problem that does not change along its load path.

    Parameters
    ----------
    problem, space : the problem and the space of its mesh
    hold_tip : the nodes of `tip` are held (prescribed or blocked tip)
    """

    def __init__(self, problem: Problem, space: Space, hold_tip: bool = False) -> None:
        started = time.perf_counter()
        self.problem = problem
        self.space = space
        self.seconds = {"assembly": 0.0, "contact": 0.0}
        n = space.n_nodes
        self.n_u = 3 * n
        self.region_materials = [problem.materials[name] for name in space.region_names]
        moduli = [m.law.shear_modulus(**m.parameters) for m in self.region_materials]
        self.stress_unit = float(max(moduli))
        self.length_unit = float((space.weight.sum() / len(space.tets)) ** (1 / 3))
        self.energy_unit = self.stress_unit * self.length_unit**3
        # copies of the meshed part that make up the whole actuator (parallel planes count once), and those
        # of them that share one tip
        self.multiplicity = 2 ** len(set(problem.symmetry.values()))
        self.tip_copies = 2 ** len(set(problem.symmetry.values()) - set(_across(problem, space)))

        self.holds_tip = hold_tip
        self.held = self._held(hold_tip)
        dofs = np.empty((len(space.tets), kernel.N_LOCAL), dtype=np.int64)
        for i in range(3):
            dofs[:, 10 * i : 10 * i + 10] = 3 * space.tets + i
        dofs[:, kernel.N_U :] = self.n_u + space.tets[:, :4]
        self.element_dofs = dofs
        self.pattern = pattern.build_pattern(dofs, self.held)
        self._where = pattern.scatter_map(self.pattern, dofs)
        self._bare = self.pattern
        self._moved: np.ndarray | None = None  # where the bare pattern's entries are in one with contact
        scale = np.full(space.n_dofs, self.length_unit)
        scale[self.n_u :] = self.stress_unit
        self.scale = scale[self.pattern.free]
        self._free_u = self.pattern.free[self.pattern.free < self.n_u]
        self._entry_scale = self._entries(self.scale) / self.energy_unit

        self.cavities = problem.mesh.cavities
        levels = plane_levels(problem.symmetry, space.surfaces, space.points) if self.cavities else {}
        origin, share = closing(levels)
        self._cavities = [Cavity(space.surfaces[f"cavity {name}"], origin, share) for name in self.cavities]
        self._membranes = [
            make_membrane(
                space.surfaces[f"layer {name}"], space.points, layer.modulus, layer.thickness, layer.poisson
            )
            for name, layer in problem.layers.items()
        ]
        self.contact: Contact | None = None
        self.touching: Touching | None = None
        self.depth_allowed = _DEPTH * self.length_unit  # of walls inside one another on the way
        self._layer_stress: list[np.ndarray] | None = None
        self._face_dofs = [_face_dofs(c.faces) for c in self._cavities]
        self._layer_dofs = [_face_dofs(m.faces) for m in self._membranes]
        self._face_where = [pattern.scatter_map(self.pattern, d) for d in self._face_dofs]
        self._layer_where = [pattern.scatter_map(self.pattern, d) for d in self._layer_dofs]

        # below this, forces are rounding errors of the stiffest part
        sheet = max((m.trace + m.shear for m in self._membranes), default=0.0)
        self._force_floor = self.length_unit * max(1e-4 * self.stress_unit * self.length_unit, 1e-5 * sheet)
        shape = space.weight.shape
        self._inverse_bulk = np.zeros(len(space.tets))
        for name, material in zip(space.region_names, self.region_materials, strict=True):
            self._inverse_bulk[space.region_slices[name]] = 1.0 / material.bulk
        self._J: np.ndarray = np.ones(shape)
        self._I1: np.ndarray = np.full(shape, 3.0)
        self._I2: np.ndarray = np.full(shape, 3.0)
        self._W = np.zeros((5, *shape))
        self._evaluated = np.zeros(0)
        self._forces = np.empty((len(space.tets), kernel.N_LOCAL))
        self._blocks = np.empty((min(_BATCH, len(space.tets)), kernel.N_UPPER))
        self.dead = self._dead_forces()
        self.spring = spring_of(problem, space, self.dead, self.multiplicity)
        vertex_volume = np.zeros(space.n_vertices)
        np.add.at(vertex_volume, space.tets[:, :4], space.weight @ space.pressure_shape)
        self._volume_norm = float(np.linalg.norm(vertex_volume))
        self.seconds["assembly"] += time.perf_counter() - started

    # -- vectors ---------------------------------------------------------------------------------

    def rest(self) -> np.ndarray:
        """x at rest, (n_dofs,)."""
        return np.zeros(self.space.n_dofs)

    def displacement(self, x: np.ndarray) -> np.ndarray:
        """(n_nodes, 3) m."""
        return x[: self.n_u].reshape(-1, 3)

    def prescribe(self, x: np.ndarray, factor: float) -> None:
        """Set the tip's prescribed displacement, times `factor`, in x."""
        tip = self.problem.loads.tip_displacement
        if tip is not None:
            nodes = np.unique(self.space.surfaces["tip"])
            for i in range(3):
                x[3 * nodes + i] = factor * tip[i]

    def seen(self, x: np.ndarray) -> np.ndarray:
        """(n_nodes, 3) m as from outside, where the base is not held fast."""
        return self.displacement(x) if self.spring is None else self.spring.seen(self.displacement(x))

    # -- equilibrium -----------------------------------------------------------------------------

    def evaluate(self, x: np.ndarray, cavity_pressure: np.ndarray, dead_factor: float) -> Evaluation:
        """Residual at x under the cavities' pressures (Pa) and `dead_factor` times the dead loads."""
        started = time.perf_counter()
        s = self.space
        u, p = x[: self.n_u], x[self.n_u :]
        kernel.invariants(s.tets, s.inverse_jacobian, s.shape_gradient, u, self._J, self._I1, self._I2)
        self._evaluated = x.copy()
        worst = int(np.argmin(self._J)) // self._J.shape[1]
        j_min = float(self._J[worst].min())
        self._law()
        kernel.residual(
            s.tets,
            s.inverse_jacobian,
            s.weight,
            s.shape_gradient,
            s.pressure_shape,
            u,
            p,
            self._inverse_bulk,
            self._W[0],
            self._W[1],
            self._forces,
        )
        force = np.zeros(s.n_dofs)
        pattern.add_vectors(self.element_dofs, self._forces, force)
        displacement = self.displacement(x)
        for membrane, dofs in zip(self._membranes, self._layer_dofs, strict=True):
            pattern.add_vectors(dofs, membrane.residual(displacement), force)
        internal = float(norm(force[: self.n_u]))
        force -= dead_factor * (self.spring.turned(displacement, dead_factor) if self.spring else self.dead)
        position = s.points + displacement
        if self.contact is not None:
            began = time.perf_counter()
            self.touching = self.contact.evaluate(position)
            force[: self.n_u] += self.touching.force.ravel()
            self.seconds["contact"] += time.perf_counter() - began
            started += time.perf_counter() - began
        volume = np.array([c.volume(position) for c in self._cavities])
        gradient = np.zeros((len(self._cavities), s.n_dofs))
        for k, (cavity, dofs) in enumerate(zip(self._cavities, self._face_dofs, strict=True)):
            pattern.add_vectors(dofs, cavity.gradient(position), gradient[k])
            force -= cavity_pressure[k] * gradient[k]
        self.reaction = force  # of held unknowns: what the support exerts
        free = self.pattern.free
        out = force[free] * self.scale / self.energy_unit
        error_u = norm(force[self._free_u]) / max(internal, self._force_floor)
        error_p = norm(force[self.n_u :]) / self._volume_norm
        error = float(max(error_u, error_p))
        if j_min <= 0 or not np.isfinite(error):
            error = float("inf")
        self.seconds["assembly"] += time.perf_counter() - started
        unit = self.scale / self.length_unit**3
        return Evaluation(out, error, volume, gradient[:, free] * unit, j_min, worst)

    def tangent(self, x: np.ndarray, cavity_pressure: np.ndarray) -> np.ndarray:
        """(nnz,) dimensionless upper triangle of the tangent at x."""
        started = time.perf_counter()
        s = self.space
        u, p = x[: self.n_u], x[self.n_u :]
        if not np.array_equal(x, self._evaluated):
            kernel.invariants(s.tets, s.inverse_jacobian, s.shape_gradient, u, self._J, self._I1, self._I2)
            self._law()
            if self.contact is not None:
                self.contact.evaluate(s.points + self.displacement(x))
        data = np.zeros(self._bare.nnz + 1)
        for first in range(0, len(s.tets), _BATCH):
            last = min(first + _BATCH, len(s.tets))
            kernel.tangent(
                s.tets,
                first,
                last,
                s.inverse_jacobian,
                s.weight,
                s.shape_gradient,
                s.pressure_shape,
                u,
                p,
                self._inverse_bulk,
                self._W[0],
                self._W[1],
                self._W[2],
                self._W[3],
                self._W[4],
                self._blocks,
            )
            pattern.add_blocks(self._where[first:last], self._blocks, last - first, data)
        displacement = self.displacement(x)
        stresses = self._layer_stress or [m.stress(displacement) for m in self._membranes]
        for membrane, where, stress in zip(self._membranes, self._layer_where, stresses, strict=True):
            pattern.add_blocks(where, membrane.tangent(displacement, stress), len(where), data)
        position = s.points + displacement
        for pressure, cavity, where in zip(cavity_pressure, self._cavities, self._face_where, strict=True):
            if pressure != 0.0:
                pattern.add_blocks(where, -pressure * cavity.hessian(position), len(where), data)
        if self.contact is not None:
            began = time.perf_counter()
            data = self._with_contact(position, data)
            self.seconds["contact"] += time.perf_counter() - began
            started += time.perf_counter() - began
        out = data[:-1] * self._entry_scale
        self.seconds["assembly"] += time.perf_counter() - started
        return out

    def _with_contact(self, position: np.ndarray, bare: np.ndarray) -> np.ndarray:
        """The tangent's entries with those of contact; the pattern grows where pairs have no place in it."""
        assert self.contact is not None
        for attempt in range(2):
            if self._moved is None:
                data = bare.copy()
            else:
                data = np.zeros(self.pattern.nnz + 1)
                data[self._moved[:-1]] = bare[:-1]
            if self.contact.add_tangent(position, self.pattern, data):
                return data
            if attempt == 0:
                self.pattern, self._moved = pattern.extend_pattern(self._bare, *self.contact.reach(position))
                self._entry_scale = self._entries(self.scale) / self.energy_unit
        raise AssertionError("contact between faces that were not found to be near")

    def memory(self) -> dict[str, Any]:
        """What the next tangents depend on, besides the state: the layers' stress, the grown pattern."""
        grown = None
        if self._moved is not None:
            grown = [self.pattern.indptr, self.pattern.indices, self._moved]
        return {"layers": self._layer_stress, "grown": grown}

    def recall(self, memory: Mapping[str, Any]) -> None:
        """Go on from what `memory` gave."""
        self._layer_stress = memory["layers"]
        if memory["grown"] is not None:
            indptr, indices, self._moved = memory["grown"]
            self.pattern = pattern.Pattern(self._bare.number, self._bare.free, indptr, indices)
            self._entry_scale = self._entries(self.scale) / self.energy_unit

    def settle_layers(self, x: np.ndarray, increment: np.ndarray | None = None) -> None:
        """Fix the layers' stress that the next tangents use: that at x or, linearly, at x + increment.

        A Newton step that turns a stiff sheet stretches it in second order, and the tangent at that stretch
        throws the next step far off. With the stress as an unknown of its own (mixed integration points;
        Magisano, Leonetti and Garcea, Comput. Methods Appl. Mech. Engrg. 313, 2017) only the geometric part
        of the tangent changes, the residual and the limit of the iteration do not.
        """
        u = self.displacement(x)
        if increment is None:
            self._layer_stress = [m.stress(u) for m in self._membranes]
        else:
            du = self.displacement(increment)
            self._layer_stress = [m.linear_stress(u, du) for m in self._membranes]

    def hold_faces(self, hold: bool) -> None:
        """Whether points in contact keep the face they have, see contact.py."""
        if self.contact is not None:
            self.contact.hold = hold

    def max_stretch(self) -> tuple[float, int]:
        """Largest principal stretch at a quadrature point of the state last evaluated, and its element."""
        stretch = stretches(self._J, self._I1, self._I2)
        worst = int(np.argmax(stretch)) // stretch.shape[1]
        return float(stretch[worst].max()), worst

    def region_invariants(self, region: str) -> tuple[np.ndarray, np.ndarray, int]:
        """Isochoric I1, I2 (elements, n_q) of a region, as last evaluated, and its first element."""
        part = self.space.region_slices[region]
        return self._I1[part], self._I2[part], part.start

    def place(self, element: int) -> str:
        """Where an element is at rest, for messages."""
        centre = self.space.points[self.space.tets[element, :4]].mean(axis=0)
        where = ", ".join(f"{1e3 * c:.1f}" for c in centre)
        region = self.space.region_names[self.space.region[element]]
        return f"element {self.space.element_of[element]} of '{region}' at ({where}) mm"

    def tip_reaction(self) -> np.ndarray:
        """(3,) N of the whole actuator: what the held tip exerts on its holder, after `evaluate`."""
        nodes = np.unique(self.space.surfaces["tip"])
        total = -self.reaction[: self.n_u].reshape(-1, 3)[nodes].sum(axis=0) * self.tip_copies
        for axis in set(self.problem.symmetry.values()) - set(_across(self.problem, self.space)):
            total[AXES[axis]] = 0.0
        return total

    def inside(self) -> float:
        """How deep the deepest point of the state last evaluated is inside something, m."""
        return 0.0 if self.touching is None else self.touching.inside

    def whole_step(self, increment: np.ndarray) -> float:
        """Part of an increment (n_dofs,) that may be made at once: parts that share no node must not
        pass through one another unseen, and walls of one body cannot."""
        if self.contact is None or not self.contact.loose:
            return 1.0
        longest = float(np.abs(increment[: self.n_u]).max())
        return min(1.0, self.contact.longest_motion / max(longest, 1e-300))

    def obstacle_force(self) -> np.ndarray:
        """(n_obstacles, 3) N: what the whole actuator exerts on each obstacle, after `evaluate`."""
        assert self.touching is not None
        total = self.touching.on_obstacles * self.multiplicity
        for axis in set(self.problem.symmetry.values()):
            total[:, AXES[axis]] = 0.0
        return total

    # -- parts -----------------------------------------------------------------------------------

    def _law(self) -> None:
        for name, material in zip(self.space.region_names, self.region_materials, strict=True):
            part = self.space.region_slices[name]
            derivatives = material.law.derivatives(self._I1[part], self._I2[part], **material.parameters)
            for k in range(5):
                self._W[k, part] = derivatives[k]

    def _entries(self, scale: np.ndarray) -> np.ndarray:
        rows = np.repeat(np.arange(self.pattern.n_free), np.diff(self.pattern.indptr))
        return scale[rows] * scale[self.pattern.indices]

    def _held(self, hold_tip: bool) -> np.ndarray:
        s = self.space
        held = np.zeros(s.n_dofs, dtype=bool)
        for name in self.problem.fixed:
            nodes = np.unique(_surface(s, name))
            for i in range(3):
                held[3 * nodes + i] = True
        for name, axis in self.problem.symmetry.items():
            nodes = np.unique(_surface(s, name))
            held[3 * nodes + AXES[axis]] = True
        if hold_tip:
            nodes = np.unique(_surface(s, "tip"))
            for i in range(3):
                held[3 * nodes + i] = True
        return held

    def _dead_forces(self) -> np.ndarray:
        s = self.space
        out = np.zeros(s.n_dofs)
        loads = self.problem.loads
        force = out[: self.n_u].reshape(-1, 3)
        if any(loads.gravity):
            for name, material in zip(s.region_names, self.region_materials, strict=True):
                if material.density is None:
                    raise InputError(
                        f'gravity acts, but materials.{name} has no density; give density = "1080 kg/m^3"'
                    )
                part = s.region_slices[name]
                nodal = material.density * (s.weight[part] @ s.shape)
                for i in range(3):
                    np.add.at(force[:, i], s.tets[part], nodal * loads.gravity[i])
        if any(loads.tip_force):
            faces = _surface(s, "tip")
            weight, value, d1, d2 = triangle_rule(4)
            X = s.points[faces]
            normal = np.cross(np.einsum("fai,qa->fqi", X, d1), np.einsum("fai,qa->fqi", X, d2))
            nodal = np.einsum("fq,qa->fa", np.linalg.norm(normal, axis=-1) * weight, value)
            nodal /= nodal.sum()
            for i in range(3):
                np.add.at(force[:, i], faces, nodal * loads.tip_force[i] / self.tip_copies)
        return out


def inner(a: np.ndarray, b: np.ndarray) -> float:
    """a . b without BLAS, whose threads would fight with the kernels' for the cores."""
    return float(np.einsum("i,i->", a, b))


def norm(a: np.ndarray) -> float:
    """Euclidean norm, likewise."""
    return inner(a, a) ** 0.5


def cavity_values(system: System, values: Mapping[str, float]) -> np.ndarray:
    """A table cavity -> value as an array in the system's order of cavities."""
    return np.array([values[name] for name in system.cavities], dtype=float)


def _surface(space: Space, name: str) -> np.ndarray:
    try:
        return space.surfaces[name]
    except KeyError:
        found = ", ".join(f"'{s}'" for s in sorted(space.surfaces))
        raise InputError(f"no surface '{name}' in the mesh; it has {found}") from None


def _across(problem: Problem, space: Space) -> list[str]:
    """Axes whose plane of symmetry lies across the tip's normal: it mirrors the tip to another one."""
    if "tip" not in space.surfaces:
        return []
    X = space.points[space.surfaces["tip"][:, :3]]
    normal = np.cross(X[:, 1] - X[:, 0], X[:, 2] - X[:, 0]).sum(axis=0)
    normal /= max(np.linalg.norm(normal), 1e-300)
    return [axis for axis in set(problem.symmetry.values()) if abs(normal[AXES[axis]]) > 0.5]


def _face_dofs(faces: np.ndarray) -> np.ndarray:
    return (3 * faces[:, :, None] + np.arange(3)).reshape(len(faces), -1)
