"""Photos of the first flight whose poses are known."""

import hashlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from planner.geometry.angles import direction, yaw_pitch
from planner.geometry.arrays import Floats, read_only
from planner.geometry.frames import Frame
from planner.scene.readers.poses import Poses, read_poses
from planner.scene.readers.source import refusal

if TYPE_CHECKING:
    from planner.scene.scene import Box

_AWAY = 10.0  # lengths of the scene beyond which an image belongs to another place


@dataclass(frozen=True, slots=True, eq=False)
class Images:
    """Photos that exist already; the camera's roll is left out.

    Parameters
    ----------
    positions
        Shape (M, 3), metres, local frame.
    yaw_deg, pitch_deg
        Shape (M,), degrees, as of :class:`~planner.viewpoints.viewpoints.Viewpoints`.
    names
        Of the photos, length M.
    optics
        Width, height and focal length in pixels, shape (M, 3); not a number where unknown.
    file
        Name of the file that they were read from, without its folder.
    sha256
        Hash of that file.

    """

    positions: Floats
    yaw_deg: Floats
    pitch_deg: Floats
    names: tuple[str, ...]
    optics: Floats
    file: str = ""
    sha256: str = ""

    def __post_init__(self) -> None:
        count = len(self.names)
        for name, shape in (
            ("positions", (count, 3)),
            ("yaw_deg", (count,)),
            ("pitch_deg", (count,)),
            ("optics", (count, 3)),
        ):
            object.__setattr__(self, name, read_only(getattr(self, name), shape, name=name))

    def __len__(self) -> int:
        return len(self.names)


def load_images(path: Path | str, *, frame: Frame, box: "Box") -> Images:
    """Read the poses of photos and bring them into the local frame of a scene.

    Parameters
    ----------
    path
        As :func:`planner.scene.readers.poses.read_poses` takes it; positions are in the
        coordinates of the scene's file.
    frame
        Of the scene.
    box
        Of the scene, to tell other coordinates.

    Raises
    ------
    PlannerError
        If the file cannot be used, or none of its photos is anywhere near the scene.

    """
    path = Path(path)
    images = place_images(read_poses(path), frame)
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    images = replace(images, file=path.name, sha256=digest)
    longest = float(box.size.max())
    away = float(np.linalg.norm(images.positions - box.centre, axis=1).min())
    if away > _AWAY * longest:
        crs = "" if frame.crs is None else f" ({frame.crs[:40]})"
        wrong = f"its nearest photo is {away:.3g} m from the scene, which is {longest:.3g} m long"
        raise refusal(path, wrong, f"give positions in the coordinates of the scene's file{crs}")
    return images


def place_images(poses: Poses, frame: Frame) -> Images:
    """Bring poses from the coordinates of the scene's file into its local frame.

    A camera on a gimbal has no roll. So yaw is that of the picture's top and of the view together,
    which near nadir, where the view alone says nothing of it, is that of the top; pitch is
    that of the view seen from the side.
    """
    xyz, forward, up = poses.xyz, poses.forward, poses.up
    if frame.local_from_source is not None:
        turn = frame.local_from_source
        xyz = xyz @ turn.T
        if not poses.level:
            forward, up = forward @ turn.T, up @ turn.T
    upward = frame.height_unit_metres or frame.unit_metres
    xyz = xyz * (frame.unit_metres, frame.unit_metres, upward) - frame.origin
    heading = forward + np.where(forward[:, 2] < 0.0, 1.0, 0.0)[:, None] * up
    yaw = yaw_pitch(heading)[0]
    ahead = (direction(yaw, np.zeros(len(yaw))) * forward).sum(axis=1).clip(0.0)
    pitch = np.degrees(np.arctan2(forward[:, 2], ahead))
    return Images(xyz, yaw, pitch, poses.names, poses.optics)
