"""Chain of arcs: against the integrated curve, the printed product of matrices, differences, and back."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fem_spa.errors import InputError
from fem_spa.reduced.curvature import along, arc, jacobian, joints, pose, tip
from fem_spa.reduced.curvature_inverse import inverse
from fem_spa.reduced.finger import finger


def spin(axis: int, angle: float) -> np.ndarray:
    """(4, 4) rotation about x (0) or z (2)."""
    T, c, s = np.eye(4), np.cos(angle), np.sin(angle)
    i, j = (1, 2) if axis == 0 else (0, 1)
    T[[i, i, j, j], [i, j, i, j]] = c, -s, s, c
    return T


def test_arc_is_the_product_of_the_five_steps() -> None:
    """(26) with (21) to (25), the cosine put back in (25)."""
    turn, length, direction = 0.7, 9e-3, 0.4
    shift = np.eye(4)
    shift[0, 3] = length * np.sin(turn / 2) / (turn / 2)
    half = spin(2, turn / 2)
    product = spin(0, -direction) @ half @ shift @ half @ spin(0, direction)
    assert arc(np.array(turn), np.array(length), direction) == pytest.approx(product, abs=1e-15)


def integrated(turns: np.ndarray, lengths: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """End pose of the curve by integrating its frame, R' = R [k], r' = R e_x, chamber by chamber."""
    state = np.concatenate([np.eye(3).ravel(), np.zeros(3)])
    for t, L, a in zip(turns, lengths, directions, strict=True):
        k = t / L * np.array([0.0, np.sin(a), np.cos(a)])
        cross = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])

        def rate(_: float, y: np.ndarray, cross: np.ndarray = cross) -> np.ndarray:
            R = y[:9].reshape(3, 3)
            return np.concatenate([(R @ cross).ravel(), R[:, 0]])

        state = solve_ivp(rate, (0.0, L), state, method="DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = state[:9].reshape(3, 3), state[9:]
    return T


@pytest.mark.parametrize("seed", range(3))
def test_product_is_the_integrated_curve(seed: int) -> None:
    """To 1e-10, in the plane and out of it, straight chambers among them."""
    rng = np.random.default_rng(seed)
    turns = rng.uniform(-0.6, 0.9, 15) * (rng.random(15) > 0.2)
    lengths = rng.uniform(2e-3, 9e-3, 15)
    directions = rng.uniform(-2.0, 2.0, 15) if seed else np.zeros(15)
    exact = integrated(turns, lengths, directions)
    assert joints(turns, lengths, directions)[-1] == pytest.approx(exact, abs=1e-10)


def test_the_finger_of_the_egg_is_the_integrated_curve() -> None:
    model = finger()
    turns, lengths = model.chain(model.module_angles(np.array([[20e3, 13.9e3]])))
    exact = integrated(turns[0], lengths, np.zeros(15))
    assert tip(turns, lengths)[0] == pytest.approx(exact[:3, 3], abs=1e-10)
    assert np.arctan2(exact[1, 0], exact[0, 0]) == pytest.approx(turns.sum(), abs=1e-10)


def test_pose_within_a_chamber() -> None:
    """The middle of a chamber cut in two is the joint of its halves; ends are the joints themselves."""
    turns, lengths = np.array([0.3, 0.5, -0.2]), np.array([9e-3, 7e-3, 5e-3])
    halves = joints(np.array([0.3, 0.25, 0.25]), np.array([9e-3, 3.5e-3, 3.5e-3]))
    assert pose(turns, lengths, 1.5) == pytest.approx(halves[2])
    assert joints(turns, lengths)[1:] == pytest.approx(along(turns, lengths, 7)[7::7])
    assert pose(turns, lengths, 2) == pytest.approx(joints(turns, lengths)[2])
    with pytest.raises(ValueError, match="of a chain of 3"):
        pose(turns, lengths, 3.1)


@pytest.mark.parametrize("place", [None, 3.4, 5.0])
def test_jacobian_against_differences(place: float | None) -> None:
    rng = np.random.default_rng(1)
    turns, lengths, directions = rng.uniform(-0.5, 0.8, 6), rng.uniform(4e-3, 9e-3, 6), rng.uniform(-1, 1, 6)
    turns[2], turns[4] = 0.0, 3e-3  # where the series stand in

    def at(q: np.ndarray) -> np.ndarray:
        return pose(q, lengths, 6.0 if place is None else place, directions)

    J = jacobian(turns, lengths, directions, place)
    for k in range(6):
        e = np.zeros(6)
        e[k] = 1e-6
        change = (at(turns + e) - at(turns - e)) / 2e-6
        assert J[:3, k] == pytest.approx(change[:3, 3], abs=1e-10)
        skew = change[:3, :3] @ at(turns)[:3, :3].T
        assert J[3:, k] == pytest.approx([skew[2, 1], skew[0, 2], skew[1, 0]], abs=1e-8)


def test_inverse_of_forward_over_the_workspace() -> None:
    """From pressures to the tip and back: the same pressures are among the solutions, to 1e-6."""
    model = finger()
    for slow in np.linspace(2e3, 79e3, 6):
        for fast in np.linspace(1e3, 39e3, 6):
            modules = model.module_angles(np.array([[slow, fast]]))
            found = inverse(model, tip(*model.chain(modules))[0])
            assert found.reached and found.distance < 1e-6
            errors = [np.abs(q - modules[0]).max() for q in (found.angles, *found.others)]
            assert min(errors) < 1e-6
            if not found.others:
                assert found.pressures == pytest.approx([slow, fast], rel=1e-6)


def test_a_chamber_of_the_slow_module_needs_one_pressure_only() -> None:
    model = finger()
    turns, lengths = model.chain(model.module_angles(np.array([[31e3, 0.0]])))
    found = inverse(model, pose(turns, lengths, 6.5)[0, :3, 3], place=6.5)
    assert found.reached and found.pressures == pytest.approx([31e3, 0.0], abs=1e-3)


def test_outer_face_instead_of_the_paper() -> None:
    """The point of contact lies t2 off the paper, along the local y."""
    model = finger()
    end = pose(*model.chain(model.module_angles(np.array([[25e3, 15e3]]))), 15)[0]
    found = inverse(model, end[:3, 3] + 2e-3 * end[:3, 1], offset=2e-3)
    assert found.reached and found.pressures == pytest.approx([25e3, 15e3], rel=1e-6)


@pytest.mark.parametrize("point", [(0.2, 0.05, 0.0), (0.05, -0.06, 0.0), (0.08, 0.05, 0.02), (0.0, 0.0, 0.0)])
def test_unreachable_says_so_and_gives_the_nearest(point: tuple[float, ...]) -> None:
    """Nearest by a fine search over all postures; off the plane the height alone keeps it away."""
    model = finger()
    found = inverse(model, np.array(point))
    assert not found.reached and "out of reach" in found.message
    largest = model.module_angles(np.array([[80e3, 40e3]]))[0]
    grid = np.stack(np.meshgrid(*(np.linspace(0, top, 120) for top in largest)), -1).reshape(-1, 2)
    best = np.linalg.norm(tip(*model.chain(grid)) - point, axis=1).min()
    assert found.distance <= best + 1e-9
    assert found.distance == pytest.approx(best, rel=1e-2)
    assert found.distance == pytest.approx(np.linalg.norm(found.point - point))


def test_bad_questions_are_refused() -> None:
    model = finger()
    with pytest.raises(InputError, match="two or three"):
        inverse(model, np.array([0.1]))
    with pytest.raises(InputError, match="15 chambers"):
        inverse(model, np.array([0.1, 0.0]), place=16)
    with pytest.raises(InputError, match="2 positive pressures"):
        inverse(model, np.array([0.1, 0.0]), limits=(80e3,))
