"""The commands, one module each: `add_arguments(parser)` and `run(arguments) -> exit status`.

A module is imported only when its command is called. A new command is one file and one line here.
"""

SUMMARIES: dict[str, str] = {
    "solve": "solve a deck: curve, fields, pictures and a report",
    "mesh": "mesh a deck's geometry, and say what is in it (--help lists the built-in shapes)",
    "fit": "fit a rubber's tests, and write a material card",
    "calibrate": "fit numbers of a deck or a reduced model to records or FE curves",
    "diagnose": "compare a model with measured records, and name the effect that it lacks",
    "simulate": "run a model, with its effects, over the pressures of records",
    "sweep": "solve a deck for many values of its keys: a table, curves, maps and a page",
    "study": "run a study that comes with the program (--list says what each shows)",
}
