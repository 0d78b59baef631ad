"""How fast the aircraft may fly, speed up and turn, and how it takes its photos."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from planner.config import FlightSettings

SLOWEST = 1e-3
"""Speeds, accelerations and rates below this are refused: flights would last for ever."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of motion, SI units but for the angles.

    Parameters
    ----------
    speed
        Metres a second.
    acceleration
        Along the curve, speeding up and braking, metres a second squared.
    lateral_acceleration
        Across the curve: ``v**2`` times the curvature, metres a second squared.
    yaw_rate_deg, gimbal_rate_deg
        Degrees a second of yaw and of pitch.
    stop
        Whether the aircraft stops for each photo; else it flies through.
    settle_seconds
        Rest between stopping and the photo, seconds; only if it stops.
    hold_seconds
        How long the camera keeps its angles before and after a photo that is flown through.
    photo_speed
        Largest speed at a photo that is flown through, metres a second; may be infinite.

    Raises
    ------
    ValueError
        If a limit is not positive and finite, or a time is negative.

    """

    speed: float = 4.0
    acceleration: float = 2.0
    lateral_acceleration: float = 2.0
    yaw_rate_deg: float = 60.0
    gimbal_rate_deg: float = 60.0
    stop: bool = True
    settle_seconds: float = 1.0
    hold_seconds: float = 0.1
    photo_speed: float = math.inf

    def __post_init__(self) -> None:
        for name in (
            "speed",
            "acceleration",
            "lateral_acceleration",
            "yaw_rate_deg",
            "gimbal_rate_deg",
        ):
            value = getattr(self, name)
            if not SLOWEST <= value < math.inf:
                raise ValueError(f"{name} must be at least {SLOWEST} and finite, got {value}.")
        for name in ("settle_seconds", "hold_seconds"):
            if not 0.0 <= getattr(self, name) < 1e4:
                raise ValueError(f"{name} must be from 0 to 1e4, got {getattr(self, name)}.")
        if not self.photo_speed >= SLOWEST:
            raise ValueError(f"photo_speed must be at least {SLOWEST}, got {self.photo_speed}.")

    @classmethod
    def of(cls, settings: FlightSettings, *, gsd: float) -> "Limits":
        """Limits of the settings.

        Parameters
        ----------
        settings
            Speeds, rates, and how photos are taken.
        gsd
            Wanted ground sample distance, metres a pixel: while the shutter is open the aircraft
            may move ``blur_px`` of it.

        """
        return cls(
            settings.speed,
            settings.acceleration,
            settings.lateral_acceleration,
            settings.yaw_rate_deg,
            settings.gimbal_rate_deg,
            settings.shoot == "stop",
            settings.settle_seconds,
            settings.hold_seconds,
            max(SLOWEST, settings.blur_px * gsd / settings.exposure_seconds),
        )

    def to_record(self) -> dict[str, Any]:
        """Plain values for JSON; an infinite speed becomes ``None``."""
        record = asdict(self)
        if math.isinf(self.photo_speed):
            record["photo_speed"] = None
        return record

    @classmethod
    def from_record(cls, record: Mapping[str, Any]) -> "Limits":
        """Limits from :meth:`to_record`.

        Raises
        ------
        ValueError
            If a value is missing, unknown, or no sensible number.

        """
        try:
            values = {**record, "photo_speed": record["photo_speed"]}
            if values["photo_speed"] is None:
                values["photo_speed"] = math.inf
            if not isinstance(values.pop("stop"), bool):
                raise ValueError("stop must be true or false.")
            numbers = {name: float(value) for name, value in values.items()}
            return cls(**numbers, stop=record["stop"])
        except (KeyError, TypeError, OverflowError) as error:
            raise ValueError(f"the limits of motion are malformed: {error!r}.") from error
