"""Exact distances and sweeps against triangles, through FCL.

A bounding volume hierarchy is hollow to FCL: what lies deep inside of a building touches nothing.
So everything here is unsigned; :mod:`planner.airspace.occupancy` knows the side.
"""

import math
from typing import Any

import numpy as np

from planner.geometry.arrays import Floats
from planner.scene.cloud import Mesh

_THIN = 1e-7  # of the length, metres where that is below one
_FLAT = 1e-8  # width over length under which a triangle counts as having no area
_SLACK = 1e-5  # metres: FCL's capsule test reports contacts up to 1e-6 m too late


class Triangles:
    """Triangles in a bounding volume hierarchy; one per process, as FCL objects do not pickle.

    Parameters
    ----------
    mesh
        At least one triangle.

    """

    def __init__(self, mesh: Mesh) -> None:
        import fcl

        self._fcl = fcl
        mesh = _fattened(mesh)
        model = fcl.BVHModel()
        model.beginModel(len(mesh.vertices), len(mesh))
        model.addSubModel(np.array(mesh.vertices), np.array(mesh.triangles))
        model.endModel()
        self._solid = fcl.CollisionObject(model)
        self._point = fcl.CollisionObject(fcl.Sphere(0.0))
        self._distance = fcl.DistanceRequest()
        self._nearest = fcl.DistanceRequest(True)
        self._contact = fcl.CollisionRequest()

    def distance(self, points: Floats) -> Floats:
        """Distance from each point, shape (N, 3), to the nearest triangle, metres; exact."""
        fcl, point, solid, request = self._fcl, self._point, self._solid, self._distance
        distances = np.empty(len(points))
        for row, at in enumerate(np.asarray(points, dtype=np.float64)):
            point.setTranslation(at)
            distances[row] = fcl.distance(point, solid, request, fcl.DistanceResult())
        return distances.clip(0.0)

    def nearest(self, point: Floats) -> tuple[float, Floats]:
        """Distance to the nearest triangle and the nearest place on it, shape (3,)."""
        self._point.setTranslation(point)
        result = self._fcl.DistanceResult()
        distance = self._fcl.distance(self._point, self._solid, self._nearest, result)
        return max(float(distance), 0.0), np.asarray(result.nearest_points[0])

    def capsule_is_clear(self, a: Floats, b: Floats, radius: float) -> bool:
        """Tell whether all triangles are at least ``radius`` away from the segment ``ab``.

        Exact but for a hundredth of a millimetre, by which it errs to the safe side.
        """
        middle, half = 0.5 * (a + b), 0.5 * float(np.linalg.norm(b - a))
        at_middle = float(self.distance(middle[None])[0])
        if at_middle < radius:
            return False
        if half == 0.0 or at_middle >= radius + half + _SLACK:
            return True
        capsule: Any = self._fcl.Capsule(radius + _SLACK, 2.0 * half)
        pose = self._fcl.Transform(_along((b - a) / (2.0 * half)), middle)
        swept = self._fcl.CollisionObject(capsule, pose)
        return not self._fcl.collide(swept, self._solid, self._contact, self._fcl.CollisionResult())


def _fattened(mesh: Mesh) -> Mesh:
    """Give triangles without an area one.

    FCL takes the distance of a triangle of no area to all places for zero, and is off by up to
    millimetres for one that is nearly so. The longest edge stays; the third corner moves off its
    start by a ten-millionth of its length.
    """
    corners = mesh.vertices[mesh.triangles]
    edges = np.roll(corners, -1, axis=1) - corners
    lengths = np.linalg.norm(edges, axis=2)
    area2 = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    flat = np.flatnonzero(area2 <= _FLAT * lengths.max(axis=1) ** 2)
    if not len(flat):
        return mesh
    longest = lengths[flat].argmax(axis=1)
    start, edge = corners[flat, longest], edges[flat, longest]
    aside = np.eye(3)[np.abs(edge).argmin(axis=1)]  # far from parallel to the edge
    thin = _THIN * np.maximum(lengths[flat].max(axis=1, keepdims=True), 1.0)
    edge = np.where((edge == 0.0).all(axis=1, keepdims=True), thin * aside[:, [2, 0, 1]], edge)
    added = np.stack([start, start + edge, start + thin * aside], axis=1).reshape(-1, 3)
    triangles = mesh.triangles.copy()
    triangles[flat] = len(mesh.vertices) + np.arange(len(added)).reshape(-1, 3)
    return Mesh(np.concatenate([mesh.vertices, added]), triangles)


def _along(axis: Floats) -> Floats:
    """Rotation, shape (3, 3), that turns z to the unit vector ``axis``."""
    x, y, z = axis.tolist()
    sign = math.copysign(1.0, z)  # basis without a branch near the poles, doi:10.1145/3283254
    a = -1.0 / (sign + z)
    b = x * y * a
    return np.array(
        [
            [1.0 + sign * x * x * a, b, x],
            [sign * b, sign + y * y * a, y],
            [-sign * x, -y, z],
        ]
    )
