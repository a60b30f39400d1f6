"""Blind records for `fem-spa diagnose`: a generator, a runner and a scorer.

It reads nothing of `fem_spa.loop`: the physics here has other functional forms than the library of effects,
so that what is scored is whether the program finds a cause, not whether it finds its own formula again. The
few forms that are alike all the same are in `classes.SAME_FORM` and are counted apart.

    python -m benchmarks.loop run --tier single --count 40 --seed 1000 --out DIR
    python -m benchmarks.loop page DIR --page docs/loop.md
"""
