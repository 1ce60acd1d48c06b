"""Standard deviation with its derivatives, of series of any size."""

from __future__ import annotations

import numpy as np
import pytest

from meltemi.loads import std_weights


@pytest.mark.parametrize("scale", [1e-300, 1.0, 1e300])
def test_of_a_series_of_any_size(scale: float) -> None:
    x = np.sin(np.arange(7.0))
    std, weights = std_weights(scale * x)
    assert std == pytest.approx(scale * x.std(), rel=1e-14)
    assert weights == pytest.approx((x - x.mean()) / (7 * x.std()), rel=1e-12)
