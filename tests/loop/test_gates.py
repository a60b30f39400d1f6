"""What a set must pass: gain carried over to records left out, told by folds made for the purpose."""

from __future__ import annotations

import numpy as np
import pytest

from fem_spa.loop.gates import _carried_over
from fem_spa.loop.search import FoldErrors


def errors(fitted: list[float], left_out: list[float], leverage: list[float]) -> FoldErrors:
    return FoldErrors(np.array(fitted), np.array(left_out), 3, np.array(leverage), np.zeros(0))


BASE = errors([1000.0, 900.0, 30000.0], [1000.0, 900.0, 30000.0], [0.0, 0.0, 0.0])


@pytest.mark.parametrize(
    ("fitted", "left_out", "leverage", "passes"),
    [
        pytest.param([400.0, 300.0, 500.0], [450.0, 350.0, 900.0], [0.3, 0.3, 0.4], True, id="carried"),
        pytest.param([400.0, 300.0, 500.0], [1500.0, 990.0, 31000.0], [0.3, 0.3, 0.4], False, id="not"),
        pytest.param([400.0, 300.0, 500.0], [450.0, 350.0, 90000.0], [0.1, 0.1, 0.8], True, id="by one"),
        pytest.param([1200.0, 1000.0, 500.0], [1300.0, 1050.0, 900.0], [0.1, 0.1, 0.8], True, id="foretold"),
        pytest.param([1200.0, 1000.0, 500.0], [1300.0, 1050.0, 29000.0], [0.1, 0.1, 0.8], False, id="worse"),
    ],
)
def test_a_gain_is_carried_over_or_not(
    fitted: list[float], left_out: list[float], leverage: list[float], passes: bool
) -> None:
    """A record that alone shows an effect is no judge where it is not foretold, and counts where it is."""
    assert _carried_over(errors(fitted, left_out, leverage), BASE) is passes
