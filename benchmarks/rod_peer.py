"""The arm in PyElastica: the same nodes, stiffness, damping, gravity and pressures as fem_spa's rod."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from fem_spa.reduced.rod import Rod
from fem_spa.reduced.rod_section import straight


def peer_tip(model: Rod, strain: np.ndarray, grid: float, step: float) -> tuple[np.ndarray, float]:
    """Tip (m, 3) at points `grid` s apart under spontaneous strains (m, 3), hanging; and the seconds it took.

    The strains run linearly between the points, as `Rod.march` has them; `step` s must divide `grid`.
    """
    import elastica as ea

    class Simulator(ea.BaseSystemCollection, ea.Constraints, ea.Forcing, ea.Damping):  # type: ignore[misc]
        pass

    class Pressure(ea.NoForces):  # type: ignore[misc]
        """Spontaneous strains over time."""

        def apply_forces(self, system: Any, time: float = 0.0) -> None:
            place = min(time / grid, len(strain) - 1.0)
            row = min(int(place), len(strain) - 2)
            now = strain[row] + (place - row) * (strain[row + 1] - strain[row])
            system.rest_sigma[2] = now[0]
            system.rest_kappa[0] = now[1]
            system.rest_kappa[1] = now[2]

    d, value = model.discrete(), model.values()

    class Damper(ea.DamperBase):  # type: ignore[misc]
        """(31), (32)."""

        def dampen_rates(self, system: Any, time: float) -> None:
            system.velocity_collection *= np.exp(-value["translational_damping"] * step)
            system.omega_collection *= np.exp(-d.slow * step)[:, None] ** system.dilatation

    rod = ea.CosseratRod.straight_rod(
        d.n,
        np.zeros(3),
        np.array([0.0, 0.0, -1.0]),
        np.array([-1.0, 0.0, 0.0]),
        value["length"],
        0.01,
        value["density"],
        youngs_modulus=value["modulus"],
    )
    simulator = Simulator()
    simulator.append(rod)
    rod.mass[:] = d.mass
    for j in range(3):
        rod.mass_second_moment_of_inertia[j, j] = d.inertia[j]
        rod.inv_mass_second_moment_of_inertia[j, j] = 1.0 / d.inertia[j]
        rod.shear_matrix[j, j] = d.axial[j]
        rod.bend_matrix[j, j] = d.bending[j]
    simulator.constrain(rod).using(
        ea.OneEndFixedBC, constrained_position_idx=(0,), constrained_director_idx=(0,)
    )
    simulator.add_forcing_to(rod).using(Pressure)
    simulator.add_forcing_to(rod).using(ea.GravityForces, acc_gravity=model.pull(0.0))
    simulator.dampen(rod).using(Damper)
    simulator.finalize()
    _, r, _ = model.rest(model.strains(np.zeros((1, 3))))
    assert np.allclose(straight(d)[1][0].reshape(3, 3), rod.director_collection[:, :, 0])
    rod.position_collection[:] = r.T
    stepper = ea.PositionVerlet()
    out = np.empty((len(strain), 3))
    out[0] = rod.position_collection[:, -1]
    each, now = round(grid / step), 0.0
    now = stepper.step(simulator, now, 1e-12)  # compiles
    start = time.perf_counter()
    for row in range(1, len(strain)):
        for _ in range(each):
            now = stepper.step(simulator, now, step)
        out[row] = rod.position_collection[:, -1]
    return out, time.perf_counter() - start
