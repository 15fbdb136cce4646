"""Transforms of `load_dict`, with the names of Mitsuba's `ScalarTransform4f`."""

from __future__ import annotations

from typing import Sequence

import numpy as np


class Transform:
    """An affine map of points, `to_world` in dictionaries.

    Methods build chains that are read from the left, as in Mitsuba:
    `Transform().translate([1, 0, 0]).rotate([0, 1, 0], 30)` first rotates and then translates.
    `@` multiplies. Angles are degrees.
    """

    def __init__(self, matrix: object = None) -> None:
        self.matrix = np.eye(4) if matrix is None else np.array(matrix, dtype=np.float64)
        if self.matrix.shape != (4, 4):
            raise ValueError(f"a transform is a 4x4 matrix, not {self.matrix.shape}")

    def __matmul__(self, other: Transform) -> Transform:
        return Transform(self.matrix @ other.matrix)

    def __repr__(self) -> str:
        return f"Transform({self.matrix.tolist()})"

    def translate(self, v: Sequence[float]) -> Transform:
        """Moves by `v`."""
        m = np.eye(4)
        m[:3, 3] = v
        return Transform(self.matrix @ m)

    def scale(self, v: float | Sequence[float]) -> Transform:
        """Scales by one factor, or by one for each axis."""
        m = np.eye(4)
        m[[0, 1, 2], [0, 1, 2]] = v
        return Transform(self.matrix @ m)

    def rotate(self, axis: Sequence[float], angle: float) -> Transform:
        """Rotates about `axis` through the origin by `angle` degrees (Rodrigues' formula)."""
        x, y, z = np.asarray(axis, dtype=np.float64) / np.linalg.norm(axis)
        k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        a = np.radians(angle)
        m = np.eye(4)
        m[:3, :3] += np.sin(a) * k + (1.0 - np.cos(a)) * (k @ k)
        return Transform(self.matrix @ m)

    def look_at(
        self, origin: Sequence[float], target: Sequence[float], up: Sequence[float]
    ) -> Transform:
        """A camera at `origin` that looks at `target`: +z forward, +y up, +x to the left."""
        o = np.asarray(origin, dtype=np.float64)
        forward = np.asarray(target, dtype=np.float64) - o
        forward /= np.linalg.norm(forward)
        left = np.cross(up, forward)
        left /= np.linalg.norm(left)
        m = np.eye(4)
        m[:3, 0], m[:3, 1], m[:3, 2], m[:3, 3] = left, np.cross(forward, left), forward, o
        return Transform(self.matrix @ m)
