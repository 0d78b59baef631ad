"""What lies in the picture: exact pinhole projection of a camera without roll."""

import math

import numpy as np
from numpy.typing import ArrayLike

from planner.geometry.arrays import Bools, Floats
from planner.viewpoints.camera import Camera


def camera_axes(yaw_deg: ArrayLike, pitch_deg: ArrayLike) -> Floats:
    """Axes of a camera with zero roll.

    Parameters
    ----------
    yaw_deg, pitch_deg
        Degrees, same shape (...). At nadir the top of the picture points along the yaw.

    Returns
    -------
    axes
        Unit rows right, up, forward in the local frame, shape (..., 3, 3): multiplied from
        the left, a turn ``camera_from_local``.

    """
    yaw, pitch = np.radians(yaw_deg), np.radians(pitch_deg)
    sin_yaw, cos_yaw, sin_pitch, cos_pitch = np.sin(yaw), np.cos(yaw), np.sin(pitch), np.cos(pitch)
    zero = np.zeros_like(sin_yaw)
    right = np.stack([cos_yaw, -sin_yaw, zero], axis=-1)
    up = np.stack([-sin_pitch * sin_yaw, -sin_pitch * cos_yaw, cos_pitch], axis=-1)
    forward = np.stack([cos_pitch * sin_yaw, cos_pitch * cos_yaw, sin_pitch], axis=-1)
    return np.stack([right, up, forward], axis=-2)


def picture_bounds(camera: Camera) -> tuple[float, float, float, float]:
    """Left, right, bottom and top rim of the picture at depth 1 (right and up positive)."""
    across, down = camera.principal_px or (0.5 * camera.width_px, 0.5 * camera.height_px)
    focal = camera.focal_px
    return (
        -across / focal,
        (camera.width_px - across) / focal,
        (down - camera.height_px) / focal,
        down / focal,
    )


def in_frustum(rays: Floats, yaw_deg: ArrayLike, pitch_deg: ArrayLike, camera: Camera) -> Bools:
    """Tell which points are in the picture of their camera, rim included.

    Parameters
    ----------
    rays
        From camera to point, of any length, shape (..., 3), local frame.
    yaw_deg, pitch_deg
        Pose of each ray's camera, degrees, broadcast against shape (...).
    camera
        Size of the picture, focal length and principal point.

    """
    axes = camera_axes(yaw_deg, pitch_deg)
    x, y, z = np.moveaxis(rays, -1, 0)
    # Spelt out, so that points on the rim fall as they do in the compiled loop.
    right, up, depth = (
        axes[..., row, 0] * x + axes[..., row, 1] * y + axes[..., row, 2] * z for row in range(3)
    )
    west, east, south, north = picture_bounds(camera)
    across = (west * depth <= right) & (right <= east * depth)
    along = (south * depth <= up) & (up <= north * depth)
    return np.asarray((depth > 0.0) & across & along)


def elevation_range(camera: Camera) -> tuple[float, float]:
    """Lowest and highest elevation that the gimbal brings into the picture's middle column.

    Returns
    -------
    low, high
        Elevation of the ray from camera to point, radians in [-pi/2, pi/2]; with the yaw
        free, each elevation between them is in the picture of some pitch.

    """
    _, _, south, north = picture_bounds(camera)
    low = math.radians(camera.pitch_min_deg) + math.atan(south)
    high = math.radians(camera.pitch_max_deg) + math.atan(north)
    return max(low, -0.5 * math.pi), min(high, 0.5 * math.pi)
