"""Closing the loop: from measured records and a model to the effect that the model lacks.

`records` reads, `audit` looks at what was read, `split` holds out, `noise` says what is noise, `effects`
are the causal blocks, `search` finds which of them the data ask for, `gates` and `verdict` decide what may
be said.
"""
