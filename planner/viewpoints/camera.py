"""The camera and its gimbal."""

import math
from dataclasses import dataclass

from planner.config import CameraSettings


@dataclass(frozen=True, slots=True)
class Camera:
    """A pinhole camera on a gimbal without roll.

    Parameters
    ----------
    width_px, height_px
        Size of the picture, pixels.
    focal_px
        Focal length, pixels.
    principal_px
        Principal point from the top left corner, pixels; ``None`` is the centre.
    pitch_min_deg, pitch_max_deg
        Range of the gimbal, degrees; 0 is the horizon, -90 is nadir.

    """

    width_px: int = 5472
    height_px: int = 3648
    focal_px: float = 3652.0
    principal_px: tuple[float, float] | None = None
    pitch_min_deg: float = -90.0
    pitch_max_deg: float = 0.0

    @classmethod
    def from_field_of_view(
        cls,
        *,
        width_px: int,
        height_px: int,
        diagonal_deg: float,
        pitch_min_deg: float = -90.0,
        pitch_max_deg: float = 0.0,
    ) -> "Camera":
        """Camera whose diagonal field of view is ``diagonal_deg`` degrees."""
        half = math.hypot(width_px, height_px) / 2.0
        focal = half / math.tan(math.radians(diagonal_deg) / 2.0)
        return cls(width_px, height_px, focal, None, pitch_min_deg, pitch_max_deg)

    @property
    def horizontal_fov(self) -> float:
        """Horizontal field of view, radians."""
        return 2.0 * math.atan(0.5 * self.width_px / self.focal_px)

    @property
    def vertical_fov(self) -> float:
        """Vertical field of view, radians."""
        return 2.0 * math.atan(0.5 * self.height_px / self.focal_px)

    def ground_sample_distance(self, distance: float, cos_incidence: float = 1.0) -> float:
        """Size of a pixel on a surface, metres: ``distance / (focal_px cos_incidence)``."""
        return distance / (self.focal_px * cos_incidence)

    def distance_for(self, ground_sample_distance: float, incidence: float) -> float:
        """Distance, metres, at which a surface seen at ``incidence`` radians has that GSD."""
        return ground_sample_distance * self.focal_px * math.cos(incidence)


def camera_of(settings: CameraSettings) -> Camera:
    """Camera that the settings describe."""
    return Camera.from_field_of_view(**settings.model_dump())
