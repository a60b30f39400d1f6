"""What bad_input.py puts into good inputs: values, cells, heads, keys, tables and arguments."""

from __future__ import annotations

ODD = (
    *("0", "-1", "1", "2.5", "1e9", "1e308", "1e400", "-1e308", "5e-324", "nan", "inf", "-inf", "9" * 30),
    *("1_000", "true", "false", '""', '"nan"', '"inf"', '"0 mm"', '"-3 mm"', '"1e9 m"', '"1e-9 m"'),
    *('"nan kPa"', '"20 kPa"', '"1e12 kPa"', '"-2 bar"', '"0.1 MPa"', '"inf MPa"', '"1 mm/mm"', '"5 degF"'),
    *('"3 furlong"', "1e12", "1000000000", '"1000000000"', '"x"', '"base"', '"outer"', '"y"', '"volume"'),
    *('"gas-mass"', '"tangent"', '"gent"', '"ogden"', '"linear"', '"dragon-skin-30"'),
    *('"../../../etc/passwd"', '"/etc/passwd"', '"/dev/zero"', '"."', '"harm.py"', '"card.toml"'),
    *('"block.msh"', '"line.csv"', "\"__import__('os').getcwd()\"", '"\\u0000"', '"\\u202e\\U0001F4A5"'),
    *("[]", "[1]", "[[1, 2, 3]]", "{}", '{ main = "1 kPa" }', '{ other = "1 kPa" }'),
    *("1979-05-27T07:32:00Z", "07:32:00", "[" * 200 + "]" * 200, '"' + "a" * 5000 + '"'),
    *("[" + "1, " * 3000 + "1]", '["1 kPa", "2 mm"]', "[0, 0, 0]", '[0, 0, "1e9 N"]', '["", ""]'),
    "{ x = { y = { z = 1 } } }",
)
"""Values of TOML, as they stand in a file."""
CELLS = (
    *("", "nan", "inf", "-inf", "1e308", "-1e308", "1e-320", "0", "-5", "1e12", "x", '"1', "1,2", "1;2"),
    *("٣", "\x00"),
)
WORDS = (
    *("time [s]", "pressure [kPa]", "pressure [furlong]", "angle [deg]", "x [mm]", "stretch", "strain"),
    *("force [N]", "temperature [degC]", "pressure 2 [kPa]", "true stress [MPa]", "", "é", "time [kPa]"),
)
"""Heads of columns."""
HEADS = (
    *("# start: 2026-01-01T10:00:00", "# start: yesterday", "# mode: sideways", "# mode: planar"),
    *("# area: 0 mm^2", "# orientation: inf deg", "# payload: -20 kg", "# history: virgin", "# session: 1"),
    *("#", "# a: b: c"),
)
"""Lines above a table."""
KEYS = (
    *("points", "volume_ratio", "control", "tip_force", "tip_displacement", "card", "law", "bulk", "size"),
    *("shape", "imposed_steps", "stop_at_touch", "symmetry", "blocked", "nonsense", "C20", "a.b.c", "é"),
    *("kind", "file", "rows", "preset", "gain", "unit", "gas_mass_ratio", "path", "factors", "share"),
)
TABLES = (
    *("geometry", "loads", "layers.paper", "materials.body", "materials.other", "solver", "x"),
    *("effects.creep", "model"),
)
ARGUMENTS = (
    *("--set", "--out", "--resume", "--law", "--seed", "--vary", "--holdout", "", "-", "--", "x" * 300),
    *("\x00", "loads.pressure=1e9", "geometry.size=1e-9 m", "loads.points=1000000000000"),
    *("solver.imposed_steps=1e12", "a..b=1", "loads={}", "-1", "nan", "deck.toml", "run.csv", "test.csv"),
    *("solve", "/dev/zero", ".", "é", "geometry.x=[" + "[" * 500, "loads.pressure=1kPa:2kPa:1000000000"),
    *("--sample", "sobol:1000000000"),
)
NEAR = {
    "pressure": (
        *('"0.01 kPa"', '"-30 kPa"', '"60 kPa"', '"300 kPa"', '"1e-9 Pa"', '{ main = "3 kPa" }'),
        '"0 Pa"',
    ),
    "C10": ('"0.5 kPa"', '"0.2 MPa"', '"60 Pa"', '"20 GPa"', "{ value = 0.4, unit = 'MPa' }", '"1e-3 MPa"'),
    "path": (
        *('["2 kPa"]', '["-1 kPa", "1 kPa"]', '["1 kPa", "1 kPa"]', '["1e-12 kPa"]', '["30 kPa", "0 kPa"]'),
        "[]",
    ),
    "gravity": ("[0, 0, 0]", "[9.81, 0, 0]", "[0, 900, 0]", "[1e-9, 0, 0]", "[0.0, -9.81, 1]"),
    "density": ('"1 kg/m^3"', '"20 g/cm^3"', '"1080 kg/m^3"'),
    "fixed": ('["base", "tip"]', '["tip"]', '["outer"]', '["base", "base"]', '["cavity main"]'),
    "contact": ("false", "true"),
    "obstacles": (
        "[]",
        '[ { sphere = { centre = [0, 0, "60 mm"], radius = "45 mm" } } ]',
        '[ { cylinder = { point = [0, 0, "-30 mm"], axis = [0, 1, 0], radius = "20 mm" } } ]',
        '[ { plane = { point = [0, 0, "-0.1 mm"], normal = [0, 0, 1e-9] } } ]',
    ),
    "angle": ('"chord"', '"tangent"'),
    "blocked": ("true",),
    "tolerance": ("1e-12", "1e-3", "1e-5"),
    "max_iterations": ("3", "200"),
    "imposed_steps": ("1", "40"),
    "unit": ('"cm"', '"m"', '"um"', '"in"'),
    "law": ('"mooney-rivlin"', '"yeoh"', '"gent"', '"linear"'),
    "bulk": ('"2 GPa"', '"1 MPa"', '"10 kPa"', '"inf"'),
    "size": ('"4 mm"', '"20 mm"', '"0.05 mm"', '"1 um"'),
    "share": ("1", "2", "8"),
    "slow_chambers": ("0", "2", "60", "61"),
    "slow_pitch": ('"6 mm"', '"30 mm"', '"400 mm"'),
    "k1": ('"1e-9 kPa/mm"', '"1e12 kPa/mm"'),
    "eta1": ('"0 kPa*s/mm"', '"1e-9 kPa*s/mm"', '"1e15 kPa*s/mm"'),
}
"""Key -> values that may well be meant."""
