"""When a camera at a place could see a sample, were nothing in between."""

import math
from dataclasses import dataclass

from planner.config import ViewpointSettings
from planner.viewpoints.camera import Camera
from planner.viewpoints.frustum import elevation_range


@dataclass(frozen=True, slots=True)
class SightRule:
    """Limits on one position-sample pair, whatever the camera's aim.

    Parameters
    ----------
    d_min, d_max
        Closest and farthest distance, metres.
    max_incidence
        Largest angle between the ray and the sample's normal, radians, in (0, pi/2).
    reach
        Largest distance over cosine of incidence, metres: the wanted ground sample distance
        times the focal length in pixels; infinite where the GSD does not matter.
    low, high
        Range of the ray's elevation from camera to sample, radians.
    sectors
        How many direction sectors are told apart, at least 1.

    Raises
    ------
    ValueError
        If a limit is out of range.

    """

    d_min: float
    d_max: float
    max_incidence: float
    reach: float = math.inf
    low: float = -0.5 * math.pi
    high: float = 0.5 * math.pi
    sectors: int = 8

    def __post_init__(self) -> None:
        if not 0.0 <= self.d_min < self.d_max:
            raise ValueError(f"need 0 <= d_min < d_max, got {self.d_min} and {self.d_max}.")
        if not 0.0 < self.max_incidence < 0.5 * math.pi:
            raise ValueError(f"max_incidence must be in (0, pi/2), got {self.max_incidence}.")
        if self.reach <= 0.0 or not 1 <= self.sectors <= 255:
            raise ValueError(f"reach {self.reach} or sectors {self.sectors} out of range.")

    @property
    def cap(self) -> float:
        """Cosine of the edge of sector 0, which has its fair share of the solid angle."""
        return 1.0 - (1.0 - math.cos(self.max_incidence)) / self.sectors

    @classmethod
    def of(
        cls,
        camera: Camera,
        settings: ViewpointSettings,
        *,
        d_min: float,
        d_max: float,
        gsd: float,
    ) -> "SightRule":
        """Rule of preset ``cover``: range, incidence, gimbal and ground sample distance."""
        low, high = elevation_range(camera)
        return cls(
            d_min=d_min,
            d_max=d_max,
            max_incidence=math.radians(settings.max_incidence_deg),
            reach=gsd * camera.focal_px,
            low=low,
            high=high,
            sectors=settings.sector_count,
        )
