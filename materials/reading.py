"""Test files: CSV with `stretch` or `strain` and a stress, or force and displacement, units named.

Read are the columns `stretch`, `strain`, `true strain`, `nominal stress [MPa]`, `true stress [MPa]`,
`force [N]`, `displacement [mm]`, `time [s]`, `specimen`; `engineering` is `nominal`, a unit may
stand in round brackets, and cells may be parted by comma, semicolon or tab. `# key: value` lines
before the header: `mode` (uniaxial, equibiaxial, planar), `test` (pull, cyclic, relaxation, creep),
`area`, `gauge length`, `preload` (a force that was on when force and displacement were set to zero).
Other lines before the header are passed over (machines write such).
"""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from materials.bounded import MOST_ROWS, read_bytes
from materials.checking import check, sort_out_kind
from materials.errors import MaterialError
from materials.laws import Array
from materials.names import allowed
from materials.response import MODES
from materials.specimen import KINDS, Specimen
from materials.units import UNITS, factor, quantity

FEWEST_ROWS = 5
LARGEST_NUMBER = 1e15
"""In whatever unit: no measurement is beyond it, and squares of it are numbers still."""
KEYS = (
    "mode",
    "test",
    "area",
    "gauge length",
    "preload",
    "specimen",
    "material",
    "source",
    "rate",
    "temperature",
    "note",
)
_COLUMNS = {
    "stretch": ("stretch", "stretch ratio", "lambda"),
    "strain": ("strain", "nominal strain", "engineering strain", "eng strain", "eng. strain"),
    "true strain": ("true strain", "logarithmic strain", "hencky strain"),
    "nominal stress": ("nominal stress", "engineering stress", "eng stress", "eng. stress"),
    "true stress": ("true stress", "cauchy stress"),
    "force": ("force", "load"),
    "displacement": ("displacement", "extension", "elongation"),
    "time": ("time",),
    "specimen": ("specimen",),
}
_ALIAS = {alias: name for name, aliases in _COLUMNS.items() for alias in aliases}
_KIND = {
    "stretch": "number",
    "strain": "number",
    "true strain": "number",
    "nominal stress": "pressure",
    "true stress": "pressure",
    "force": "force",
    "displacement": "length",
    "time": "time",
}
_MODE_ALIAS = {
    "biaxial": "equibiaxial",
    "equi-biaxial": "equibiaxial",
    "pure shear": "planar",
    "tension": "uniaxial",
    "compression": "uniaxial",
    "tensile": "uniaxial",
}


@dataclass(frozen=True)
class _Header:
    line: int
    delimiter: str
    cells: list[str]
    columns: dict[str, int]
    units: dict[str, str | None]


def read_test(path: str | Path, mode: str | None = None, ignore_time: bool = False) -> list[Specimen]:
    """The specimens of one test file, checked.

    Parameters
    ----------
    path : CSV as above
    mode : for files that do not state theirs; a stated one wins
    ignore_time : take the rows as they stand although their times are out of order

    Raises
    ------
    MaterialError : one line: the file, what is wrong, at which line, what is allowed
    """
    path = Path(path)
    where = path.name
    try:
        raw = read_bytes(path, MOST_ROWS)
    except OSError as error:
        raise MaterialError(f'test file "{path}" cannot be read: {error.strerror or error}') from None
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    lines = text.splitlines()
    if not any(line.strip() for line in lines):
        raise MaterialError(
            f"{where}: the file is empty; a header line and at least {FEWEST_ROWS} rows are needed"
        )
    meta = _metadata(lines, where)
    header = _find_header(lines, where)
    table, rows, names = _numbers(lines, header, where)
    stated = meta.get("mode", mode or "uniaxial").lower()
    stated = _MODE_ALIAS.get(stated, stated)
    if stated not in MODES:
        raise MaterialError(f'{where}: mode "{stated}" is not known; {allowed(stated, MODES)}')
    kind = meta.get("test", "").lower()
    if kind and kind not in KINDS:
        raise MaterialError(f'{where}: test "{kind}" is not known; {allowed(kind, KINDS)}')
    stretch, from_displacement = _stretch(table, header, meta, where)
    stress, from_force = _stress(table, header, meta, stretch, where)
    digest = hashlib.sha256(raw).hexdigest()
    found = []
    for specimen in dict.fromkeys(names):
        index = np.array([i for i, n in enumerate(names) if n == specimen])
        label = where if len(set(names)) == 1 else f"{where} specimen {specimen}"
        if index.size < FEWEST_ROWS:
            raise MaterialError(
                f"{label}: {index.size} rows; at least {FEWEST_ROWS} are needed to fit anything"
            )
        s = Specimen(
            name=label,
            mode=stated,
            kind=kind or "pull",
            stretch=stretch[index],
            stress=stress[index],
            time=table["time"][index] if "time" in table else None,
            rows=rows[index],
            file=where,
            sha256=digest,
            from_force=from_force or from_displacement,
        )
        s = sort_out_kind(s, stated_kind=bool(kind), ignore_time=ignore_time)
        found.append(check(s, said_stretch="stretch" in table, bare_strain=_bare_strain(header)))
    return found


def _metadata(lines: list[str], where: str) -> dict[str, str]:
    meta = {}
    for line in lines:
        if line.lstrip().startswith("#"):
            key, colon, value = line.lstrip("# \t").partition(":")
            if colon:
                meta[key.strip().lower()] = value.strip()
    for key in meta:
        close = allowed(key, KEYS)
        if key not in KEYS and close.startswith("did you mean") and len(key) < 16:
            raise MaterialError(f'{where}: line "# {key}: ..." is not known; {close}')
    return meta


def _split(cell: str) -> tuple[str, str | None]:
    """Column name (normalized) and unit of a header cell."""
    match = re.match(r"^\s*(.*?)\s*(?:[\[(]([^\])]*)[\])])?\s*$", cell.strip().strip('"'))
    assert match is not None
    name = re.sub(r"\s+", " ", match.group(1).replace("_", " ")).lower()
    unit = match.group(2)
    if unit is None and " " in name:  # nominal_stress_kPa
        last = re.split(r"[ _]", cell.strip())[-1]
        if last in UNITS and last != "1" and name.rsplit(" ", 1)[0] in _ALIAS:
            name, unit = name.rsplit(" ", 1)[0], last
    return _ALIAS.get(name, name), (None if unit is None else unit.strip())


def _find_header(lines: list[str], where: str) -> _Header:
    for i, line in enumerate(lines[:60]):
        if line.lstrip().startswith("#") or not line.strip():
            continue
        delimiter = max(";,\t", key=line.count)
        cells = line.split(delimiter)
        split = [_split(cell) for cell in cells]
        known = [name for name, _ in split if name in _COLUMNS]
        if len(known) >= 2 or (len(known) == 1 and len(cells) > 1 and _wordy(cells)):
            columns: dict[str, int] = {}
            units: dict[str, str | None] = {}
            for k, (name, unit) in enumerate(split):
                if name in columns:
                    raise MaterialError(
                        f"{where}, line {i + 1}: column `{name}` stands there twice; keep one"
                    )
                if name:
                    columns[name], units[name] = k, unit
            return _complete(_Header(i, delimiter, cells, columns, units), where)
    raise MaterialError(
        f"{where}: no header line found; write for example `stretch,nominal stress [MPa]` above the numbers"
    )


def _wordy(cells: list[str]) -> bool:
    """Whether at least two cells are words, not numbers: a header and not a row or `Load Cell;1 kN`."""
    return sum(bool(re.match(r"^[A-Za-z]", c.strip())) for c in cells) >= 2 and not any(
        re.match(r"^\s*[-+]?\d", c) for c in cells
    )


def _complete(header: _Header, where: str) -> _Header:
    have = header.columns
    line = f"{where}, line {header.line + 1}"
    if "stress" in have:
        raise MaterialError(
            f"{line}: `stress` may be nominal or true; write `nominal stress [MPa]` or `true stress [MPa]`"
        )
    if not {"stretch", "strain", "true strain", "displacement"} & set(have):
        raise MaterialError(
            f"{line}: no column of stretch found among {_cells(header)}; {_near(have, 'stretch')}"
        )
    if not {"nominal stress", "true stress", "force"} & set(have):
        raise MaterialError(
            f"{line}: no column of stress found among {_cells(header)}; {_near(have, 'stress')}"
        )
    for name in ("nominal stress", "true stress", "force", "displacement", "time"):
        if name in have and header.units[name] is None:
            example = {"pressure": "MPa", "force": "N", "length": "mm", "time": "s"}[_KIND[name]]
            raise MaterialError(
                f"{line}: column `{name}` has no unit; write for example `{name} [{example}]`"
            )
    for name, unit in header.units.items():
        if name in _KIND and unit not in (None, "", "-", "mm/mm"):
            try:
                factor(str(unit), _KIND[name])
            except MaterialError as error:
                raise MaterialError(f"{line}, column `{name}`: {error}") from None
    return header


def _cells(header: _Header) -> str:
    return ", ".join(f"`{cell.strip()}`" for cell in header.cells)


def _near(have: dict[str, int], what: str) -> str:
    wanted = {
        "stretch": ("stretch", "strain [1]", "strain [%]", "displacement [mm]"),
        "stress": ("nominal stress [MPa]", "true stress [MPa]", "force [N]"),
    }[what]
    return f"allowed: {', '.join(wanted)}"


def _bare_strain(header: _Header) -> bool:
    """Whether the stretch comes from a `strain` column that does not say % or 1."""
    return (
        "stretch" not in header.columns and header.units.get("strain") is None and "strain" in header.columns
    )


def _numbers(lines: list[str], header: _Header, where: str) -> tuple[dict[str, Array], Array, list[str]]:
    wanted = {name: k for name, k in header.columns.items() if name in _KIND}
    values: dict[str, list[float]] = {name: [] for name in wanted}
    rows: list[int] = []
    names: list[str] = []
    for i in range(header.line + 1, len(lines)):
        line = lines[i]
        if not line.strip(" ;,\t") or line.lstrip().startswith("#"):
            continue
        cells = line.split(header.delimiter)
        for name, k in wanted.items():
            text = cells[k].strip().strip('"') if k < len(cells) else ""
            if header.delimiter != "," and "," in text and "." not in text:
                text = text.replace(",", ".")
            try:
                value = float(text)
            except ValueError:
                raise MaterialError(
                    f'{where}, line {i + 1}, column `{name}`: "{text}" is not a number'
                ) from None
            if not abs(value) <= LARGEST_NUMBER:
                raise MaterialError(
                    f"{where}, line {i + 1}, column `{name}`: {text} is no measurement; take the row out"
                )
            values[name].append(value)
        rows.append(i + 1)
        names.append(cells[header.columns["specimen"]].strip() if "specimen" in header.columns else "")
    if len(rows) < FEWEST_ROWS:
        raise MaterialError(
            f"{where}: {len(rows)} rows of numbers; at least {FEWEST_ROWS} are needed to fit anything"
        )
    out = {}
    for name, column in values.items():
        unit = header.units[name]
        scale = 1.0 if unit in (None, "", "-", "mm/mm") else factor(str(unit), _KIND[name])
        out[name] = np.array(column) * scale
    return out, np.array(rows), names


def _stretch(
    table: dict[str, Array], header: _Header, meta: dict[str, str], where: str
) -> tuple[Array, bool]:
    if "stretch" in table:
        return table["stretch"], False
    if "strain" in table:
        return 1.0 + table["strain"], False
    if "true strain" in table:
        return np.exp(table["true strain"]), False
    if "gauge length" not in meta:
        raise MaterialError(
            f"{where}: displacement needs the gauge length; add a line `# gauge length: 25 mm` on top"
        )
    length = quantity(meta["gauge length"], "length", f"{where}, gauge length")
    if not 1e-4 <= length <= 2.0:
        raise MaterialError(
            f"{where}: a gauge length of {length:g} m is not that of a specimen; 0.1 mm to 2 m is allowed"
        )
    return 1.0 + table["displacement"] / length, True


def _stress(
    table: dict[str, Array], header: _Header, meta: dict[str, str], stretch: Array, where: str
) -> tuple[Array, bool]:
    """Nominal stress; where the file has it twice, the two must agree."""
    safe = np.where(stretch > 0, stretch, 1.0)
    if "nominal stress" in table:
        nominal = table["nominal stress"]
        if "true stress" in table and np.all(stretch > 0):
            off = np.abs(table["true stress"] - nominal * stretch)
            scale = float(np.max(np.abs(table["true stress"]))) or 1.0
            if float(np.quantile(off, 0.9)) > 0.05 * scale:
                raise MaterialError(
                    f"{where}: true stress is not nominal stress times stretch (off by up to "
                    f"{100 * float(off.max()) / scale:.0f} % of the largest): is a column in the wrong place?"
                )
        return nominal, False
    if "true stress" in table:
        return table["true stress"] / safe, False
    if "area" not in meta:
        raise MaterialError(f"{where}: force needs the rest area; add a line `# area: 24 mm^2` on top")
    area = quantity(meta["area"], "area", f"{where}, area")
    if not 1e-9 <= area <= 1.0:
        raise MaterialError(
            f"{where}: an area of {area:g} m^2 is not that of a specimen; 0.001 mm^2 to 1 m^2 is allowed"
        )
    before = quantity(meta["preload"], "force", f"{where}, preload") if "preload" in meta else 0.0
    return (table["force"] + before) / area, True
