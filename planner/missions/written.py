"""A written plan, read back for whatever comes after planning."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from planner.airspace.airspace import Airspace
from planner.config import Config
from planner.errors import PlannerError
from planner.flight.limits import Limits
from planner.flight.path import FlightPath
from planner.geometry.arrays import Floats
from planner.geometry.frames import Frame
from planner.missions.check import read_arrays_file, read_config, read_path_file
from planner.missions.records import read_json
from planner.missions.tables import read_path_table, read_viewpoints
from planner.viewpoints.viewpoints import Viewpoints


@dataclass(frozen=True, slots=True, eq=False)
class WrittenPlan:
    """What a plan folder holds.

    Parameters
    ----------
    name
        Name of the scene.
    config
        Settings that it was planned with.
    frame
        Where the local frame lies in the world.
    viewpoints
        In visiting order.
    path
        The certified curve.
    limits
        Limits of motion that it is timed by.
    rows
        ``path.csv``, shape (n, 7): t, x, y, z, yaw, pitch, piece.
    airspace
        Solids, ground and zones.
    report
        Every number of the report.

    """

    name: str
    config: Config
    frame: Frame
    viewpoints: Viewpoints
    path: FlightPath
    limits: Limits
    rows: Floats
    airspace: Airspace
    report: dict[str, Any]


def load_plan(folder: str | Path) -> WrittenPlan:
    """Read a plan folder; proving it again is the business of ``check_folder``.

    Parameters
    ----------
    folder
        Folder that ``Plan.save`` wrote.

    Returns
    -------
    plan
        Its contents.

    Raises
    ------
    PlannerError
        If a file is missing, truncated or malformed; the message names it.

    """
    folder = Path(folder)
    if not folder.is_dir():
        raise PlannerError(f"{folder}: is no folder; name the folder of a plan")
    path, limits = read_path_file(folder / "path.json")
    arrays = folder / "airspace.npz"
    record = read_json(folder / "scene.json")
    try:
        upward = record.get("height_unit_metres")  # plans of earlier versions do not have it
        frame = Frame(
            record["origin"],
            record["crs"],
            record["vertical_datum"],
            float(record["unit_metres"]),
            record["local_from_source"],
            None if upward is None else float(upward),
        )
        name = str(record["name"])
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise PlannerError(f"{folder / 'scene.json'}: {error!r}; plan again") from None
    return WrittenPlan(
        name=name,
        config=read_config(folder / "config.toml"),
        frame=frame,
        viewpoints=read_viewpoints(folder / "viewpoints.csv"),
        path=path,
        limits=limits,
        rows=read_path_table(folder / "path.csv"),
        airspace=Airspace.from_arrays(read_arrays_file(arrays), name=str(arrays)),
        report=read_json(folder / "report.json"),
    )
