"""Arguments as arrays of numbers."""

from __future__ import annotations

from typing import Any, Union

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Numbers = Union[npt.ArrayLike, "npt.NDArray[Any]"]


def array(numbers: Numbers, name: str) -> Array:
    """A contiguous array of float64."""
    try:
        return np.asarray(numbers, dtype=np.float64, order="C")
    except (TypeError, ValueError) as error:
        raise TypeError(f"{name}: expected numbers, got {type(numbers).__name__} ({error})") from None


def joints(numbers: Numbers, dof: int, name: str) -> Array:
    """Joints (..., dof)."""
    found = array(numbers, name)
    if found.ndim == 0 or found.shape[-1] != dof:
        raise ValueError(f"{name}: expected (..., {dof}), got an array of shape {found.shape}")
    return found


def poses(numbers: Numbers, name: str) -> Array:
    """Poses (..., 4, 4), also from rows (..., 7) of x, y, z, qw, qx, qy, qz."""
    found = array(numbers, name)
    if found.ndim >= 1 and found.shape[-1] == 7 and found.shape[-2:] != (4, 4):
        from ._poses import matrix

        return matrix(found)
    if found.ndim < 2 or found.shape[-2:] != (4, 4):
        raise ValueError(
            f"{name}: expected (..., 4, 4) or (..., 7), got an array of shape {found.shape}"
        )
    return found


def per_joint(value: Numbers | None, dof: int, name: str, default: float) -> Array:
    """One number for each joint (dof,); a single number is for all of them."""
    if value is None:
        return np.full(dof, default)
    found = array(value, name)
    if found.ndim == 0:
        return np.full(dof, float(found))
    if found.shape != (dof,):
        raise ValueError(f"{name}: expected a number or ({dof},), got shape {found.shape}")
    return found
