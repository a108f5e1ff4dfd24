"""The geometry of a file or object before validation, and the errors that its readers raise."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_aerial.cloud.assumptions import Assumption
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array


@dataclass(frozen=True, eq=False)
class RawGeometry:
    """Points, and triangles if any, that have not been validated.

    Attributes
    ----------
    points : (N, 3) array
        Points, or a mesh's vertices [m]; rows may be non-finite.
    faces : (F, 3) int array or None
        Triangles of a mesh; None for a cloud.
    label : str
        Name of the source in messages.
    path : str or None
        The file, if there is one.
    viewpoint : (3,) array or None
        The sensor's position [m], if the source has it.
    assumptions : tuple of Assumption
        Assumptions of the reader.
    in_camera_axes : bool
        True for a depth image's points in the camera's frame, z forward.
    """

    points: Array
    faces: NDArray[np.int64] | None
    label: str
    path: str | None = None
    viewpoint: Array | None = None
    assumptions: tuple[Assumption, ...] = ()
    in_camera_axes: bool = False


def invalid(path: Path, reason: object) -> InputError:
    """Return the error for a file that breaks the rules of its format."""
    text = " ".join(str(reason).split())
    return InputError(f"cannot read {path}: not a valid {path.suffix[1:].upper()} file: {text}")


def cut_short(path: Path, reason: str) -> InputError:
    """Return the error for a file that has less data than it declares."""
    return InputError(f"cannot read {path}: the file is cut short: {reason}")


def as_points(values: Any, label: str) -> Array:
    """Return `values` as an (N, 3) float64 array.

    Raises
    ------
    InputError
        If the values are not real numbers of this shape; the message names their shape or type.
    """
    try:
        array = np.asarray(values)
    except ValueError as error:
        raise InputError(
            f"{label} must be an (N, 3) array of numbers, got rows of different lengths"
        ) from error
    if array.dtype.kind not in "fiu":
        raise InputError(f"{label} must hold real numbers, got dtype {array.dtype}")
    if array.size == 0:
        raise InputError(f"{label} holds no points")
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f"{label} must be of shape (N, 3), got {array.shape}")
    return np.ascontiguousarray(array, dtype=np.float64)
