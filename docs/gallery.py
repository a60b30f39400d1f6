"""Write docs/gallery.md and its pictures: `python docs/gallery.py [RESULTS]`.

Solves a deck of every built-in shape (some ten minutes), or takes what RESULTS/NAME holds of it already.
"""

from __future__ import annotations

import csv
import json
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path

from pictures import HERE, keep

from fem_spa.deck import read_deck
from fem_spa.output.compare import draw
from fem_spa.output.shape_picture import ShapePicture
from fem_spa.prepare import prepare
from fem_spa.solid.space import build_space
from geometry.registry import SHAPES

PAGE = HERE / "gallery.md"
SIZE, COLOURS = 560, 128

HEAD = """# Gallery

Every built-in shape at rest and under pressure, its curve and its deck. This page and its pictures are
written by `docs/gallery.py`; sizes of the shapes: `fem-spa mesh --help`. A deck of a study is run by
`fem-spa study NAME`, which also prints the paper's figures beside ours; the others by `fem-spa solve DECK`.
"""


@dataclass(frozen=True)
class Entry:
    """A deck to show; `study` is the study that runs it, `words` what is to be seen.

    `column` : of curve.csv, drawn over the pressure instead of curve.png
    """

    name: str
    deck: Path
    words: str
    study: str = ""
    column: str = ""


STUDIES = HERE.parent / "studies"
ENTRIES = (
    Entry(
        "pneunet",
        HERE / "finger.toml",
        "A slow PneuNet finger: chambers in one block, paper between its bottom layers, which it bends to.",
    ),
    Entry(
        "grasp",
        STUDIES / "grasp_sphere.toml",
        "The composite finger, slow and fast network, on a sphere of 100 mm: contact with an obstacle and "
        "of the fast chambers with one another.",
        "grasp_sphere",
    ),
    Entry(
        "plate",
        STUDIES / "finger_on_plate.toml",
        "The slow module above a plate, which it presses on without friction.",
        "finger_on_plate",
    ),
    Entry(
        "zigzag-linear",
        STUDIES / "zigzag_linear.toml",
        "The zig-zag actuator without a limiting layer: it grows longer.",
        "zigzag_linear",
        "extension [mm]",
    ),
    Entry(
        "zigzag-bending",
        STUDIES / "zigzag_bending.toml",
        "The same with a limiting layer of 1 mm on one side: it bends to it.",
        "zigzag_bending",
    ),
    Entry(
        "bellow",
        STUDIES / "bellow.toml",
        "The bellow and the soft layer on its top, a quarter solved and mirrored.",
        "bellow",
    ),
    Entry(
        "tripod",
        STUDIES / "tripod.toml",
        "Three PneuNet channels round a support, one inflated, hanging under gravity.",
        "tripod",
    ),
    Entry(
        "arm-segment",
        STUDIES / "arm_segment.toml",
        "Three tubes held by rings, one inflated.",
        "arm_segment",
    ),
    Entry("tube", HERE / "tube.toml", "A closed tube, for first steps and tests."),
    Entry(
        "ball",
        STUDIES / "limit_point.toml",
        "A thick ball blown up by volume through its limit point.",
        "limit_point",
    ),
)


def section(entry: Entry, results: Path) -> str:
    """The page's part on one deck; its pictures go to docs/pictures."""
    folder = results / entry.name
    if not (folder / "report.html").is_file():
        # a process each: the memory of one is not that of those before it
        command = [sys.executable, "-m", "fem_spa.cli", "solve", str(entry.deck), "--out", str(folder)]
        if subprocess.run(command, check=False).returncode:
            raise SystemExit(f"{entry.deck} did not reach its end: see {folder}")
    problem = prepare(read_deck(entry.deck)).problem
    ShapePicture(problem, build_space(problem.mesh), None, None).write(folder / "rest.png", "at rest")
    curve = "curve.png"
    if entry.column:
        curve = "column.png"
        with open(folder / "curve.csv", newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        across = "pressure [kPa]"
        found = [[float(row[name]) for row in rows] for name in (across, entry.column)]
        draw(folder / curve, entry.column, (across, entry.column), {"FE": (found[0], found[1])})
    for word, file in (("rest", "rest.png"), ("pressure", "shape.png"), ("curve", curve)):
        keep(folder / file, f"gallery-{entry.name}-{word}.png", SIZE, COLOURS)
    record = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    place = entry.deck.relative_to(HERE.parent).as_posix()
    run = f"study `{entry.study}`" if entry.study else f"deck `{place}`"
    pictures = " | ".join(
        f"![{entry.name}, {word}](pictures/gallery-{entry.name}-{word}.png)"
        for word in ("rest", "pressure", "curve")
    )
    steps, elements = record["steps"], record["elements"]
    return (
        f"\n## {entry.name}\n\n{entry.words} {run[0].upper()}{run[1:]}; {elements} elements, {steps} steps, "
        f"{record['newton_iterations']} Newton iterations, at most {record['peak_rss_mb']:.0f} MB.\n\n"
        f"| at rest | at the end of the path | curve |\n|---|---|---|\n| {pictures} |\n\n"
        f"```toml\n{entry.deck.read_text(encoding='utf-8').strip()}\n```\n"
    )


def main() -> None:
    """Every entry, in order; every shape is among them."""
    shown = {tomllib.loads(entry.deck.read_text(encoding="utf-8"))["geometry"]["shape"] for entry in ENTRIES}
    assert shown == set(SHAPES), set(SHAPES) - shown
    results = Path(sys.argv[1] if len(sys.argv) > 1 else "out/gallery")
    PAGE.write_text(HEAD + "".join(section(entry, results) for entry in ENTRIES), encoding="utf-8")


if __name__ == "__main__":
    main()
