"""The exception of this room; the command line turns it into exit status 2."""

from __future__ import annotations


class GeometryError(ValueError):
    """A shape or a mesh that cannot be used: what was given, what is allowed, what to try, in one line."""

    def __init__(self, message: str) -> None:
        super().__init__(" ".join(str(message).split()))


def refusal(given: str, allowed: str, cause: str = "", remedy: str = "") -> GeometryError:
    """The one-line error of this room.

    Parameters
    ----------
    given : what was given, with its unit
    allowed : what is allowed
    cause : likely cause, may be empty
    remedy : what to try, may be empty
    """
    parts = [given, f"allowed: {allowed}"]
    if cause:
        parts.append(f"likely cause: {cause}")
    if remedy:
        parts.append(f"try: {remedy}")
    return GeometryError("; ".join(parts))


def millimetres(value: float) -> str:
    """A length in m as text in mm, for messages."""
    return f"{value * 1e3:.6g} mm"
