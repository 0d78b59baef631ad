"""The made-up place that the choice of photos is measured on, and the settings for it."""

import math

from planner.config import CameraSettings, Config, ScaleSettings
from planner.scene.scene import Scene
from planner.scene.synthetic import synthetic_scene

SIZE = (60.0, 85.0)
"""Metres: of the literature's scene NY-1."""
CLEARANCE = 5.0
"""Metres that the camera keeps from everything."""
REFERENCE = 50.0
"""Metres: twice the distance that just meets the wanted GSD."""

_PIXELS = (3840, 2160)
_ACROSS = 60.0  # degrees; 36 the other way
_RADIUS = 1.45  # metres: about 3,500 samples
_PLOT = 510.0  # square metres a building: ten on the place


def benchmark_block(seed: int = 0, *, size: tuple[float, float] = SIZE) -> Scene:
    """Dense block with towers of up to 25 m, as a nadir first flight knows it.

    Of the size of the literature's scene NY-1, so that numbers of photos can be compared.

    Parameters
    ----------
    seed
        Any integer from 0.
    size
        Lengths along the streets, metres; larger places get more buildings.

    Returns
    -------
    scene
        Ground and box as estimated from the cloud.

    """
    return synthetic_scene(
        seed,
        size=size,
        buildings=round(size[0] * size[1] / _PLOT),
        heights=(5.0, 25.0),
        relief=0.0,
        turn=0.0,
        trees=False,
        bridge=False,
    )


def benchmark_config(seed: int = 0) -> Config:
    """Settings for :func:`benchmark_block`: 5 m clearance, 60 x 36 degrees, reference 50 m.

    Photos are worth nothing to reconstructability at the reference distance, and just meet the
    wanted GSD at half of it, which is as far as photos are taken from.
    """
    width, height = _PIXELS
    focal = 0.5 * width / math.tan(math.radians(0.5 * _ACROSS))
    diagonal = 2.0 * math.degrees(math.atan(0.5 * math.hypot(width, height) / focal))
    return Config(
        seed=seed,
        camera=CameraSettings(width_px=width, height_px=height, diagonal_deg=diagonal),
        scale=ScaleSettings(
            radius=_RADIUS,
            d_min=CLEARANCE,
            d_max=0.5 * REFERENCE,
            gsd=0.5 * REFERENCE / focal,
        ),
    )
