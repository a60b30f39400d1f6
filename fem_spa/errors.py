"""The one exception that the command line turns into exit status 2."""


class InputError(ValueError):
    """The input is wrong: the text says what was given, what is allowed and what to try, in one line."""
