"""Many independent tasks at once: on this machine's cores, or on the workers of a Dask scheduler.

`open_engine` gives one of the two; what they have in common, all that callers know, is in `interface.py`.
"""

from fem_spa.engine.interface import Ended, Engine, EngineGone, WorkerLost, open_engine

__all__ = ["Ended", "Engine", "EngineGone", "WorkerLost", "open_engine"]
