"""VTK files of the fields: .vtu with ten-node tetrahedra, binary, and the .pvd that lists the steps.

Written directly: nothing is imported for it, and a step of 8 000 nodes takes some milliseconds.
"""

from __future__ import annotations

import base64
import sys
from collections.abc import Mapping, Sequence
from xml.sax.saxutils import quoteattr

import numpy as np

QUADRATIC_TETRAHEDRON = 24
TENSOR_COMPONENTS = ("XX", "YY", "ZZ", "XY", "YZ", "XZ")
_TYPES = {"f8": "Float64", "f4": "Float32", "i8": "Int64", "i4": "Int32", "u1": "UInt8"}


def vtu(
    points: np.ndarray,
    tets: np.ndarray,
    point_fields: Mapping[str, np.ndarray],
    cell_fields: Mapping[str, np.ndarray],
    numbers: Mapping[str, float] | None = None,
    note: str = "",
) -> bytes:
    """An unstructured grid of ten-node tets.

    Parameters
    ----------
    points : (n, 3) m
    tets : (m, 10) node numbers, VTK order
    point_fields : name -> (n,), (n, 3) or (n, 6) in the order xx, yy, zz, xy, yz, xz
    cell_fields : name -> (m,)
    numbers : name -> one number of the whole step (pressures, angle), kept as field data
    note : put in the file as a comment (the units)
    """
    count = len(tets)
    order = "LittleEndian" if sys.byteorder == "little" else "BigEndian"
    parts = [
        '<?xml version="1.0"?>\n',
        f"<!-- {note.replace('--', '- -')} -->\n" if note else "",
        f'<VTKFile type="UnstructuredGrid" version="1.0" byte_order="{order}" header_type="UInt64">\n',
        "<UnstructuredGrid>\n<FieldData>\n",
        *(_array(name, np.array([value]), ' NumberOfTuples="1"') for name, value in (numbers or {}).items()),
        f'</FieldData>\n<Piece NumberOfPoints="{len(points)}" NumberOfCells="{count}">\n',
        "<PointData>\n",
        *(_array(name, values) for name, values in point_fields.items()),
        "</PointData>\n<CellData>\n",
        *(_array(name, values) for name, values in cell_fields.items()),
        "</CellData>\n<Points>\n",
        _array("Points", np.asarray(points, dtype=np.float64)),
        "</Points>\n<Cells>\n",
        _array("connectivity", np.asarray(tets, dtype=np.int64).ravel()),
        _array("offsets", np.arange(10, 10 * count + 1, 10, dtype=np.int64)),
        _array("types", np.full(count, QUADRATIC_TETRAHEDRON, dtype=np.uint8)),
        "</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n",
    ]
    return "".join(parts).encode("utf-8")


def _array(name: str, values: np.ndarray, extra: str = "") -> str:
    """One DataArray: base64 of its length in bytes (64 bit) and its bytes."""
    values = np.ascontiguousarray(values)
    kind = _TYPES[values.dtype.str[1:]]
    components = values.shape[1] if values.ndim > 1 else 1
    shape = f' NumberOfComponents="{components}"' if components > 1 else ""
    if components == 6:
        shape += "".join(f' ComponentName{i}="{word}"' for i, word in enumerate(TENSOR_COMPONENTS))
    data = base64.b64encode(np.uint64(values.nbytes).tobytes() + values.tobytes()).decode("ascii")
    return (
        f'<DataArray type="{kind}" Name={quoteattr(name)}{shape}{extra} format="binary">{data}</DataArray>\n'
    )


def pvd(steps: Sequence[tuple[float, str]]) -> str:
    """The collection file: (time, file name relative to it) a step; the time is the number of the step."""
    lines = [f'<DataSet timestep="{time:.10g}" part="0" file={quoteattr(file)}/>\n' for time, file in steps]
    return (
        '<?xml version="1.0"?>\n'
        '<VTKFile type="Collection" version="1.0" byte_order="LittleEndian">\n<Collection>\n'
        + "".join(lines)
        + "</Collection>\n</VTKFile>\n"
    )
