"""Where the next state will be, from the converged ones: polynomials of the path's length."""

from __future__ import annotations

import numpy as np

from fem_spa.solid.system import norm

_HIGHEST = 4


class Predictor:
    """Extrapolates x and the cavity pressures along a smooth part of the path.

    The order is the one that would have predicted the last converged state best.
    """

    def __init__(self) -> None:
        self.known: list[tuple[float, np.ndarray, np.ndarray]] = []
        self.order = 1

    def add(self, length: float, x: np.ndarray, pressure: np.ndarray) -> None:
        """A converged state at `length` (dimensionless) along the path."""
        if len(self.known) >= 2:
            errors = []
            for order in range(min(_HIGHEST, len(self.known) - 1) + 1):
                weights, states = self._weights(length, order)
                guess = sum(w * s[1] for w, s in zip(weights, states, strict=True))
                errors.append(norm(guess - x))
            self.order = int(np.argmin(errors)) + (int(np.argmin(errors)) == len(errors) - 1)
        self.known.append((length, x.copy(), pressure.copy()))
        del self.known[: -(_HIGHEST + 1)]

    def predict(self, length: float) -> tuple[np.ndarray, np.ndarray]:
        """New arrays (x, cavity pressures) at `length`."""
        weights, states = self._weights(length, min(self.order, len(self.known) - 1, _HIGHEST))
        x = sum(w * s[1] for w, s in zip(weights, states, strict=True))
        pressure = sum(w * s[2] for w, s in zip(weights, states, strict=True))
        return np.asarray(x), np.asarray(pressure)

    def corner(self) -> None:
        """The path turns: only the last state says something about what comes."""
        del self.known[:-1]
        self.order = 1

    def lower(self) -> None:
        """A prediction failed: trust the polynomial less."""
        self.order = max(0, self.order - 1)

    def _weights(self, length: float, order: int):
        states = self.known[-(order + 1) :]
        t = [s[0] for s in states]
        weights = []
        for i, ti in enumerate(t):
            w = 1.0
            for j, tj in enumerate(t):
                if j != i:
                    w *= (length - tj) / (ti - tj)
            weights.append(w)
        return weights, states
