"""What the command line turns into one line: exit status 2 for wrong input, 1 for a job cut short."""


class InputError(ValueError):
    """The input is wrong: the text says what was given, what is allowed and what to try, in one line."""


class Unfinished(Exception):
    """The job ran and could not reach its end (a full disk, ...): one line, exit status 1.

    The text says why, what there is, and how to go on.
    """
