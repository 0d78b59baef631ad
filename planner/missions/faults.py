"""What written rows and curves contradict, one sentence a fault."""

from pathlib import Path

import numpy as np

from planner.airspace.field import DistanceField
from planner.airspace.storage import StoredAirspace
from planner.geometry.angles import circular_difference_deg
from planner.geometry.arrays import Floats
from planner.missions.proof import CurveProof, LineProof, prove_distance, prove_lines
from planner.missions.tables import PATH_COLUMNS

SAME_METRES = 1e-3
SAME_SECONDS = 1e-3
SAME_DEGREES = 1e-2
TIGHT = 0.02
"""How tight the bound of the lines from row to row is, as a share of ``d_min``."""

_SAME = np.array([SAME_SECONDS, *[SAME_METRES] * 3, *[SAME_DEGREES] * 2, 0.0])  # by column
_ZONES = "a zone or the ceiling"


def row_faults(
    table: Path, rows: Floats, wanted: Floats, *, first_line: int, source: str
) -> list[str]:
    """Whether each row is what the curve gives; names the first that is not.

    Parameters
    ----------
    table
        File that the rows were read from.
    rows, wanted
        As read and as worked out again, each (n, 7).
    first_line
        Line of the first row.
    source
        File that the curve was read from.

    """
    both = min(len(rows), len(wanted))
    have, want = rows[:both], wanted[:both]
    off = np.abs(have - want)
    off[:, 4] = np.abs(circular_difference_deg(have[:, 4], want[:, 4]))
    wrong = ~(off <= _SAME)
    if wrong.any():
        row = int(np.argmax(wrong.any(axis=1)))
        name = int(np.argmax(wrong[row]))
        return [
            f"{table}: line {row + first_line}: is not what {source} gives ({PATH_COLUMNS[name]} "
            f"{have[row, name]:.10g} where {want[row, name]:.10g} was expected, "
            f"segment {int(want[row, 6])}); a line is missing or changed"
        ]
    if len(rows) != len(wanted):
        return [
            f"{table}: line {both + first_line}: {len(rows)} rows where {source} gives "
            f"{len(wanted)}"
        ]
    return []


def line_faults(
    table: Path, rows: Floats, field: DistanceField, stored: StoredAirspace, *, first_line: int
) -> tuple[LineProof | None, list[str]]:
    """Prove the straight lines from row to row, as they are written, with a sentence a fault."""
    if not len(rows):
        return None, []
    xyz, tolerance = rows[:, 1:4], TIGHT * field.d_min
    solid = prove_lines(xyz, field.clearance, field.d_min, tolerance=tolerance)
    raw = prove_lines(xyz, field.raw_distance, field.d_min, tolerance=tolerance)
    kept = stored.zones.kept
    zones = prove_lines(xyz, stored.zones.distance, kept, tolerance=tolerance)
    faults = [
        f"{table}: line {row + 1 + first_line}: the straight line to it comes within "
        f"{distance:.3f} m of {what}; {needed:.3f} m is asked for"
        for proof, what, needed in (
            (solid, "anything solid", field.d_min),
            (raw, "a point of the coarse model", field.d_min),
            (zones, _ZONES, kept),
        )
        for row, distance in zip(proof.violated, proof.distance, strict=True)
    ]
    return solid, faults


def curve_faults(
    controls: Floats, field: DistanceField, stored: StoredAirspace, *, name: str = "segment"
) -> tuple[CurveProof, CurveProof, CurveProof, list[str]]:
    """Prove a curve against solids, raw points and zones, with a sentence a fault."""
    solid = prove_distance(controls, field.clearance, field.d_min)
    raw = prove_distance(controls, field.raw_distance, field.d_min)
    zones = prove_distance(controls, stored.zones.distance, stored.zones.kept)
    faults = _near(solid, "anything solid", field.d_min, name)
    faults += _near(raw, "a point of the coarse model", field.d_min, name)
    faults += _near(zones, _ZONES, stored.zones.kept, name)
    return solid, raw, zones, faults


def _near(proof: CurveProof, what: str, needed: float, name: str) -> list[str]:
    """One sentence for each piece that comes too near."""
    return [
        f"{name} {piece}: comes within {distance:.3f} m of {what} "
        f"at ({point[0]:.2f}, {point[1]:.2f}, {point[2]:.2f}); {needed:.3f} m is asked for"
        for piece, distance, point in zip(proof.violated, proof.distance, proof.point, strict=True)
    ]
