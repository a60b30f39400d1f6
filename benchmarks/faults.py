"""What is left when runs break: killed at random moments, a full disk, a closed folder, two runs in one.

    python benchmarks/faults.py kills [--kills 50] [--only NAME] [--seed 0] [--folder DIR] [--write]
    python benchmarks/faults.py places [--folder DIR] [--write]

`kills`: jobs are killed (SIGKILL, every other time with all their processes) at moments drawn evenly over the
processor time that they take, then the same command is given again (`solve` with `--resume`). After every
kill each file in the folder is read; in the end the result is compared with that of a run that nobody
disturbed. Needs Linux (it reads /proc).
"""

from __future__ import annotations

import argparse
import contextlib
import json
import math
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

DECK = """
[geometry]
{geometry}
[materials.body]
card = "dragon-skin-30"
[loads]
{loads}
"""
DECKS = {
    "contact": DECK.format(
        geometry='shape = "pneunet"\nslow_chambers = 0\nfast_chambers = 2\nsize = "9 mm"',
        loads='pressure = "2.4 kPa"\npath = ["1 kPa"]',
    )
    + '[layers.paper]\nmodulus = "2 GPa"\nthickness = "0.1 mm"\n',
    "volume": DECK.format(
        geometry='shape = "tube"\nsize = "8 mm"\nshare = 4',
        loads='control = "volume"\nvolume_ratio = 1.6\npoints = 6',
    ),
}
Tell = Callable[[str], None]
SHARES = {"solve, contact": 0.36, "solve, volume": 0.32, "diagnose": 0.16, "sweep": 0.16}


@dataclass
class Job:
    """A command, how it is given again after a kill, and what must then be the same.

    same : content of the folder -> what is compared
    """

    name: str
    words: list[str]
    again: list[str]
    same: Callable[[Path], object]
    seconds: float = 0.0
    reference: object = None
    kills: int = 0
    equal: int = 0
    torn: list[str] = field(default_factory=list)
    wrong: list[str] = field(default_factory=list)
    steps: list[int] = field(default_factory=list)  # after which a run went on
    ended: int = 0  # killed when nothing was left to do


def command(*words: str) -> list[str]:
    """The program as its users start it."""
    return [sys.executable, "-m", "fem_spa.cli", *words]


def curve(folder: Path) -> object:
    """curve.csv to the last digit, the counts of iterations and factors that led to it, the list of files.

    The reference is meshed anew, and two meshes of a drawing differ in their last bits, so that zeros in
    centre_line.csv do: tests/cli/test_resume.py compares all files, on one mesh.
    """
    record = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    fields = sorted(path.name for path in (folder / "fields").iterdir())
    return (
        (folder / "curve.csv").read_bytes(),
        (record["status"], record["newton_iterations"], record["factorizations"]),
        fields,
        sorted(path.name for path in folder.iterdir()),
    )


def report(folder: Path) -> object:
    """report.json and the predictions to the last digit."""
    files = [folder / "report.json", folder / "model_next.toml", *sorted((folder / "predictions").iterdir())]
    return [path.read_bytes() for path in files]


def table(folder: Path) -> object:
    """The cases' curves to the last digit, and their rows without what they cost."""
    curves = {path.parent.name: path.read_bytes() for path in sorted(folder.glob("cases/*/curve.csv"))}
    lines = [line.split(",") for line in (folder / "sweep.csv").read_text(encoding="utf-8").splitlines()]
    keep = [i for i, name in enumerate(lines[0]) if not name.startswith(("seconds", "memory"))]
    return curves, [[line[i] for i in keep] for line in lines]


def jobs(folder: Path) -> list[Job]:
    """The jobs that can be run with what is installed."""
    for name, text in DECKS.items():
        (folder / f"{name}.toml").write_text(text, encoding="utf-8")
    found = [
        Job(f"solve, {name}", ["solve", f"{name}.toml"], ["solve", f"{name}.toml", "--resume"], curve)
        for name in DECKS
    ]
    records = [write_record(folder / f"record{k}.csv", k) for k in range(3)]
    words = ["diagnose", "model.toml", *records]
    found.append(Job("diagnose", words, words, report))
    done = subprocess.run(command("--help"), capture_output=True, text=True, check=False)
    if "sweep" in done.stdout:
        words = ["sweep", "volume.toml", "--vary", "loads.volume_ratio=1.1,1.2", "--workers", "2"]
        found.append(Job("sweep", words, words, table))
    return found


def write_record(path: Path, number: int) -> str:
    """A record with a lag of a second behind a straight line, and its model beside it."""
    (path.parent / "line.csv").write_text("pressure [kPa],angle [deg]\n0,0\n50,40\n", encoding="utf-8")
    (path.parent / "model.toml").write_text('[model]\nkind = "curve"\nfile = "line.csv"\n', encoding="utf-8")
    rng = random.Random(number)
    angle, rows = 0.0, []
    for k in range(300):
        t = 0.1 * k
        pressure = 25.0 * (1.0 - math.cos(2.0 * math.pi * t / (6.0 + 3.0 * number)))
        angle += 0.1 * (0.8 * pressure - angle)
        rows.append(f"{t:.1f},{pressure:.6g},{angle + 0.05 * rng.gauss(0.0, 1.0):.6g}")
    text = "\n".join(["time [s],pressure [kPa],angle [deg]", *rows])
    path.write_text(text + "\n", encoding="utf-8")
    return path.name


def torn(folder: Path) -> list[str]:
    """Files that are not whole; what is hidden (a writer's own part, a lock) is not a result."""
    return [
        str(path.relative_to(folder))
        for path in sorted(folder.rglob("*"))
        if path.is_file() and not path.name.startswith(".") and not _whole(path)
    ]


def _whole(path: Path) -> bool:
    data = path.read_bytes()
    try:
        match path.suffix:
            case ".csv":
                lines = data.decode().splitlines()
                return data.endswith(b"\n") and len({line.count(",") for line in lines}) == 1
            case ".json":
                return json.loads(data) is not None
            case ".toml":
                return bool(tomllib.loads(data.decode()))
            case ".vtu" | ".pvd" | ".vtp":
                return data.rstrip().endswith(b"</VTKFile>")
            case ".png":
                return data.startswith(b"\x89PNG") and data.endswith(b"IEND\xaeB`\x82")
            case ".html":
                return data.rstrip().endswith(b"</html>")
            case ".npy" | ".npz":
                import numpy as np

                np.load(path, allow_pickle=False)
        return bool(data)
    except (ValueError, OSError, EOFError):
        return False


def kill_once(job: Job, folder: Path, out: Path, rng: random.Random, with_children: bool) -> None:
    """Start, kill, look, start again, compare."""
    process = subprocess.Popen(
        command(*job.words, "--out", str(out)),
        cwd=folder,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    moment = rng.uniform(0.0, job.seconds)
    while process.poll() is None and processor_time(process.pid) < moment:
        time.sleep(0.03)
    if with_children:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    else:
        process.kill()
    process.wait()
    job.kills += 1
    job.torn += [f"{moment:.2f} s: {name}" for name in torn(out)] if out.is_dir() else []
    done = subprocess.run(
        command(*job.again, "--out", str(out)), cwd=folder, capture_output=True, text=True, check=False
    )
    if "--resume" in job.again:
        words = [line for line in done.stderr.splitlines() if "going on after step" in line]
        job.steps += [int(line.split()[-1]) for line in words]
        job.ended += "has ended before" in done.stdout
    if done.returncode == 0 and job.same(out) == job.reference and not torn(out):
        job.equal += 1
    else:
        job.wrong.append(f"{moment:.2f} s, {out.name}: status {done.returncode}, {done.stderr[-300:]!r}")


def processor_time(session: int) -> float:
    """s that the processes of a session have computed so far, with those of theirs that have ended."""
    total = 0
    for path in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            fields = path.read_text(encoding="utf-8").rpartition(")")[2].split()
            if int(fields[3]) == session:
                total += sum(map(int, fields[11:15]))
    return total / os.sysconf("SC_CLK_TCK")


def kills(folder: Path, count: int, seed: int, only: str, tell: Tell) -> int:
    """The table of all jobs; 1 where something was lost."""
    rng = random.Random(seed)
    every = [job for job in jobs(folder) if only in job.name]
    total = sum(SHARES[job.name] for job in every)
    print("| job | takes | killed | went on after step | anew | had ended | half-written files | same |")
    tell("|---|---|---|---|---|---|---|---|")
    for job in every:
        out = folder / f"{job.name.replace(', ', '_')}_reference"
        for place in (out.with_name(f"{out.name}_first"), out):  # the first one may compile
            before = os.times()
            subprocess.run(
                command(*job.words, "--out", str(place)),
                cwd=folder,
                check=True,
                capture_output=True,
                text=True,
            )
            after = os.times()
            job.seconds = sum(after[2:4]) - sum(before[2:4])
        job.reference = job.same(out)
        for k in range(round(count * SHARES[job.name] / total)):
            kill_once(job, folder, folder / f"{job.name.replace(', ', '_')}_{k}", rng, k % 2 == 0)
        went = sorted(job.steps)
        on = f"{went[0]} to {went[-1]}" if went else "-"
        anew = job.kills - len(went) - job.ended if job.steps else "-"
        tell(
            f"| {job.name} | {job.seconds:.1f} s | {job.kills} | {on} | {anew} | {job.ended} "
            f"| {len(job.torn)} | {job.equal} of {job.kills} |",
        )
    for job in every:
        for line in [*job.torn, *job.wrong]:
            tell(f"{job.name}: {line}")
    return int(any(job.torn or job.wrong for job in every))


def places(folder: Path, tell: Tell) -> int:
    """Folders that cannot take the results, each with the line that says so."""
    (folder / "volume.toml").write_text(DECKS["volume"], encoding="utf-8")

    def solve(out: Path, *more: str) -> str:
        done = subprocess.run(
            command("solve", "volume.toml", "--out", str(out), *more),
            cwd=folder,
            capture_output=True,
            text=True,
            check=False,
        )
        lines = [line for line in done.stderr.splitlines() if line.startswith(("fem-spa", "interrupted"))]
        return f"{done.returncode} | {' / '.join(lines).replace(str(folder), '...') or 'done'}"

    tell("| DIR | status | the line |\n|---|---|---|")
    (folder / "file").write_text("a file\n")
    tell(f"| is a file | {solve(folder / 'file')} |")
    tell(f"| is below a file | {solve(folder / 'file' / 'below')} |")
    whole = folder / "whole"
    solve(whole)
    kept = (whole / "curve.csv").read_bytes()
    small = folder / "small"
    small.mkdir()
    for size in ("60k", "500k", "1200k"):
        done = subprocess.run(
            ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(small)], check=False
        )
        if done.returncode:
            tell(f"| a disk of {size} | not tried: mounting is not allowed here | |")
            continue
        try:
            tell(f"| a disk of {size} | {solve(small)} |")
            rows = (small / "curve.csv").read_bytes().count(b"\n") - 1
            tell(f"| - rows of curve.csv that stay, files torn | {rows}, {len(torn(small))} | |")
            subprocess.run(["mount", "-o", "remount,size=20m", str(small)], check=True)
            tell(f"| - with room made, `--resume` | {solve(small, '--resume')} |")
            tell(f"| - the curve is the same | {(small / 'curve.csv').read_bytes() == kept} | |")
            subprocess.run(["mount", "-o", "remount,ro", str(small)], check=True)
            tell(f"| - made read-only | {solve(small)} |")
        finally:
            subprocess.run(["umount", str(small)], check=True)
    first = subprocess.Popen(
        command("solve", "volume.toml", "--out", str(folder / "two")),
        cwd=folder,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    while not (folder / "two" / ".lock").is_file():
        time.sleep(0.01)
    tell(f"| another run is there | {solve(folder / 'two')} |")
    first.wait()
    tell(f"| - the other run's curve | {(folder / 'two' / 'curve.csv').read_bytes() == kept} | |")
    return 0


def put(name: str, lines: list[str]) -> None:
    """Replace what stands between the marks of `name` in docs/reliability.md."""
    page = Path(__file__).parents[1] / "docs" / "reliability.md"
    text = page.read_text(encoding="utf-8")
    before, mark, rest = text.partition(f"<!-- {name} -->\n")
    _, end, after = rest.partition(f"<!-- end of {name} -->")
    if mark and end:
        page.write_text(before + mark + "\n".join(lines) + "\n" + end + after, encoding="utf-8")


def main() -> int:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=("kills", "places"))
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--only", default="", help="part of the name of the jobs that are killed")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--write", action="store_true", help="put the table into docs/reliability.md")
    parser.add_argument("--folder", type=Path, help="scratch folder, empty (default: a temporary one)")
    arguments = parser.parse_args()
    lines: list[str] = []

    def tell(text: str) -> None:
        print(text, flush=True)
        lines.append(text)

    with tempfile.TemporaryDirectory() as temporary:
        folder = (arguments.folder or Path(temporary)).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        if arguments.what == "places":
            status = places(folder, tell)
        else:
            status = kills(folder, arguments.kills, arguments.seed, arguments.only, tell)
    if arguments.write:
        put(f"faults.py {arguments.what}", lines)
    return status


if __name__ == "__main__":
    raise SystemExit(main())
