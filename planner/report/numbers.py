"""Every number of a plan, as plain values for ``report.json``."""

import math
from dataclasses import asdict
from decimal import ROUND_FLOOR, Decimal
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.flight.energy import climb_energy, energy

if TYPE_CHECKING:
    from planner.config import ViewpointSettings
    from planner.planning import Plan
    from planner.sorties.sorties import Sorties
    from planner.viewpoints.selection import FloorWish, Selection
    from solvers import Result

PACKAGES: tuple[str, ...] = (
    "scanwright",
    "numpy",
    "scipy",
    "numba",
    "open3d",
    "open3d-cpu",
    "cvxpy",
    "highspy",
    "ortools",
    "ompl",
    "python-fcl",
    "networkx",
    "laspy",
    "trimesh",
    "pyproj",
)


def versions() -> dict[str, str]:
    """Installed versions of this package and of those that its results depend on."""
    found: dict[str, str] = {}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found


def summary(plan: "Plan") -> dict[str, Any]:
    """Numbers of a plan, metres, seconds and degrees; the same for the same seed.

    Parameters
    ----------
    plan
        A finished plan.

    Returns
    -------
    numbers
        Nested dicts of plain values, without times and without NaN or infinity.

    """
    path, route, selection = plan.flight.path, plan.route, plan.selection
    smallest = int(np.argmin(path.clearance)) if len(path) else -1
    kept = plan.config.airspace.zone_margin
    zone_margin = float(path.zone_margin.min(initial=np.inf)) + kept
    return {
        "name": plan.scene.name,
        "status": str(plan.status),
        "seed": plan.config.seed,
        "versions": versions(),
        "source": {
            "file": plan.scene.source and Path(plan.scene.source).name,
            "sha256": plan.scene.sha256,
            "points": len(plan.scene.cloud),
            "box": [float(length) for length in plan.scene.box.size],
            "notes": list(plan.scene.notes),
        },
        "scale": [
            {"name": rule.name, "value": rule.value, "unit": rule.unit, "because": rule.because}
            for rule in plan.scale.rules
        ],
        "surface": {
            "triangles": len(plan.surface.mesh),
            "samples": len(plan.samples),
            "clusters": int(plan.samples.cluster.max()) + 1 if len(plan.samples) else 0,
            "quality_percentiles": {
                str(percent): float(np.percentile(plan.samples.quality, percent))
                for percent in (5, 25, 50, 75, 95)
            },
        },
        "viewpoints": {
            "count": len(plan.viewpoints),
            "selected": len(plan.route.order),
            "kinds": {
                kind: plan.viewpoints.kind.count(kind) for kind in sorted(set(plan.viewpoints.kind))
            },
            "mean_hits": float(selection.hits.mean()),
            "reasons": selection.reason_counts(),
            "reconstructable": _reconstructable(selection),
            "sharp": _sharp(selection, plan.config.viewpoints),
            "solvers": [_solver(result) for result in selection.results],
            "first_flight": _first_flight(plan),
            "time_limit": None if plan.limit is None else asdict(plan.limit),
        },
        "route": {
            "switching_cost": route.cost,
            "chord_length": route.length,
            "yaw_change_deg": route.yaw_change_deg,
            "pitch_change_deg": route.pitch_change_deg,
            "solver": _solver(route.result) if route.result is not None else None,
        },
        "path": {
            "pieces": len(path),
            "legs": int(path.leg[-1]) + 1 if len(path) else 0,
            "repaired_legs": len(np.unique(path.leg[path.repaired])),
            "dropped_viewpoints": len(plan.route.order) - len(plan.viewpoints),
            "length": path.length,
            "speed": plan.timeline.limits.speed,
            "duration": plan.timeline.duration,
            "certified_clearance": float(path.clearance[smallest]) if len(path) else None,
            "smallest_clearance_piece": smallest,
            "certified_zone_margin": _finite(zone_margin) if len(path) else None,
        },
        "motion": _motion(plan),
        "sorties": None
        if plan.sorties is None
        else _sorties(plan.sorties, plan.config.sorties.endurance_seconds),
        "airspace": {
            "d_min": plan.scale.d_min,
            "d_max": plan.scale.d_max,
            "zones": len(plan.config.airspace.zones),
            "ceiling": plan.config.airspace.ceiling,
            "zone_margin": kept,
            "unknown": plan.config.airspace.unknown,
        },
        "findings": [
            {
                "stage": finding.stage,
                "code": finding.code,
                "message": finding.message,
                "number": finding.number,
                "partial": finding.partial,
            }
            for finding in plan.findings
        ],
    }


def proven_clearance(plan: "Plan") -> float | None:
    """Least certified clearance of all that is flown, metres; ``None`` if nothing moves.

    Climbs from and descents to the pads are not counted: they begin and end on the ground.
    """
    paths = [plan.flight.path]
    if plan.sorties is not None:
        paths += [flight.path for flight in plan.sorties.others]
        paths += [sortie.path for sortie in plan.sorties.flown]
    return min((float(path.clearance.min()) for path in paths if len(path)), default=None)


def length_and_seconds(plan: "Plan") -> tuple[float, float]:
    """Metres and seconds of all that is flown: the sorties if there are any, or the one flight."""
    if plan.sorties is None:
        return plan.flight.path.length, plan.timeline.duration
    flown = plan.sorties.flown
    return sum(sortie.length for sortie in flown), sum(sortie.duration for sortie in flown)


def rounded_down(metres: float) -> str:
    """Metres in whole centimetres, never more than there are."""
    return str(Decimal(repr(float(metres))).quantize(Decimal("0.01"), rounding=ROUND_FLOOR))


def _reconstructable(selection: "Selection") -> dict[str, Any] | None:
    """Share of what can be reconstructed that is, where that was wanted."""
    wish = selection.wish.pairs
    if wish is None:
        return None
    return {
        "target": wish.target,
        "samples": int(np.count_nonzero(wish.reachable)),
        "share": selection.fulfilled,
        "wanted": None if wish.limited else wish.share,
        "floor": None if wish.floor is None else _floor(selection, wish.floor),
    }


def _sharp(selection: "Selection", settings: "ViewpointSettings") -> dict[str, Any] | None:
    """Share of what can have sharp photos that has as many as are wanted, where any are."""
    if not (settings.by_pairs and settings.sharp_views):
        return None
    can = selection.wish.stages[3] > 0
    most = np.minimum(settings.sharp_views, selection.wish.stages[3][can])
    return {
        "views": settings.sharp_views,
        "samples": int(np.count_nonzero(can)),
        "share": float(np.mean(selection.hits[can] >= most)) if can.any() else 1.0,
        "wanted": settings.sharp_share,
    }


def _floor(selection: "Selection", wish: "FloorWish") -> dict[str, float]:
    """Share of what can have the floor that does."""
    return {
        "h": wish.h,
        "samples": int(np.count_nonzero(wish.reachable)),
        "share": wish.reached(selection.reconstructability),
        "wanted": wish.share,
    }


def _first_flight(plan: "Plan") -> dict[str, Any] | None:
    """How the new photos match those of the first flight, where their poses are known."""
    images, graph = plan.scene.images, plan.selection.graph
    if images is None:
        return None
    return {
        "file": images.file,
        "sha256": images.sha256,
        "photos": len(images),
        "wanted": plan.config.viewpoints.ties,
        "matched": graph.tied,
        "matching_viewpoints": len(np.unique(graph.ties[:, 0])),
    }


def _motion(plan: "Plan") -> dict[str, Any]:
    """Limits of motion, how photos follow each other, and what the flight takes."""
    timeline, settings = plan.timeline, plan.config.flight
    photos = timeline.photo_times
    gaps = np.diff(photos)
    speed = timeline.at(photos)[2] if len(plan.flight.path) else np.zeros(len(photos))
    return {
        **timeline.limits.to_record(),
        "photos": len(photos),
        "photo_interval_min": float(gaps.min()) if len(gaps) else None,
        "photo_interval_mean": float(gaps.mean()) if len(gaps) else None,
        "blur_px": float(speed.max(initial=0.0)) * settings.exposure_seconds / plan.scale.gsd,
        "moving_seconds": float(timeline.profile.duration.sum()),
        "energy_proxy_joules": energy(timeline),
    }


def _sorties(sorties: "Sorties", endurance: float) -> dict[str, Any]:
    """What each flight from take-off to landing takes, and what else was found."""
    return {
        "count": len(sorties.flown),
        "parts_of_free_space": 1 + len(sorties.others),
        "method": sorties.method,
        "seconds": dict(sorties.seconds),
        "cuts_flown": sorties.rounds,
        "proven_optimal_for_this_order": sorties.proven,
        "stations": [
            {"pad": station.pad.tolist(), "entry": station.entry.tolist()}
            for station in sorties.stations
        ],
        "flown": [
            {
                "station": sortie.number,
                "photos": len(sortie.photos),
                "shared": len(sortie.shared),
                "waypoints": sortie.waypoints,
                "duration": sortie.duration,
                "endurance_left": 1.0 - sortie.duration / endurance,
                "length": sortie.length,
                "certified_clearance": float(sortie.path.clearance.min())
                if len(sortie.path)
                else None,
                "energy_proxy_joules": energy(sortie.timeline)
                + climb_energy(sortie.station.climb, 2.0 * sortie.climb_seconds),
            }
            for sortie in sorties.flown
        ],
    }


def in_sorties(sorties: dict[str, Any] | None) -> str:
    """Clause on the sorties of a summary; nothing where there are none."""
    if sorties is None:
        return ""
    longest = max(sortie["duration"] for sortie in sorties["flown"])
    left = min(sortie["endurance_left"] for sortie in sorties["flown"])
    count = sorties["count"]
    return (
        f", {count} sortie{'s' if count > 1 else ''} (longest {longest / 60.0:.1f} min, "
        f"at least {100.0 * left:.0f} % of the battery left)"
    )


def _solver(result: "Result[Any]") -> dict[str, Any]:
    """What a solver reached and what it proved; no seconds, which differ from run to run."""
    return {
        "name": result.solver,
        "status": str(result.status),
        "stop_reason": str(result.stop_reason),
        "cost": _finite(result.cost),
        "bound": _finite(result.bound),
        "gap": _finite(result.gap),
        "iterations": result.iterations,
    }


def _finite(value: float | None) -> float | None:
    return float(value) if value is not None and math.isfinite(value) else None
