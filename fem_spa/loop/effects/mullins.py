"""Mullins: rubber that has been further is softer below the largest load it has seen (Ogden and Roxburgh
1999)."""

import numpy as np

from fem_spa.loop.effects.effect import Context, Effect, Param
from fem_spa.loop.operators import running_max
from fem_spa.loop.signatures.history import BELOW


def apply(ctx: Context, response: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """s -> s (1 + a (|s| / M)^b tanh((M^2 - s^2) / (w + m M^2))) + set M^2, M the largest s so far.

    `seen before` is the part of the range that was loaded before the first record, where that is not known.
    `late` is how much of the softening waits for loads near the largest one: laws differ in it.
    """
    a, rest, w, m, before, late = theta
    if a == 0.0 and rest == 0.0:
        return response
    s = ctx.share(response)
    size = np.sqrt(np.mean(s**2, axis=1)) if s.shape[1] > 1 else np.abs(s[:, 0])
    seen = {1.0: 0.0, 0.0: 1.0}.get(-1.0 if ctx.data.fresh is None else ctx.data.fresh, before)
    most = running_max(ctx.data, size, seen)
    soft = np.tanh((most**2 - size**2) / (w + m * most**2 + 1e-9))
    if late != 0.0:
        soft *= np.clip(size / np.maximum(most, 1e-9), 1e-3, 1.0) ** late
    return np.asarray(
        ctx.rest + ctx.scale * (s * (1.0 + a * soft[:, None]) + (rest * (most**2 - seen**2))[:, None])
    )


def starts(ctx: Context) -> list[list[np.ndarray]]:
    """Softening and set, over widths and growths."""
    groups = []
    for before in [0.0] if ctx.data.fresh == 1.0 else [0.0, 0.4]:
        for w, m in ((0.05, 0.1), (0.3, 0.1), (1.5, 0.1), (0.05, 1.0)):
            groups.append(
                [np.array([0.05, 0.0, w, m, before, 0.0]), np.array([0.0, 0.02, w, m, before, 0.0])]
            )
    return groups


def untestable(ctx: Context) -> str | None:
    """A record that was softened before shows none."""
    return "the first record is said to be softened before" if ctx.data.fresh == 0.0 else None


EFFECT = Effect(
    name="mullins",
    family="history",
    slot="stiffness",
    order=32,
    memory="max-history",
    parameters=(
        Param("softening", 0.0, 4.0, 0.05, "", True),
        Param("set", 0.0, 1.0, 0.02, "of span", True),
        Param("width", 0.01, 3.0, 0.3, ""),
        Param("growth", 0.0, 3.0, 0.3, ""),
        Param("seen before", 0.0, 0.9, 0.0, "of span"),
        Param("late", -0.5, 2.0, 0.0),
    ),
    apply=apply,
    starts=starts,
    untestable=untestable,
    experiment="amplitude ladder",
    words="softer below the largest pressure seen so far, whenever that was",
    signature=BELOW,
)
