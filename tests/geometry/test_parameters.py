"""Listing shapes and parameters, cheaply."""

import math
import subprocess
import sys

import numpy as np
import pytest

import geometry
from geometry.parameters import angle, check_ranges, parameters


def test_listing_loads_neither_gmsh_nor_numpy():
    code = (
        "import sys, geometry; [geometry.parameters(s) for s in geometry.SHAPES.values()];"
        "print([m for m in ('gmsh', 'meshio', 'numpy', 'skfem') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("name", sorted(geometry.SHAPES))
def test_every_parameter_is_documented_and_its_default_allowed(name):
    shape = geometry.SHAPES[name]
    assert shape.name == name and shape.title and shape.source
    listed = parameters(shape)
    assert listed
    for item in listed:
        assert item.doc and item.unit in ("m", "rad", "1") and item.default_text and item.range_text
    shape().validate()
    assert set(shape().volume_names())


def test_table_1_is_all_there_with_its_symbols():
    defaults = {p.symbol: p.default for p in parameters(geometry.SHAPES["pneunet"]) if p.symbol}
    table = {"w1": 18, "w2": 20, "w3": 16, "w4": 20, "r1": 9, "r2": 10, "r3": 8, "r4": 10, "h1": 10, "h2": 10}
    table |= {"l1": 9, "l2": 2, "l3": 5, "t1": 2, "t2": 2, "t3": 3, "t4": 1, "t5": 2, "t6": 2, "t7": 1}
    assert {k: round(v * 1e3, 9) for k, v in defaults.items() if k in table} == table


def test_text_of_values():
    by_name = {p.name: p for p in parameters(geometry.SHAPES["pneunet"])}
    assert by_name["slow_inner_width"].default_text == "18 mm"
    assert by_name["slow_chambers"].default_text == "9"
    assert by_name["half"].default_text == "true"
    assert by_name["gap"].range_text == "0.01 mm to 500 mm"


def test_angles_are_radians():
    from dataclasses import dataclass

    @dataclass
    class Folded:
        name = "folded"
        fold: float = angle(math.radians(45), "fold angle", math.radians(10), math.radians(80))

    (item,) = parameters(Folded)
    assert item.unit == "rad" and item.default_text == "45 deg"
    check_ranges(Folded(np.float64(0.5)))
    with pytest.raises(geometry.GeometryError, match=r"allowed: a number, 10 deg to 80 deg|10 deg to 80 deg"):
        check_ranges(Folded(45.0))
