"""Write a plan: every file, then the proof that the written files are safe."""

import os
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.airspace.hull import hull_mesh, save_hull
from planner.errors import PlannerError
from planner.flight.path import FlightPath
from planner.geometry import bezier
from planner.geometry.arrays import Bools, Floats
from planner.missions.check import ELSEWHERE, check_folder, sha256
from planner.missions.folder import whole_folder
from planner.missions.records import write_json, write_points
from planner.missions.sorties import SortieLimits, write_sorties
from planner.missions.tables import write_path_table, write_viewpoints
from planner.report.hull_lines import hull_drawing
from planner.report.numbers import (
    in_sorties,
    length_and_seconds,
    proven_clearance,
    rounded_down,
    summary,
    versions,
)
from planner.report.overview import DrawnFlight, draw_overview
from planner.scene.cloud import PointCloud
from planner.sorties.thought import usable_seconds

if TYPE_CHECKING:
    from planner.planning import Plan

CURVE_POINTS = 24  # drawn on each piece


def save_plan(plan: "Plan", folder: str | Path, *, overwrite: bool = False) -> None:
    """Write the plan folder, whole or not at all.

    Parameters
    ----------
    plan
        The plan.
    folder
        Folder to be made.
    overwrite
        Whether an earlier plan there may be replaced.

    Raises
    ------
    PlannerError
        If the folder cannot be made, or what was written is not proven safe when read back.

    """
    start = time.perf_counter()
    with whole_folder(folder, overwrite=overwrite) as draft:
        _write_numbers(plan, draft)
        _write_flight(plan, draft)
        _write_samples(plan, draft)
        _draw(plan, draft)
        proof = check_folder(draft, sealed=False)
        if not proof.ok:
            raise PlannerError(
                f"{folder}: not written, since its check failed "
                f"({proof.problems[0].replace(f'{draft}{os.sep}', '')}); "
                "please report this with the scene"
            )
        timing = {**plan.timing, "write_and_check": time.perf_counter() - start}
        files = {entry.name: sha256(entry) for entry in sorted(draft.iterdir())}
        report = {**summary(plan), "check": proof.to_dict(), "files": files, "timing": timing}
        write_json(draft / "report.json", report)


def _write_numbers(plan: "Plan", draft: Path) -> None:
    """Settings, place in the world, and airspace."""
    made_with = ", ".join(f"{name} {number}" for name, number in versions().items())
    derived = "".join(
        f"# {rule.name} = {rule.value!r} {rule.unit}: {rule.because}\n" for rule in plan.scale.rules
    )
    (draft / "config.toml").write_text(
        f"# Planned with {made_with}.\n# Lengths that follow when they are not set:\n{derived}\n"
        + plan.config.to_toml(),
        encoding="utf-8",
    )
    frame = plan.scene.frame
    turn = frame.local_from_source
    write_json(
        draft / "scene.json",
        {
            "name": plan.scene.name,
            "source": plan.scene.source and Path(plan.scene.source).name,
            "sha256": plan.scene.sha256,
            "origin": frame.origin.tolist(),
            "crs": frame.crs,
            "vertical_datum": frame.vertical_datum,
            "unit_metres": frame.unit_metres,
            "height_unit_metres": frame.height_unit_metres,
            "up_axis": "z",
            "local_from_source": None if turn is None else turn.tolist(),
        },
    )
    with (draft / "airspace.npz").open("wb") as stream:
        arrays: dict[str, Any] = plan.airspace.to_arrays()
        np.savez_compressed(stream, **arrays)
    if plan.config.airspace.hull != "none":
        save_hull(hull_mesh(plan.airspace), draft / f"hull.{plan.config.airspace.hull}")


def _write_flight(plan: "Plan", draft: Path) -> None:
    """Viewpoints and the curve."""
    path = plan.flight.path
    write_viewpoints(draft / "viewpoints.csv", plan.viewpoints)
    elsewhere = len(plan.viewpoints) - len(plan.flight.viewpoints)
    write_json(
        draft / "path.json",
        {
            "format": "scanwright path",
            "version": 2,
            "motion": plan.timeline.limits.to_record(),
            "d_min": plan.scale.d_min,
            "start": path.start,
            **({ELSEWHERE: elsewhere} if elsewhere else {}),
            "pieces": path.to_records(),
        },
    )
    write_path_table(draft / "path.csv", plan.rows)
    if plan.sorties is not None:
        settings = plan.config.sorties
        most = SortieLimits(usable_seconds(settings), settings.most_waypoints)
        write_sorties(
            draft, plan.sorties.stations, plan.sorties.flown, d_min=plan.scale.d_min, most=most
        )


def _write_samples(plan: "Plan", draft: Path) -> None:
    """Samples with quality and reason, coloured by quality."""
    samples, selection = plan.samples, plan.selection
    import matplotlib as mpl

    colours = (255.0 * mpl.colormaps["RdYlGn"](samples.quality)[:, :3]).round().astype(np.uint8)
    reasons = "; ".join(f"{code} {name}" for code, name in enumerate(selection.reasons))
    write_points(
        draft / "samples.ply",
        samples.xyz,
        normals=samples.normals,
        colours=colours,
        numbers={
            "quality": samples.quality,
            "completeness": samples.completeness,
            "smoothness": samples.smoothness,
            "cluster": samples.cluster,
            "hits": selection.hits,
            "sectors": selection.sectors,
            "reason": selection.reason.astype(np.int64),
        },
        comments=(f"local metres, z up; reason: {reasons}",),
    )


def _draw(plan: "Plan", draft: Path) -> None:
    """Draw the overview."""
    from scipy.spatial import cKDTree

    samples, thinned = plan.samples, plan.surface.thinned
    near = np.asarray(cKDTree(samples.xyz).query(thinned.xyz)[1])
    numbers: dict[str, Any] = summary(plan)
    count, (length, seconds) = len(plan.viewpoints), length_and_seconds(plan)
    reasons = ", ".join(
        f"{name} {count}" for name, count in numbers["viewpoints"]["reasons"].items() if count
    )
    codes = plan.selection.reason
    draw_overview(
        draft / "overview.png",
        title=f"{plan.scene.name}: {count} viewpoint{'' if count == 1 else 's'}, {length:.0f} m, "
        f"{seconds / 60.0:.1f} min" + in_sorties(numbers["sorties"]),
        cloud=PointCloud(
            np.vstack([thinned.xyz, samples.xyz]),
            None if thinned.normals is None else np.vstack([thinned.normals, samples.normals]),
        ),
        quality=np.concatenate([samples.quality[near], samples.quality]),
        radius=samples.radius,
        viewpoints=plan.viewpoints,
        flights=_drawn(plan),
        hull=hull_drawing(plan.airspace, plan.scene.box, _paths(plan), plan.lost),
        uncovered={
            name: samples.xyz[codes == code]
            for code, name in enumerate(plan.selection.reasons)
            if code and (codes == code).any()
        },
        matched=_matched(plan),
        caption=f"{_proven(plan)}samples: {reasons}",
    )


def _proven(plan: "Plan") -> str:
    """Clause on the clearance that is proven; nothing where nothing moves."""
    clearance = proven_clearance(plan)
    if clearance is None:
        return ""
    return (
        f"proven to stay at least {rounded_down(clearance)} m from everything solid"
        + (" or never seen" if plan.config.airspace.unknown == "closed" else "")
        + (" but for take-off and landing" if plan.sorties is not None else "")
        + f" (asked: {rounded_down(plan.scale.d_min)} m); "
    )


def _matched(plan: "Plan") -> Floats:
    """Positions of the photos of the first flight that match with new ones, shape (m, 3)."""
    if plan.scene.images is None:
        return np.zeros((0, 3))
    return plan.scene.images.positions[np.unique(plan.selection.graph.ties[:, 1])]


def _paths(plan: "Plan") -> list[FlightPath]:
    """All curves that are flown, one a sortie if there are any."""
    if plan.sorties is None:
        return [plan.flight.path]
    return [sortie.path for sortie in plan.sorties.flown]


def _drawn(plan: "Plan") -> list[DrawnFlight]:
    """The flight, or the sorties from pad to pad."""
    if plan.sorties is None:
        return [DrawnFlight("path", *_curve(plan.flight.path))]
    flights = []
    for number, sortie in enumerate(plan.sorties.flown, start=1):
        curve, repaired = _curve(sortie.path)
        pad = sortie.station.pad
        label = f"sortie {number}: {len(sortie.photos)} photos, {sortie.duration / 60.0:.1f} min"
        flights.append(
            DrawnFlight(label, np.vstack([pad, curve, pad]), np.r_[False, repaired, False])
        )
    return flights


def _curve(path: FlightPath) -> tuple[Floats, Bools]:
    """Points all along a path, shape (K, 3), and whether each is on a repaired leg."""
    parameter = np.linspace(0.0, 1.0, CURVE_POINTS)
    curve = bezier.evaluate(
        path.controls[:, None], np.broadcast_to(parameter, (len(path), CURVE_POINTS))
    )
    return curve.reshape(-1, 3), np.repeat(path.repaired, CURVE_POINTS)
