"""What bad_input.py tries: good inputs of every kind, changed by hypothesis."""

from __future__ import annotations

import contextlib
import tempfile
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import hypothesis.strategies as st
import numpy as np

DECK = """[geometry]
file = "block.msh"
unit = "mm"
[materials.body]
law = "neo-hooke"
C10 = "0.1 MPa"
density = "1080 kg/m^3"
[supports]
fixed = ["base"]
[loads]
pressure = "2 kPa"
path = ["1 kPa"]
gravity = [0, 0, -9.81]
contact = true
obstacles = [ { plane = { point = [0, 0, "-9 mm"], normal = [0, 0, 1] } } ]
[observe]
angle = "tip-face"
blocked = false
[solver]
tolerance = 1e-8
max_iterations = 15
imposed_steps = 2
"""
SHAPES = {
    name: f'[geometry]\nshape = "{name}"\nsize = "{size}"\n{more}'
    for name, size, more in (
        ("tube", "6 mm", "share = 4\n"),
        ("ball", "6 mm", ""),
        ("pneunet", "9 mm", 'slow_chambers = 1\nfast_chambers = 0\nslow_pitch = "18 mm"\n'),
        ("bellow", "8 mm", ""),
    )
}
CARD = """name = "mine"
law = "neo-hooke"
density = "1080 kg/m^3"
bulk = "inf"
source = "a test"
[parameters]
C10 = { value = 0.1, unit = "MPa", low = 0.09, high = 0.11 }
"""
MODEL = '[model]\nkind = "curve"\nfile = "line.csv"\n'
VISCOUS = """[model]
kind = "kelvin-voigt"
k1 = "82.85 kPa/mm"
k2 = "31.5 kPa/mm"
eta1 = "600 kPa*s/mm"
eta2 = "20 kPa*s/mm"
"""
LINE = "pressure [kPa],angle [deg]\n0,0\n20,15\n50,40\n"


def record() -> str:
    """A record of 20 s."""
    t = 0.1 * np.arange(200)
    p = 25.0 * (1.0 - np.cos(2.0 * np.pi * t / 5.0))
    y = 0.8 * p + 0.05 * np.sin(37.0 * t)
    rows = [f"{a:.1f},{b:.5g},{c:.5g}" for a, b, c in zip(t, p, y, strict=True)]
    return "\n".join(["# orientation: 0 deg", "time [s],pressure [kPa],angle [deg]", *rows]) + "\n"


def test_file() -> str:
    """A uniaxial test of a neo-Hookean rubber."""
    stretch = np.linspace(1.0, 2.5, 25)
    stress = 0.2 * (stretch - stretch**-2)
    rows = [f"{a:.4f},{b:.5f}" for a, b in zip(stretch, stress, strict=True)]
    return "\n".join(["# mode: uniaxial", "stretch,nominal stress [MPa]", *rows]) + "\n"


def block() -> bytes:
    """A hollow block of 162 tets as a .msh file, as the tests have it."""
    from geometry.files import write_mesh
    from geometry.tagged import TaggedMesh

    n = 4
    grid = np.stack(np.meshgrid(*[np.linspace(0.0, 0.01, n)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    corner = np.array(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1], [1, 0, 1], [0, 0, 1], [0, 1, 1], [0, 1, 0]]
    )
    loop = (1, 2, 7, 6, 5, 4, 1)  # around the diagonal 0-3
    tets = []
    for i in range(27):
        at = np.array([i // 9, i // 3 % 3, i % 3])
        if tuple(at) == (1, 1, 1):
            continue
        number = [(int(a) * n + int(b)) * n + int(c) for a, b, c in at + corner]
        for a, b in pairwise(loop):
            tet = [number[0], number[3], number[a], number[b]]
            x = grid[tet]
            if np.linalg.det(x[1:] - x[0]) < 0:
                tet[2:] = tet[:1:-1]
            tets.append(tet)
    array = np.array(tets)
    faces = array[:, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]].reshape(-1, 3)
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    shell = faces[first[count == 1]]
    x = grid[shell]
    inside = np.all((x > 1e-9) & (x < 0.01 - 1e-9), axis=(1, 2))
    base, tip = np.all(x[:, :, 0] < 1e-9, axis=1), np.all(x[:, :, 0] > 0.01 - 1e-9, axis=1)
    groups = {"cavity main": inside, "base": base, "tip": tip, "outer": ~inside & ~base & ~tip}
    mesh = TaggedMesh(
        grid, array, {"body": np.arange(len(array))}, {k: shell[v] for k, v in groups.items()}, "block"
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "block.msh"
        write_mesh(mesh, path, "mm")
        return path.read_bytes()


# -- changed ---------------------------------------------------------------------------------------------

ODD = [
    *(
        "0",
        "-1",
        "1",
        "2.5",
        "1e9",
        "1e308",
        "1e400",
        "-1e308",
        "5e-324",
        "nan",
        "inf",
        "-inf",
        "9" * 30,
        "1_000",
    ),
    *("true", "false", '""', '"nan"', '"inf"', '"0 mm"', '"-3 mm"', '"1e9 m"', '"1e-9 m"', '"nan kPa"'),
    *('"20 kPa"', '"1e12 kPa"', '"-2 bar"', '"0.1 MPa"', '"inf MPa"', '"1 mm/mm"', '"5 degF"', '"3 furlong"'),
    *(
        "1e12",
        "1000000000",
        '"1000000000"',
        '"x"',
        '"base"',
        '"outer"',
        '"y"',
        '"volume"',
        '"gas-mass"',
        '"tangent"',
    ),
    *(
        '"gent"',
        '"ogden"',
        '"linear"',
        '"dragon-skin-30"',
        '"../../../etc/passwd"',
        '"/etc/passwd"',
        '"/dev/zero"',
    ),
    *(
        '"."',
        '"harm.py"',
        '"card.toml"',
        '"block.msh"',
        '"line.csv"',
        "\"__import__('os').getcwd()\"",
        '"\\u0000"',
    ),
    *('"\\u202e\\U0001F4A5"', "[]", "[1]", "[[1, 2, 3]]", "{}", '{ main = "1 kPa" }', '{ other = "1 kPa" }'),
    *(
        "1979-05-27T07:32:00Z",
        "07:32:00",
        "[" * 200 + "]" * 200,
        '"' + "a" * 5000 + '"',
        "[" + "1, " * 3000 + "1]",
    ),
    *('["1 kPa", "2 mm"]', "[0, 0, 0]", '[0, 0, "1e9 N"]', '["", ""]', "{ x = { y = { z = 1 } } }"),
]
CELLS = [
    "",
    "nan",
    "inf",
    "-inf",
    "1e308",
    "-1e308",
    "1e-320",
    "0",
    "-5",
    "1e12",
    "x",
    '"1',
    "1,2",
    "1;2",
    "٣",
    "\x00",
]
WORDS = ["time [s]", "pressure [kPa]", "pressure [furlong]", "angle [deg]", "x [mm]", "stretch", "strain"]
WORDS += ["force [N]", "temperature [degC]", "pressure 2 [kPa]", "true stress [MPa]", "", "é", "time [kPa]"]
HEADS = [
    "# start: 2026-01-01T10:00:00",
    "# start: yesterday",
    "# mode: sideways",
    "# mode: planar",
    "# area: 0 mm^2",
]
HEADS += [
    "# orientation: inf deg",
    "# payload: -20 kg",
    "# history: virgin",
    "# session: 1",
    "#",
    "# a: b: c",
]


def toml(text: str) -> st.SearchStrategy[bytes]:
    """A TOML text with up to three of its lines changed."""

    @st.composite
    def changed(draw: Any) -> bytes:
        lines = text.splitlines()
        for _ in range(draw(st.integers(1, 3))):
            keys = [i for i, line in enumerate(lines) if " = " in line]
            i = draw(st.sampled_from(keys or [0]))
            key = lines[i].partition(" = ")[0]
            match draw(st.integers(0, 7)):
                case 0:
                    del lines[i]
                case 1:
                    lines.insert(
                        i, draw(st.sampled_from(WORDS_OF_DECKS)) + " = " + draw(st.sampled_from(ODD))
                    )
                case 2:
                    lines.insert(i, f"[{draw(st.sampled_from(TABLES))}]")
                case 3 | 4 | 5 if key in NEAR:
                    lines[i] = f"{key} = {draw(st.sampled_from(NEAR[key]))}"
                case _:
                    lines[i] = f"{key} = {draw(st.sampled_from(ODD))}"
        return ("\n".join(lines) + "\n").encode()

    return st.one_of(changed(), changed(), changed(), bytes_of(text.encode()))


NEAR = {
    "pressure": [
        '"0.01 kPa"',
        '"-30 kPa"',
        '"60 kPa"',
        '"300 kPa"',
        '"1e-9 Pa"',
        '{ main = "3 kPa" }',
        '"0 Pa"',
    ],
    "C10": ['"0.5 kPa"', '"0.2 MPa"', '"60 Pa"', '"20 GPa"', "{ value = 0.4, unit = 'MPa' }", '"1e-3 MPa"'],
    "path": [
        '["2 kPa"]',
        '["-1 kPa", "1 kPa"]',
        '["1 kPa", "1 kPa"]',
        '["1e-12 kPa"]',
        '["30 kPa", "0 kPa"]',
        "[]",
    ],
    "gravity": ["[0, 0, 0]", "[9.81, 0, 0]", "[0, 900, 0]", "[1e-9, 0, 0]", "[0.0, -9.81, 1]"],
    "density": ['"1 kg/m^3"', '"20 g/cm^3"', '"1080 kg/m^3"'],
    "fixed": ['["base", "tip"]', '["tip"]', '["outer"]', '["base", "base"]', '["cavity main"]'],
    "contact": ["false", "true"],
    "obstacles": [
        "[]",
        '[ { sphere = { centre = [0, 0, "60 mm"], radius = "45 mm" } } ]',
        '[ { cylinder = { point = [0, 0, "-30 mm"], axis = [0, 1, 0], radius = "20 mm" } } ]',
        '[ { plane = { point = [0, 0, "-0.1 mm"], normal = [0, 0, 1e-9] } } ]',
    ],
    "angle": ['"chord"', '"tangent"'],
    "blocked": ["true"],
    "tolerance": ["1e-12", "1e-3", "1e-5"],
    "max_iterations": ["3", "200"],
    "imposed_steps": ["1", "40"],
    "unit": ['"cm"', '"m"', '"um"', '"in"'],
    "law": ['"mooney-rivlin"', '"yeoh"', '"gent"', '"linear"'],
    "bulk": ['"2 GPa"', '"1 MPa"', '"10 kPa"', '"inf"'],
    "size": ['"4 mm"', '"20 mm"', '"0.05 mm"', '"1 um"'],
    "share": ["1", "2", "8"],
    "slow_chambers": ["0", "2", "60", "61"],
    "slow_pitch": ['"6 mm"', '"30 mm"', '"400 mm"'],
    "k1": ['"1e-9 kPa/mm"', '"1e12 kPa/mm"'],
    "eta1": ['"0 kPa*s/mm"', '"1e-9 kPa*s/mm"', '"1e15 kPa*s/mm"'],
}
WORDS_OF_DECKS = [
    "points",
    "volume_ratio",
    "control",
    "tip_force",
    "tip_displacement",
    "card",
    "law",
    "bulk",
    "size",
]
WORDS_OF_DECKS += [
    "shape",
    "imposed_steps",
    "stop_at_touch",
    "symmetry",
    "blocked",
    "nonsense",
    "C20",
    "a.b.c",
    "é",
]
WORDS_OF_DECKS += [
    "kind",
    "file",
    "rows",
    "preset",
    "gain",
    "unit",
    "gas_mass_ratio",
    "path",
    "factors",
    "share",
]
TABLES = [
    "geometry",
    "loads",
    "layers.paper",
    "materials.body",
    "materials.other",
    "solver",
    "x",
    "effects.creep",
    "model",
]


def bytes_of(content: bytes) -> st.SearchStrategy[bytes]:
    """A file that is cut, mixed up, or in another coding."""

    @st.composite
    def changed(draw: Any) -> bytes:
        data = bytearray(content)
        match draw(st.integers(0, 4)):
            case 0:
                return bytes(data[: draw(st.integers(0, len(data)))])
            case 1:
                for _ in range(draw(st.integers(1, 8))):
                    data[draw(st.integers(0, len(data) - 1))] = draw(st.integers(0, 255))
            case 2:
                i = draw(st.integers(0, len(data)))
                data[i:i] = draw(
                    st.sampled_from([b"\x00" * 40, b"\xff\xfe", b"\xef\xbb\xbf", b"\r\n\r", b"[[[", b"\t"])
                )
            case 3:
                code = draw(st.sampled_from(["utf-16", "utf-8-sig", "latin-1", "utf-32"]))
                return content.decode("utf-8").encode(code)
            case _:
                a, b = sorted(draw(st.tuples(*[st.integers(0, len(data))] * 2)))
                del data[a:b]
        return bytes(data)

    return changed()


def rows(text: str) -> st.SearchStrategy[bytes]:
    """A table with cells, rows, columns or its head changed."""

    @st.composite
    def changed(draw: Any) -> bytes:
        lines = [line.split(",") for line in text.splitlines()]
        for _ in range(draw(st.integers(1, 4))):
            head = next((i for i, line in enumerate(lines) if not line[0].startswith("#")), 0)
            i = draw(st.integers(0, len(lines) - 1)) if lines else 0
            if not lines:
                break
            j = draw(st.integers(0, len(lines[i]) - 1))
            match draw(st.integers(0, 8)):
                case 0:
                    lines[i][j] = draw(st.sampled_from(CELLS))
                case 1:
                    lines[head][min(j, len(lines[head]) - 1)] = draw(st.sampled_from(WORDS))
                case 2:
                    lines.insert(0, [draw(st.sampled_from(HEADS))])
                case 3:
                    column, value = j, draw(st.sampled_from(CELLS))
                    for line in lines[head + 1 :]:
                        line[min(column, len(line) - 1)] = value
                case 4:
                    del lines[draw(st.integers(0, i)) : i]
                case 5:
                    lines[i:i] = [list(lines[i])] * draw(st.integers(1, 50))
                case 6:
                    lines[i] = lines[i][:j]
                    if not lines[i]:
                        lines[i] = [""]
                case 7:
                    lines[head + 1 :] = lines[:head:-1]
                case _:
                    scale = draw(st.sampled_from([0.0, -1.0, 1e-12, 1e12, 1e300]))
                    for line in lines[head + 1 :]:
                        with contextlib.suppress(ValueError, IndexError):
                            line[j] = f"{scale * float(line[j]):.6g}"
        return ("\n".join(",".join(line) for line in lines) + "\n").encode()

    return st.one_of(changed(), changed(), changed(), bytes_of(text.encode()))


def mesh(content: bytes) -> st.SearchStrategy[bytes]:
    """A .msh file with lines dropped, doubled, or a number in them changed."""

    @st.composite
    def changed(draw: Any) -> bytes:
        lines = content.decode().splitlines()
        for _ in range(draw(st.integers(1, 4))):
            i = draw(st.integers(0, len(lines) - 1))
            words = lines[i].split()
            match draw(st.integers(0, 5)):
                case 0:
                    del lines[i]
                case 1:
                    lines.insert(i, lines[i])
                case 2 if '"' in lines[i] or draw(st.booleans()):
                    k = next((k for k, line in enumerate(lines) if '"' in line), i)
                    name = draw(
                        st.sampled_from(
                            ["base", "", "cavity main", "layer x", "é\u202e", "tip\\n", "a" * 3000]
                        )
                    )
                    lines[k] = f'{" ".join(lines[k].split()[:2])} "{name}"'
                case _ if words:
                    number = draw(
                        st.sampled_from(["-1", "0", "1", "7", "1e9", "1000000000000", "nan", "x", "99999999"])
                    )
                    words[draw(st.integers(0, len(words) - 1))] = number
                    lines[i] = " ".join(words)
        return ("\n".join(lines) + "\n").encode()

    return st.one_of(changed(), changed(), bytes_of(content))


# -- draws -----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Draw:
    """A command line, and the files that are there."""

    kind: str
    words: tuple[str, ...]
    files: dict[str, bytes]


ARGUMENTS = [
    "--set",
    "--out",
    "--resume",
    "--law",
    "--seed",
    "--vary",
    "--holdout",
    "",
    "-",
    "--",
    "x" * 300,
    "\x00",
]
ARGUMENTS += [
    "loads.pressure=1e9",
    "geometry.size=1e-9 m",
    "loads.points=1000000000000",
    "solver.imposed_steps=1e12",
]
ARGUMENTS += [
    "a..b=1",
    "loads={}",
    "-1",
    "nan",
    "deck.toml",
    "run.csv",
    "test.csv",
    "solve",
    "/dev/zero",
    ".",
    "é",
]
ARGUMENTS += [
    "geometry.x=[" + "[" * 500,
    "loads.pressure=1kPa:2kPa:1000000000",
    "--sample",
    "sobol:1000000000",
]


def draws() -> dict[str, st.SearchStrategy[Draw]]:
    """Kind -> its draws."""
    whole = {
        "deck.toml": DECK.encode(),
        "block.msh": block(),
        "card.toml": CARD.encode(),
        "run.csv": record().encode(),
        "model.toml": MODEL.encode(),
        "line.csv": LINE.encode(),
        "test.csv": test_file().encode(),
        "harm.py": b'open("harmed", "w").close()\n',
    }

    def one(kind: str, words: tuple[str, ...], name: str, content: st.SearchStrategy[bytes]) -> Any:
        return content.map(lambda data: Draw(kind, words, {**whole, name: data}))

    carded = DECK.replace('law = "neo-hooke"\nC10 = "0.1 MPa"', 'card = "card.toml"').encode()
    with_card = toml(CARD).map(
        lambda data: Draw("card", ("solve", "deck.toml"), {**whole, "deck.toml": carded, "card.toml": data})
    )
    diagnose = ("diagnose", "model.toml", "run.csv", "--no-page")
    line = st.tuples(
        st.sampled_from(["solve", "mesh", "fit", "diagnose", "simulate", "calibrate", "sweep", "study"]),
        st.lists(st.sampled_from(ARGUMENTS), min_size=0, max_size=4),
    )
    every: dict[str, st.SearchStrategy[Draw]] = {
        "deck": one("deck", ("solve", "deck.toml"), "deck.toml", toml(DECK)),
        "shape": st.sampled_from(sorted(SHAPES)).flatmap(
            lambda name: one(
                "shape", ("mesh", "deck.toml", "--out", "out/deck.msh"), "deck.toml", toml(SHAPES[name])
            )
        ),
        "card": with_card,
        "mesh": one("mesh", ("solve", "deck.toml"), "block.msh", mesh(whole["block.msh"])),
        "test file": one(
            "test file",
            ("fit", "test.csv", "--law", "neo-hooke", "--out", "out/fitted.toml"),
            "test.csv",
            rows(test_file()),
        ),
        "record": one("record", diagnose, "run.csv", rows(record())),
        "model": st.sampled_from([MODEL, VISCOUS]).flatmap(
            lambda text: one("model", ("simulate", "model.toml", "run.csv"), "model.toml", toml(text))
        ),
        "curve": one("curve", ("simulate", "model.toml", "run.csv"), "line.csv", rows(LINE)),
        "command line": line.map(lambda w: Draw("command line", (w[0], *w[1]), whole)),
    }
    return every
