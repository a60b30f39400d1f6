"""Whether the words that `diagnose` writes of an unexplained remainder fit the effect behind it, by rules.

The rules are of physics: rate-independent loops turn with the direction; creep goes on while the command is
held, by what was done seconds ago; a lag is gone once the command is held; softening and wear go with cycle
or time; structure is bound to the pressure, the same up and down.
"""

from __future__ import annotations

import re

LOOP = r"direction of motion|where it last turned|state that turns|changing with [^,]*its direction"
HELD = (
    r"largest while the command is held|from [^;]*(the last (2\.5|10|40) s|time within a record)"
    r"|(a state|a lag of the pressure) of about (2|10) s"
)
FAST = (
    r"small while the command is held|from [^;]*(\brate\b|the last 0\.(15|6) s)"
    r"|(a state|a lag of the pressure) of about 0\.(15|5) s"
)
RINGS = r"oscillates with a period"
AGE = (
    r"the cycle or the time that has passed"
    r"|best from [^;]*(\bcycles\b|\btime\b(?! within)|largest pressure so far|temperature)"
    r"|changing with [^,]*(the time|number of cycles|largest pressure so far|the temperature)"
)
CURVE = r"bound to the pressure itself|grows with the motion|changing with [^,]*the pressure\b"
THRESHOLD = r"the pressure from which it moves"
WEIGHT = r"a weight|inclination|best from [^;]*(orientation|payload)"
SENSOR = r"the zero of \w+ within a record"

WORDS: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(["hysteresis", "friction"], (LOOP,)),
    "creep": (HELD,),
    "viscous-lag": (FAST,),
    "inertia": (FAST, RINGS),
    **dict.fromkeys(["pressure-lag", "delay"], (FAST,)),
    "dead-band": (CURVE, THRESHOLD, LOOP),
    "leak": (HELD,),
    "saturation": (CURVE,),
    "sensor-lag": (FAST,),
    "sensor-drift": (AGE,),
    "sensor-nonlinearity": (CURVE,),
    "quantisation": (SENSOR,),
    **dict.fromkeys(["mullins", "fatigue", "temperature", "delamination"], (AGE,)),
    **dict.fromkeys(["gravity", "payload"], (WEIGHT,)),
    **dict.fromkeys(["contact", "stiffening", "wall-thickness", "base-compliance"], (CURVE,)),
    "snap-through": (CURVE, LOOP),
}
"""Effect -> expressions, one of which must be found."""


def clauses(signature: str) -> list[str]:
    """What a signature says, in its order, without the size of the remainder."""
    return re.sub(r"^the remainder \([^)]*\) ", "", signature.strip()).split("; ")


def fits(name: str, signature: str) -> bool:
    """Whether any clause has words of the effect."""
    return bool(signature) and any(_says(name, clause) for clause in clauses(signature))


def leads(name: str, signature: str) -> bool:
    """Whether the first clause, which a person reads first, has words of the effect."""
    return bool(signature) and _says(name, clauses(signature)[0])


def _says(name: str, clause: str) -> bool:
    return any(re.search(words, clause) for words in WORDS[name])
