"""The nearest right name for a misspelt one."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches


def allowed(given: str, names: Iterable[str]) -> str:
    """'did you mean "x"? allowed: a, b, x' for an error message; `given` is what was typed."""
    known = list(names)
    lower = {name.lower().replace("_", "-"): name for name in known}
    near = get_close_matches(str(given).lower().replace("_", "-"), lower, n=1, cutoff=0.5)
    hint = f'did you mean "{lower[near[0]]}"? ' if near else ""
    return f"{hint}allowed: {', '.join(known)}"
