"""Where to start an Ogden fit: with the exponents given, the moduli are a linear problem.

Every set of exponents from a coarse list is tried with its best non-negative mu_p alpha_p (NNLS on
the small normal equations); the best sets begin the search.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from scipy.optimize import nnls

from materials.laws import Array

EXPONENTS = (-12.0, -8.0, -5.0, -3.0, -2.0, -1.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 7.0, 9.0, 12.0)


def ogden_starts(
    count: int, stretches: Array, stress: Array, weight: Array, thorough: bool = True
) -> list[Array]:
    """Free parameters (mu1, alpha1, ...) of the best sets of `count` exponents.

    Parameters
    ----------
    count : number of terms, 1 to 3
    stretches : (3, n); stress, Pa, (n,); weight, 1/Pa, (n,)
    thorough : six starts instead of three
    """
    log = np.log(stretches)
    columns = []
    for a in EXPONENTS:
        column = weight * (2.0 / a) * (np.exp(a * log[0]) - np.exp(a * log[2])) / stretches[0]
        columns.append(column)
    A = np.stack(columns, axis=1)
    b = weight * stress
    size = np.linalg.norm(A, axis=0)
    A = A / size
    R = np.asarray(np.linalg.qr(np.column_stack([A, b]), mode="r"))
    R_A, R_b = R[:, :-1], R[:, -1]
    ranked = []
    for chosen in combinations(range(len(EXPONENTS)), count):
        index = list(chosen)
        m, left = nnls(R_A[:, index], R_b)
        ranked.append((left, index, m / size[index]))
    ranked.sort(key=lambda row: row[0])
    starts: list[Array] = []
    taken: list[set[int]] = []
    for _, index, m in ranked:
        if any(len(set(index) & other) >= count and count > 1 for other in taken):
            continue
        taken.append(set(index))
        floor = 1e-6 * max(float(m.max()), 1e-12)
        pairs = [(2.0 * max(v, floor) / EXPONENTS[k], EXPONENTS[k]) for v, k in zip(m, index, strict=True)]
        starts.append(np.array(pairs).ravel())
        if len(starts) >= (6 if thorough else 3):
            break
    return starts
