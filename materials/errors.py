"""The exception of this room; the command line turns it into exit status 2."""


class MaterialError(ValueError):
    """A law, card or test that cannot be used: what was given, what is allowed, what to try, in one line."""
