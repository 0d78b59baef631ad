"""Every length of a plan from the bounding box, the camera and the wanted GSD."""

import math
from dataclasses import dataclass

import numpy as np

from planner.config import ScaleSettings
from planner.errors import PlannerError
from planner.geometry.arrays import Floats
from planner.scene.scene import Scene
from planner.viewpoints.camera import Camera

NEAREST_SHARE = 0.8  # of d_max: with less room between the distances there is nowhere to fly
SAFETY_METRES = 2.0  # kept beyond the prior's own uncertainty
DESIGN_INCIDENCE = math.radians(45.0)  # at which d_max just meets the wanted GSD


@dataclass(frozen=True, slots=True)
class Rule:
    """One length and where it comes from.

    Parameters
    ----------
    name, value, unit
        What it is called, its value, and the value's unit.
    because
        The rule, as one phrase with its numbers.

    """

    name: str
    value: float
    unit: str
    because: str


@dataclass(frozen=True, slots=True)
class Scale:
    """The lengths of a plan, metres.

    Parameters
    ----------
    radius
        Poisson-disk radius R of the surface samples.
    gsd
        Wanted ground sample distance, metres a pixel.
    d_min, d_max
        Closest and farthest distance of a camera from what it photographs.
    voxel
        Spacing of the candidate positions.
    poisson_depth
        Depth of the octree of the Poisson reconstruction.
    prior_noise
        Uncertainty of the coarse model.
    rules
        The same values with their rules, to be printed.

    """

    radius: float
    gsd: float
    d_min: float
    d_max: float
    voxel: float
    poisson_depth: int
    prior_noise: float
    rules: tuple[Rule, ...]


def derive_scale(scene: Scene, camera: Camera, settings: ScaleSettings) -> Scale:
    """Derive what is not set, each from one rule.

    Parameters
    ----------
    scene
        The scene; its box gives the size, its cloud the prior's noise.
    camera
        The camera; gives the distance that meets the wanted ground sample distance.
    settings
        Lengths that the user fixed.

    Returns
    -------
    scale
        Lengths and rules.

    Raises
    ------
    PlannerError
        If ``d_min`` leaves no room below ``d_max``; the message names both.

    """
    rules: list[Rule] = []

    def decide(
        name: str, fixed: float | None, derived: float, because: str, unit: str = "m"
    ) -> float:
        value = derived if fixed is None else float(fixed)
        rules.append(Rule(name, value, unit, because if fixed is None else "set by the user"))
        return value

    longest = float(scene.box.size.max())
    share = settings.radius_share
    radius = decide(
        "radius",
        settings.radius,
        share * longest,
        f"{100 * share:g} % of the longest axis {longest:.4g} m",
    )
    noise = decide(
        "prior_noise",
        settings.prior_noise,
        prior_noise(scene.cloud.xyz),
        "median distance of a point to the plane through its 16 neighbours",
    )
    allowance = noise + SAFETY_METRES if scene.metric else 0.0
    d_min = decide(
        "d_min",
        settings.d_min,
        max(2.0 * radius, allowance),
        f"the larger of 2 R and the prior's noise + {SAFETY_METRES:g} m"
        if scene.metric
        else "2 R (the source's unit is not known to be metres)",
    )
    finest, why = radius / 100.0, "R / 100"
    needed = d_min / NEAREST_SHARE * 1.25 / (camera.focal_px * math.cos(DESIGN_INCIDENCE))
    if settings.d_max is None and settings.gsd is None and finest < needed:
        finest, why = needed, f"the finest for which d_max leaves room above d_min {d_min:.4g} m"
    gsd = decide("gsd", settings.gsd, finest, why, "m/px")
    d_max = decide(
        "d_max",
        settings.d_max,
        camera.distance_for(gsd, DESIGN_INCIDENCE),
        f"the distance that meets the GSD {gsd:.4g} m/px at 45 degrees incidence",
    )
    if settings.d_min is None and d_min >= NEAREST_SHARE * d_max and d_max > 0.0:
        least = allowance if scene.metric else 0.0
        closer = max(least, 0.5 * d_max)
        if closer < NEAREST_SHARE * d_max:
            d_min = closer
            adapted = Rule(
                "d_min", d_min, "m", "half of d_max, since 2 R leaves no room below d_max"
            )
            rules = [adapted if rule.name == "d_min" else rule for rule in rules]
    if d_min >= NEAREST_SHARE * d_max:
        raise PlannerError(
            f"{scene.source or scene.name}: d_min {d_min:.4g} m leaves no room below "
            f"d_max {d_max:.4g} m; "
            f"set scale.gsd above {needed:.3g} m/px, or scale.d_min and scale.d_max, "
            "or scene.unit if the unit is wrong"
        )
    voxel = decide("voxel", settings.voxel, 2.0 * radius, "2 R")
    depth = round(math.log2(1.1 * longest / (0.25 * radius)))
    depth = int(
        decide(
            "poisson_depth",
            settings.poisson_depth,
            min(max(depth, 5), 9),
            "octree cell of about R / 4, from 5 to 9",
            "",
        )
    )
    return Scale(radius, gsd, d_min, d_max, voxel, depth, noise, tuple(rules))


def prior_noise(xyz: Floats, *, neighbours: int = 16, probes: int = 4000) -> float:
    """Median distance of a point to the plane through its nearest neighbours.

    Parameters
    ----------
    xyz
        Points, shape (N, 3), metres.
    neighbours
        Size of the neighbourhood that the plane is fitted to.
    probes
        Number of points, evenly spread over the rows, that are measured.

    Returns
    -------
    noise
        Metres; 0 for fewer points than neighbours.

    """
    from scipy.spatial import cKDTree

    if len(xyz) <= neighbours:
        return 0.0
    rows = np.unique(np.linspace(0, len(xyz) - 1, min(probes, len(xyz))).astype(np.int64))
    near = np.asarray(cKDTree(xyz).query(xyz[rows], k=neighbours + 1)[1])
    around = xyz[near[:, 1:]]
    centre = around.mean(axis=1)
    spread = np.einsum("nki,nkj->nij", around - centre[:, None], around - centre[:, None])
    normal = np.linalg.eigh(spread)[1][:, :, 0]
    return float(np.median(np.abs(np.einsum("ni,ni->n", xyz[rows] - centre, normal))))
