"""What bad_input.py tries: good inputs of every kind, changed by hypothesis."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from typing import Any

import hypothesis.strategies as st
from bad_input_files import CARD, DECK, LINE, MODEL, SHAPES, VISCOUS, block, record, test_file
from bad_input_words import ARGUMENTS, CELLS, HEADS, KEYS, NEAR, ODD, TABLES, WORDS


@dataclass(frozen=True)
class Draw:
    """A command line, and the files that are there."""

    kind: str
    words: tuple[str, ...]
    files: dict[str, bytes]


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
                    lines.insert(i, draw(st.sampled_from(KEYS)) + " = " + draw(st.sampled_from(ODD)))
                case 2:
                    lines.insert(i, f"[{draw(st.sampled_from(TABLES))}]")
                case 3 | 4 | 5 if key in NEAR:
                    lines[i] = f"{key} = {draw(st.sampled_from(NEAR[key]))}"
                case _:
                    lines[i] = f"{key} = {draw(st.sampled_from(ODD))}"
        return ("\n".join(lines) + "\n").encode()

    return st.one_of(changed(), changed(), changed(), bytes_of(text.encode()))


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
