"""Composite finger: sections and moments by other means, virtual work by quadrature, limits, bad input."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

from fem_spa.errors import InputError
from fem_spa.reduced import finger_beam, finger_fast, finger_slow
from fem_spa.reduced.finger import finger
from fem_spa.reduced.finger_sizes import BASE, CALIBRATED, SIZES, parameters, values
from fem_spa.reduced.model import Drive
from fem_spa.reduced.registry import model_text, read_model
from geometry.pneunet import PneuNet

SIZE = values(parameters())
EGG = np.array([[20e3, 13.9e3]])


def drive(*rows: tuple[float, ...]) -> Drive:
    return Drive(np.arange(len(rows), dtype=float), np.array(rows))


def inside(y: float, z: float, width: float, radius: float) -> bool:
    """Whether a point of the section is under an arch over walls from the floor t1."""
    top = SIZE["t1"] + SIZE["h1"]
    return (SIZE["t1"] <= z <= top and abs(y) < width / 2) or (z > top and math.hypot(y, z - top) < radius)


def test_section_by_counting_points() -> None:
    """A width of (12) that is dropped, or an arch about another centre, is off by far more than 0.5 %."""
    h = 0.05e-3
    y, z = np.meshgrid(np.arange(-10e-3 + h / 2, 10e-3, h), np.arange(-2e-3 + h / 2, 22e-3, h))
    flat = [(float(b), float(a)) for a, b in zip(z.ravel(), y.ravel(), strict=True)]
    air = np.array([inside(b, a, SIZE["w1"], SIZE["r1"]) for b, a in flat])
    block = np.array([a < SIZE["t1"] or inside(b, a, SIZE["w2"], SIZE["r2"]) for b, a in flat])
    height = np.array([a for _, a in flat])
    assert finger_slow.drive_moment(SIZE) == pytest.approx(h * h * height[air].sum(), rel=5e-3)
    assert finger_slow.second_moment(SIZE) == pytest.approx(
        h * h * (height[block & ~air] ** 2).sum(), rel=5e-3
    )


def test_linear_and_yeoh_agree_at_small_angles_only() -> None:
    """(8) is the tangent of (7); at 40 kPa the rubber softens by a fifth."""
    ratio = finger_slow.angle(np.array([1.0, 40e3]), SIZE, "yeoh") / finger_slow.angle(
        np.array([1.0, 40e3]), SIZE, "linear"
    )
    assert ratio[0] == pytest.approx(1.0, abs=1e-5)
    assert 1.2 < ratio[1] < 1.35


@pytest.mark.parametrize("law", ["linear", "yeoh"])
def test_slow_pressure_is_the_inverse_of_the_angle(law: str) -> None:
    P = np.linspace(-20e3, 120e3, 15)
    assert finger_slow.pressure(finger_slow.angle(P, SIZE, law), SIZE, law) == pytest.approx(P, abs=1e-3)


@pytest.mark.parametrize("high", [2e3, 120e3])
def test_long_records_are_as_exact_as_short_ones(high: float) -> None:
    """More than 200 pressures go through an interpolation: it holds down to zero and below."""
    P = np.linspace(-20e3, high, 1000)
    few = P[::50]
    model = finger()
    both = model.module_angles(np.column_stack([P, P]))[::50]
    assert both == pytest.approx(model.module_angles(np.column_stack([few, few])), abs=1e-9)


def test_stress_is_the_derivative_of_the_energy() -> None:
    """(7) from (5), and its slope, by differences."""
    C10, C20 = SIZE["C10"], SIZE["C20"]

    def energy(s: float) -> float:
        d = s - 1 / s
        return C10 * d**2 + C20 * d**4

    for s in (0.8, 1.0, 1.3, 1.9):
        e = 1e-5
        numeric = (energy(s + e) - energy(s - e)) / (2 * e)
        assert finger_slow.stress(np.array(s), C10, C20, "yeoh") == pytest.approx(numeric, rel=1e-8, abs=1e-2)
        pair = finger_slow.stress(np.array([s - e, s + e]), C10, C20, "yeoh")
        slope = finger_slow.stress_slope(np.array(s), C10, C20, "yeoh")
        assert slope == pytest.approx((pair[1] - pair[0]) / (2 * e), rel=1e-8)


def test_virtual_work_is_an_energy_balance() -> None:
    """Pressure's work over V_p, integrated along the path, is the rubber's energy: (13) with (14) to (19)."""
    end = 0.6
    s = float(finger_fast.stretch(np.array(end)))
    d = s - 1 / s
    stored = finger_fast.rubber_volume(SIZE) * (SIZE["C10"] * d**2 + SIZE["C20"] * d**4)
    block = finger_fast.block_volume(SIZE)

    def power(t: float) -> float:
        e = 1e-6
        growth = (finger_fast.stretch(np.array(t + e)) - finger_fast.stretch(np.array(t - e))) / (2 * e)
        return float(finger_fast.opening_pressure(np.array(t), SIZE) * block * growth)

    assert quad(power, 0.0, end)[0] == pytest.approx(stored, rel=1e-7)


def test_block_is_the_volume_of_the_drawing() -> None:
    """(14) with h2 for h3: the fast module without channel and last gap, meshed by nobody."""
    shape = PneuNet(slow_chambers=0)
    assert (shape.fast_wall_height, shape.bridge, shape.gap) == pytest.approx((10e-3, 3e-3, 2e-3))
    chamber = 5e-3 * (math.pi * 10e-3**2 / 2 + 20e-3 * 14e-3)
    assert finger_fast.block_volume(SIZE) == pytest.approx(chamber + 7e-3 * 20e-3 * 2e-3)
    air = 3e-3 * (math.pi * 8e-3**2 / 2 + 16e-3 * 10e-3)
    assert finger_fast.block_volume(SIZE) - finger_fast.rubber_volume(SIZE) == pytest.approx(air)


@pytest.mark.parametrize("opening", [0.05, 0.4, 1.2])
def test_crowns_meet_in_the_plane_between_neighbours(opening: float) -> None:
    """Drawn in the plane: the crown of a chamber that is turned by half the angle lies in x = 0."""
    free = SIZE["h2"] + SIZE["r3"] - SIZE["t3"]
    foot = SIZE["t1"] + SIZE["t3"]
    radius = free / 2 / math.sin(opening)
    around = np.linspace(-opening, opening, 4001)
    bulge = radius * (np.cos(around) - math.cos(opening))
    height = foot + free / 2 + radius * np.sin(around)
    pressure = finger_fast.opening_pressure(np.array([opening]), SIZE)
    half = float(finger_fast.angle(pressure, SIZE, chambers=2)[0]) / 2
    # the chamber stands left of the plane and turns away from it about the paper; its wall bulges back
    x = bulge * math.cos(half) - height * math.sin(half)
    crown = int(np.argmax(bulge))
    assert x[crown] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("reading", finger_fast.READINGS)
def test_fast_pressure_is_the_inverse_of_the_angle(reading: str) -> None:
    P = np.array([0.0, 1.0, 500.0, 13.9e3, 40e3])
    angle = finger_fast.angle(P, SIZE, 6, reading)
    assert finger_fast.pressure(angle, SIZE, 6, reading) == pytest.approx(P, rel=1e-9, abs=1e-9)
    assert finger_fast.angle(np.array([-5e3]), SIZE, 6, reading)[0] == 0.0


def test_fast_angle_begins_as_the_root_of_the_pressure() -> None:
    low = finger_fast.angle(np.array([0.01, 0.04]), SIZE, 6)
    assert low[1] / low[0] == pytest.approx(2.0, rel=1e-5)


def test_one_chamber_has_no_neighbour_to_squeeze() -> None:
    assert finger_fast.angle(np.array([30e3]), SIZE, 1)[0] == 0.0
    assert math.isinf(finger_fast.pressure(np.array([0.1]), SIZE, 1)[0])


def test_egg_example() -> None:
    """The paper needs 100.4 deg at 20 and 13.9 kPa; the print of (20) gives 160."""
    ours = np.rad2deg(finger().simulate(drive(tuple(EGG[0]))))[0, 0]
    assert ours == pytest.approx(101.0, abs=0.1)
    printed = np.rad2deg(finger(stress="linear", reading="printed").simulate(drive(tuple(EGG[0]))))[0, 0]
    assert printed == pytest.approx(159.9, abs=0.1)


def test_cantilever_is_euler_bernoulli() -> None:
    """A fibre strain of z kappa, uniaxial stress 6 C10 per strain: the moment is the pressure's."""
    angle = float(finger_beam.slow_angle(np.array(10e3), SIZE))
    z, area = finger_slow.strips(SIZE)
    moment = float(area @ (6 * SIZE["C10"] * z * angle / SIZE["l1"] * z))
    assert moment == pytest.approx(10e3 * finger_slow.drive_moment(SIZE))
    stiff = dict(SIZE) | {"l2": 0.0}
    assert finger_beam.fast_angle(np.array(10e3), stiff) < 0.2 * finger_beam.fast_angle(np.array(10e3), SIZE)


def test_networks_add_and_stand_alone() -> None:
    both = finger().simulate(drive((30e3, 20e3)))
    slow = finger(fast_chambers=0).simulate(drive((30e3,)))
    fast = finger(slow_chambers=0).simulate(drive((20e3,)))
    assert both == pytest.approx(slow + fast)
    assert finger(fast_chambers=0).networks == ("slow",)


def test_stiffness_scales_the_pressure_and_offset_the_angle() -> None:
    """What diagnose and calibrate vary: a stiffness of 2 is the angle at half the pressure."""
    model = finger()
    plain = model.simulate(drive((20e3, 10e3)))
    assert model.with_values(stiffness=2.0).simulate(drive((40e3, 20e3))) == pytest.approx(plain)
    assert model.with_values(slow_stiffness=2.0).simulate(drive((40e3, 10e3))) == pytest.approx(plain)
    assert model.with_values(offset=0.1).simulate(drive((20e3, 10e3))) == pytest.approx(plain + 0.1)
    doubled = model.with_values(C10=0.22e6, C20=0.04e6).simulate(drive((40e3, 20e3)))
    assert doubled == pytest.approx(plain)
    assert {*BASE, *CALIBRATED, *SIZES} <= set(model.parameters)


@pytest.mark.parametrize("method", ["moments", "cantilever"])
def test_pressures_are_the_inverse(method: str) -> None:
    model = finger(method=method).with_values(slow_stiffness=1.3, fast_stiffness=0.8)
    P = np.array([[5e3, 3e3], [80e3, 40e3]])
    assert model.pressures(model.module_angles(P)) == pytest.approx(P, rel=1e-9)


def test_bending_besides_squeezing_is_linear_and_inverted() -> None:
    """It adds an angle a pressure, whatever the squeezing's stiffness, and goes on below zero."""
    bending = math.radians(3.0) / 1e3
    model = finger().with_values(fast_bending=bending, fast_stiffness=2.0, slow_stiffness=1.1)
    without = model.with_values(fast_bending=0.0)
    P = np.array([[10e3, 0.5e3], [20e3, 13.9e3], [20e3, 40e3]])
    extra = model.module_angles(P) - without.module_angles(P)
    assert extra == pytest.approx(np.column_stack([np.zeros(3), bending * P[:, 1]]))
    assert model.pressures(model.module_angles(P)) == pytest.approx(P, rel=1e-9)
    vacuum = np.array([[0.0, -5e3]])
    assert model.module_angles(vacuum)[0, 1] == pytest.approx(-5e3 * bending)
    assert model.pressures(model.module_angles(vacuum)) == pytest.approx(vacuum)
    stiff = model.with_values(stiffness=2.0).module_angles(2 * P)
    assert stiff == pytest.approx(model.module_angles(P))


def test_squeezing_starts_where_the_walls_meet() -> None:
    """Below it bending alone, no jump there, at high pressure the same slope times the factor; inverted."""
    bending = math.radians(3.0) / 1e3
    plain = finger(slow_chambers=0)
    model = plain.with_values(fast_bending=bending, fast_touch=2e3, fast_squeezing=0.5, fast_stiffness=1.5)
    P = np.array([[0.5e3], [1.999e3], [2.001e3], [13.9e3], [40e3]])
    got = model.module_angles(P)[:, 1]
    crowns = plain.with_values(fast_stiffness=1.5).module_angles(np.vstack([P, [[2e3]]]))[:, 1]
    assert got[:2] == pytest.approx(bending * P[:2, 0])
    assert got[2:] == pytest.approx(bending * P[2:, 0] + 0.5 * (crowns[2:-1] - crowns[-1]))
    assert got[2] - got[1] < math.radians(0.1)
    assert model.pressures(model.module_angles(P)) == pytest.approx(P, rel=1e-9)
    without = model.with_values(fast_bending=0.0)
    assert without.pressures(without.module_angles(P[2:])) == pytest.approx(P[2:], rel=1e-9)
    # stiffer rubber meets later
    assert model.with_values(stiffness=2.0).module_angles(2 * P)[:, 1] == pytest.approx(got)


def test_over_time_and_tip() -> None:
    """Rows are the drive's; a straight finger's tip is at the end of its links."""
    model = read_model({"kind": "pneunet", "outputs": ["angle", "x", "y", "z"]})
    got = model.simulate(drive((0.0, 0.0), (20e3, 13.9e3), (0.0, 0.0)))
    assert got.shape == (3, 4)
    assert got[0] == pytest.approx([0.0, 9 * 9e-3 + 40e-3, 0.0, 0.0])
    assert got[2] == pytest.approx(got[0])
    assert got[1, 2] > 0.0 and got[1, 3] == 0.0


def test_model_file_goes_round() -> None:
    model = read_model({"kind": "pneunet", "w1": "17 mm", "stress": "linear", "fast_chambers": 4})
    import tomllib

    again = read_model(tomllib.loads(model_text(model)))
    assert again.simulate(drive((20e3, 10e3))) == pytest.approx(model.simulate(drive((20e3, 10e3))))
    assert again.parameters["w1"].value == pytest.approx(17e-3)


@pytest.mark.parametrize(
    "table, words",
    [
        ({"w1": "25 mm"}, "inside w2"),
        ({"t4": "3 mm"}, "no air"),
        ({"slow_chambers": 0, "fast_chambers": 0}, "at least one chamber"),
        ({"slow_chambers": 2.5}, "whole number"),
        ({"stress": "hooke"}, "yeoh, linear"),
        ({"outputs": ["force"]}, "angle, x, y, z"),
        ({"w9": "1 mm"}, "no such key"),
        ({"C10": "0.11 mm"}, "MPa"),
    ],
)
def test_bad_tables_are_refused_in_one_line(table: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        read_model({"kind": "pneunet", **table})
    assert "\n" not in str(caught.value)


def test_wrong_number_of_pressures() -> None:
    with pytest.raises(InputError, match="2 pressures"):
        finger().simulate(drive((20e3,)))
    with pytest.raises(InputError, match="one pressure"):
        finger(fast_chambers=0).simulate(drive((20e3, 10e3)))
