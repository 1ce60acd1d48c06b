"""Linear models in the fixed frame, from derivatives in rotating axes that are given."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import meltemi
from meltemi.analysis import linearise, operating_point
from meltemi.simulation.case import Case

Float = NDArray[np.float64]
PARTS = ("collective", "cosine", "sine")


@pytest.mark.parametrize("azimuths", [1, 4])
def test_derivatives_in_rotating_axes_become_those_of_components(
    model: meltemi.Model, monkeypatch: pytest.MonkeyPatch, azimuths: int
) -> None:
    """dx/dt = -2 x + 5 u of each blade, with an output 3 x + 7 u, of any frame; the frame adds its rotation (of a state
    that does not move, too, as its components do)."""

    def given(case: Any, columns: Any, rows: Any) -> Float:
        J = np.zeros((len(rows), len(columns)))
        at = {c.name: k for k, c in enumerate(columns)}
        n = len(columns) - 4
        for b in "123":
            J[at[f"v blade {b} 1st flap"], at[f"v blade {b} 1st flap"]] = -2.0
            J[at[f"v blade {b} 1st flap"], at[f"pitch_{b}"]] = 5.0
            J[n + int(b) - 1, at[f"v blade {b} 1st flap"]] = 3.0
            J[n + int(b) - 1, at[f"pitch_{b}"]] = 7.0
        J[at["v generator"], at["wind_speed"]] = 11.0
        return J

    monkeypatch.setattr("meltemi.analyses.linear.linear_case", lambda model, point: Case(model, point.wind))
    monkeypatch.setattr("meltemi.analyses.linear.jacobian", given)
    point = operating_point(model, 9.0)
    found = linearise(
        model, point, inputs=("pitch_1", "wind_speed"), outputs=("root_moment_out_of_plane_1",), azimuths=azimuths
    )
    x, u, y = (list(names) for names in (found.states, found.inputs, found.outputs))
    flap = [x.index(f"v 1st flap {part}") for part in PARTS]
    pitch = [u.index(f"pitch_{part}") for part in PARTS]
    W = point.rotor_speed
    turning = W * np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    np.testing.assert_allclose(found.A[np.ix_(flap, flap)], -2.0 * np.eye(3) - turning, atol=1e-12)
    np.testing.assert_allclose(found.B[np.ix_(flap, pitch)], 5.0 * np.eye(3), atol=1e-12)
    np.testing.assert_allclose(found.C[:, flap], 3.0 * np.eye(3), atol=1e-12)
    np.testing.assert_allclose(found.D[:, pitch], 7.0 * np.eye(3), atol=1e-12)
    assert found.B[x.index("v generator"), u.index("wind_speed")] == pytest.approx(11.0)
    assert len(y) == 3
    # the rotation of the frame follows the present speed
    q = [x.index(f"q 1st flap {part}") for part in PARTS]
    columns = np.array([found.A[q, x.index(name)] for name in ("v generator", "v drivetrain")])
    np.testing.assert_allclose(columns, np.tile(-turning @ found.x0[q] / W, (2, 1)), atol=1e-9)
    assert np.abs(columns).max() > 0.0
