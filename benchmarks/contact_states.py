"""Do walls pass through one another in any state that runs have left? Prints a row for each folder.

    python benchmarks/contact_states.py FOLDER ...

A folder is what `fem-spa solve` or `fem-spa study` wrote; every run with contact below it is looked at, every
converged state. The boundary is cut into straight triangles, 36 a face, and none may pierce another; in the
column `of chords` only 4 a face, on its nodes: the chords of curved walls may cross where walls do not. The
last two columns are of obstacles: states in which a point of the boundary is inside one, and how deep the
deepest is (negative: how near the nearest comes). The points are a lattice of 12 parts a face's edge, and so
finer than the points that contact itself watches.
"""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path

import numpy as np

from fem_spa.deck import read_deck
from fem_spa.mesh_store import read_kept
from fem_spa.output.toml import to_toml
from fem_spa.prepare import prepare
from fem_spa.run import MESH
from fem_spa.solid.obstacle_distance import distance
from fem_spa.solid.space import build_space
from fem_spa.solid.walls import Walls

FINE, NODES, LATTICE = 6, 2, 12


def states(folder: Path) -> tuple[list[int], float]:
    """Of one run: states, how many cross finely cut, on the nodes, an obstacle; and the depth in it, m."""
    import pyvista

    record = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    with tempfile.TemporaryDirectory() as place:
        deck = Path(place) / "deck.toml"
        deck.write_text(to_toml(record["deck"]), encoding="utf-8")
        problem = prepare(read_deck(deck)).problem
    kept = [read_kept(path) for path in sorted((folder / MESH).glob("*.npz"))]
    space = build_space(kept[0] if kept and kept[0] is not None else problem.mesh)
    walls = [Walls(space, problem.symmetry, parts) for parts in (FINE, NODES)]
    lattice = Walls(space, {}, LATTICE) if problem.obstacles else None
    files = sorted((folder / "fields").glob("step_*.vtu"))
    crossing, depth = [0, 0, 0], -np.inf
    for file in files:
        grid = pyvista.read(file)
        same = grid.points.shape == space.points.shape
        if not same or np.abs(grid.points - space.points).max() > 1e-6 * np.ptp(space.points):
            raise SystemExit(f"{file}: the mesh is not the one of {folder / 'result.json'}")
        position = space.points + np.asarray(grid.point_data["displacement"])
        for k, wall in enumerate(walls):
            crossing[k] += wall.cross(position) is not None
        if lattice is not None:
            points = lattice.points(position)
            gaps = [distance(obstacle, points)[0].min() for obstacle in problem.obstacles]
            crossing[2] += min(gaps) < 0
            depth = max(depth, -min(gaps))
    return [len(files), *crossing], depth


def main() -> None:
    """Print the table."""
    print("| folder | runs | states | with a crossing | of chords | inside an obstacle | deepest [mm] |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: |")
    for name in sys.argv[1:]:
        found = [
            states(path.parent)
            for path in sorted(Path(name).rglob("result.json"))
            if json.loads(path.read_text(encoding="utf-8")).get("contact")
        ]
        total = np.array([counts for counts, _ in found], dtype=int).reshape(-1, 4).sum(axis=0)
        depth = max((depth for _, depth in found), default=-np.inf)
        deepest = f"{1e3 * depth:.6f}" if np.isfinite(depth) else ""
        cells = [f"`{Path(name).name}`", len(found), *total, deepest]
        print("| " + " | ".join(map(str, cells)) + " |", flush=True)


if __name__ == "__main__":
    main()
