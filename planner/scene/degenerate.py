"""Refusing what is no scene: too few points, a line, a flat plane."""

from pathlib import Path

import numpy as np

from planner.geometry.arrays import Floats
from planner.scene.readers.source import refusal

_FEWEST = 100
_LINE = 1e-3  # width over length below which points lie on a line
_PLANE = 2e-3  # thickness over length below which they lie on a plane
_PROBE = 200_000


def check_shape(path: Path, xyz: Floats, *, least: int = _FEWEST) -> None:
    """Refuse points that do not span a solid.

    Parameters
    ----------
    path
        For the message.
    xyz
        Points, shape (N, 3), metres.
    least
        Fewest points that make a scene.

    Raises
    ------
    PlannerError
        If there are too few points, or all lie on a line or a plane but for 0.2 % at each side.

    """
    if len(xyz) < least:
        wrong = f"it has only {len(xyz)} points"
        raise refusal(path, wrong, f"give a scan of at least {least} points")
    probe = xyz[:: max(1, len(xyz) // _PROBE)]
    centred = probe - np.median(probe, axis=0)
    axes = np.linalg.eigh(centred.T @ centred)[1][:, ::-1]  # the longest first
    low, high = np.percentile(centred @ axes, (0.2, 99.8), axis=0)
    length, width, thickness = np.sort(high - low)[::-1]
    if length <= 0.0:
        raise refusal(path, "all its points coincide", "give a scan of a place")
    if width < _LINE * length:
        wrong = f"all its points lie on a line ({length:.3g} long, {width:.2g} wide)"
        raise refusal(path, wrong, "give a scan that covers an area")
    if thickness < _PLANE * length:
        wrong = f"it is a flat plane ({length:.3g} long, {thickness:.2g} thick)"
        raise refusal(path, wrong, "give a scan with buildings or relief; a plane needs no 3D plan")
