"""Motion of a chain, M(q) q'' + C(q, q') q' + G(q) = torques (1), by MuJoCo.

The joint springs and dampers stand on the right of (1). Without damping: classical Runge-Kutta with steps
far below the shortest period. With damping: MuJoCo's implicit-in-velocity integrator, which takes steps of
a small part of damping/stiffness; the shortest periods of such light links (some tenths of a ms) are then
damped out, not resolved. What stiffens is held over a step.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.linalg import eigh

from fem_spa.errors import InputError
from fem_spa.reduced.chain_links import Links, inertia_matrix
from fem_spa.reduced.hysteresis import BoucWen

LONGEST = 1e-3
"""s, largest step."""


def highest_rate(links: Links) -> float:
    """Largest angular frequency of small vibrations at rest, rad/s."""
    mass = inertia_matrix(links, np.zeros(links.mass.size))
    return math.sqrt(float(eigh(np.diag(links.stiffness), mass, eigvals_only=True)[-1]))


def model_text(links: Links, gravity: complex, step: float, implicit: bool) -> str:
    """The chain as MuJoCo's XML: one body and one hinge about z a joint, frames along the world's at rest."""
    places = [links.start, *links.vector[:-1]]
    lines, closing = [], []
    for j, place in enumerate(places):
        c = links.centre[j]
        lines.append(
            f'<body pos="{place.real:.17g} {place.imag:.17g} 0">'
            + f'<joint axis="0 0 1" stiffness="{links.stiffness[j]:.17g}" damping="{links.damping[j]:.17g}"/>'
            + f'<inertial pos="{c.real:.17g} {c.imag:.17g} 0" mass="{links.mass[j]:.17g}" '
            + f'diaginertia="{" ".join([f"{links.inertia[j]:.17g}"] * 3)}"/>'
        )
        closing.append("</body>")
    tip = links.vector[-1]
    lines.append(f'<site name="tip" pos="{tip.real:.17g} {tip.imag:.17g} 0"/>')
    integrator = "implicitfast" if implicit else "RK4"
    return (
        f'<mujoco><compiler angle="radian"/><option timestep="{step:.17g}" integrator="{integrator}" '
        f'gravity="{gravity.real:.17g} {gravity.imag:.17g} 0"><flag contact="disable"/></option>'
        f"<worldbody>{''.join(lines)}{''.join(closing)}</worldbody></mujoco>"
    )


def time_step(links: Links) -> tuple[float, bool]:
    """s, and whether the implicit integrator is to be used."""
    resolved = 0.1 / highest_rate(links)
    damped = links.damping > 0
    if not np.all(damped):
        return min(resolved, LONGEST), False
    slow = 0.01 * float(np.min(links.damping / links.stiffness))
    return min(max(slow, resolved), LONGEST), True


def motion(
    links: Links,
    time: np.ndarray,
    torque: np.ndarray,
    start: np.ndarray,
    gravity: complex = 0j,
    law: BoucWen | None = None,
    step: float | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Turns q and their rates (n, m) at times (n,) s.

    Parameters
    ----------
    torque : (n, m) N m, linear between the times;  start : (m,) rad at time[0], at rest
    gravity : m/s^2 as x + iy;  law : hysteresis of every joint, (6) and (7), u in rad
    step : s; default `time_step`

    Raises
    ------
    InputError : MuJoCo is not there, or the motion blew up
    """
    mujoco = _mujoco()
    usual, implicit = time_step(links)
    model = mujoco.MjModel.from_xml_string(model_text(links, gravity, step or usual, implicit))
    data = mujoco.MjData(model)
    data.qpos[:] = start
    q, rate = np.empty_like(torque), np.empty_like(torque)
    q[0], rate[0] = start, 0.0
    z, before, nominal = np.zeros(start.size), start.copy(), model.opt.timestep
    for k in range(1, time.size):
        dt = float(time[k] - time[k - 1])
        pieces = max(1, math.ceil(dt / nominal - 1e-9))
        model.opt.timestep = dt / pieces
        change = (torque[k] - torque[k - 1]) / pieces
        for i in range(pieces):
            data.qfrc_applied[:] = torque[k - 1] + (i + 0.5) * change
            data.qfrc_applied[:] -= links.stiffness * links.stiffening * data.qpos**3
            if law is not None:
                data.qfrc_applied[:] -= links.stiffness * z
            mujoco.mj_step(model, data)
            if law is not None:
                z += _grown(z, data.qpos - before, law, links)
                before[:] = data.qpos
        q[k], rate[k] = data.qpos, data.qvel
    if not np.all(np.isfinite(q)) or np.any(data.warning.number):
        raise InputError("the motion of the chain blew up; give more damping, or a finer time")
    return q, rate


def _grown(z: np.ndarray, du: np.ndarray, law: BoucWen, links: Links) -> np.ndarray:
    """Change of z (m,) with the turns du (m,), (6) by the midpoint rule."""
    whole, turned = z / links.part, du / links.part
    mid = whole + 0.5 * _rate(whole, turned, law) * turned
    return _rate(mid, turned, law) * du


def _rate(z: np.ndarray, du: np.ndarray, law: BoucWen) -> np.ndarray:
    size = np.abs(z) ** law.n
    return law.A - (law.beta * np.sign(du) * np.sign(z) + law.alpha) * size


def _mujoco() -> Any:
    try:
        import mujoco
    except ImportError:
        raise InputError(
            'the motion of a chain needs MuJoCo, which is not installed: pip install "fem-spa[dynamics]", '
            "or leave `dynamics` out"
        ) from None
    if mujoco.get_mju_user_warning() is None:  # else a warning writes MUJOCO_LOG.TXT into the working folder
        mujoco.set_mju_user_warning(_silent)
    return mujoco


def _silent(_: str) -> None:
    """Warnings are counted in the data, and looked at there."""
