"""The record of a scene: what the view draws, as constants and arrays of few bytes.

A *track* is a series of arrays of the same shape in time. It is stored as a mean and a basis of few directions, with
their amplitudes in 16 bits: ``value = mean + sum_k amplitude_k scale_k basis_k``. The basis is that of the largest
singular values, as many as the accuracy needs.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError

Float = NDArray[np.float64]

BEGIN = b"meltemi scene 1\n"
FULL = 32767
"""Largest number of 16 bits."""
TYPES = {"int8": np.int8, "int16": np.int16, "float32": np.float32}


@dataclass(frozen=True)
class Scene:
    """Data that a view draws of a run, of modes or of a wind.

    Attributes:
      about: constants of the turbine, units, time steps of the tracks, accuracy; plain values.
      arrays: numbers of 8, 16 or 32 bits by name; those of a track ``x`` are ``x.amplitude`` (T, ..., K), ``x.scale``
        (K,), ``x.mean`` (...) and, unless it is the identity, ``x.basis`` (K, ...).
    """

    about: dict[str, Any]
    arrays: dict[str, NDArray[Any]]

    def track(self, name: str) -> Float:
        """(T, ...) values of a track, SI, as the view draws them."""
        amplitude = self.arrays[f"{name}.amplitude"] * self.arrays[f"{name}.scale"].astype(float)
        if f"{name}.basis" in self.arrays:
            amplitude = np.tensordot(amplitude, self.arrays[f"{name}.basis"].astype(float), 1)
        values: Float = amplitude + self.arrays[f"{name}.mean"].astype(float)
        return values


def track_arrays(name: str, values: Float, tolerance: float | None = None, weight: Float | float = 1.0) -> Any:
    """Arrays of a track.

    Args:
      name: name of the track.
      values: (T, ..., n) or, with a tolerance, (T, series, points, n): all series share a basis of (points, n).
      tolerance: largest error of ``weight`` times a value; without it every value has 16 bits.
      weight: (n,) weights of the values.
    """
    if tolerance is None:
        mean = 0.5 * (values.max(axis=0) + values.min(axis=0))
        scale = np.maximum(np.ptp(values, axis=0) / 2.0 / FULL, 1e-30)
        return _stored(name, np.round((values - mean) / scale), scale, mean)
    shape, w = values.shape[-2:], np.broadcast_to(weight, values.shape[-1:])
    flat = (values * w).reshape(-1, int(np.prod(shape)))
    mean = flat.mean(axis=0)
    flat = flat - mean
    if len(flat) < flat.shape[1]:  # with few instants this is the smaller problem
        basis = np.linalg.svd(flat, full_matrices=False)[2]
    else:
        basis = np.linalg.eigh(flat.T @ flat)[1][:, ::-1].T
    amplitude = flat @ basis.T
    count, left = 0, flat
    while count < len(basis) and np.abs(left).max(initial=0.0) > 0.9 * tolerance:
        left = left - np.outer(amplitude[:, count], basis[count])
        count += 1
    count = max(count, 1)
    amplitude = amplitude[:, :count].reshape(*values.shape[:-2], count)
    scale = np.maximum(np.abs(amplitude).max(axis=tuple(range(amplitude.ndim - 1))) / FULL, 1e-30)
    stored = _stored(name, np.round(amplitude / scale), scale, mean.reshape(shape) / w)
    stored[f"{name}.basis"] = (basis[:count].reshape(count, *shape) / w).astype(np.float32)
    return stored


def _stored(name: str, amplitude: Float, scale: Float, mean: Float) -> dict[str, NDArray[Any]]:
    return {
        f"{name}.amplitude": amplitude.astype(np.int16),
        f"{name}.scale": scale.astype(np.float32),
        f"{name}.mean": mean.astype(np.float32),
    }


def packed(scene: Scene) -> bytes:
    """A scene in bytes: a line that names the format, the length of the constants, these as JSON, and the arrays."""
    arrays = {name: [array.dtype.name, list(array.shape)] for name, array in scene.arrays.items()}
    head = json.dumps({"about": scene.about, "arrays": arrays}, separators=(",", ":"), allow_nan=False).encode()
    head += b" " * (-len(head) % 4)
    parts = [BEGIN, len(head).to_bytes(4, "little"), head]
    for array in scene.arrays.values():
        content = array.astype(array.dtype.newbyteorder("<")).tobytes()
        parts += [content, b"\0" * (-len(content) % 4)]
    return b"".join(parts)


def unpacked(content: bytes) -> Scene:
    """The scene of :func:`packed` bytes.

    Raises:
      InputError: they are no scene.
    """
    try:
        if not content.startswith(BEGIN):
            raise ValueError("another format")
        at = len(BEGIN) + 4
        size = int.from_bytes(content[at - 4 : at], "little")
        head, at, arrays = json.loads(content[at : at + size]), at + size, {}
        for name, (kind, shape) in head["arrays"].items():
            dtype = np.dtype(TYPES[kind]).newbyteorder("<")
            count = int(np.prod(shape))
            arrays[name] = np.frombuffer(content, dtype, count, at).reshape(shape).astype(TYPES[kind])
            at += -(-count * dtype.itemsize // 4) * 4
        return Scene(head["about"], arrays)
    except (ValueError, LookupError, TypeError, AttributeError, ArithmeticError, RecursionError):
        raise InputError("the scene of the view is damaged, or of another version of meltemi") from None
