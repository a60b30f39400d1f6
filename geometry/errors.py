"""The exception of this room; the command line turns it into exit status 2."""


class GeometryError(ValueError):
    """A shape or a mesh that cannot be used: what was given, what is allowed, what to try, in one line."""
