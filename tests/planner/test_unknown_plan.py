"""A whole plan that keeps away from what was never seen."""

import json

import numpy as np
import pytest

from planner import PlannerError, check_folder, load_config, plan, synthetic_scene
from planner.airspace.airspace import Airspace

SETTINGS = ["scale.radius_share=0.08", "seed=4"]


@pytest.mark.slow
def test_nothing_is_flown_where_the_first_flight_did_not_look(tmp_path):
    scene = synthetic_scene(3, size=(42.0, 40.0), buildings=2, spacing=1.0)
    closing = [*SETTINGS, 'airspace.unknown="closed"', "airspace.seen_within_deg=35"]
    opened, closed = (plan(scene, load_config(None, given)) for given in (SETTINGS, closing))
    d_min, rows = closed.scale.d_min, closed.rows[:, 1:4]
    assert opened.scale.d_min == d_min
    outside = closed.airspace.clearance(opened.rows[:, 1:4]) < d_min
    assert outside.any()  # the setting matters here
    assert closed.airspace.clearance(rows).min() >= d_min
    assert closed.flight.path.clearance.min() >= d_min
    closed.save(tmp_path / "plan")
    assert check_folder(tmp_path / "plan").ok
    report = json.loads((tmp_path / "plan" / "report.json").read_text())
    assert report["airspace"]["unknown"] == "closed"
    with np.load(tmp_path / "plan" / "airspace.npz", allow_pickle=False) as arrays:
        again = Airspace.from_arrays(dict(arrays))
    assert (again.clearance(opened.rows[outside, 1:4]) < d_min).all()


def test_a_take_off_point_in_the_unknown_is_refused_with_what_to_do():
    scene = synthetic_scene(3, size=(42.0, 40.0), buildings=2, spacing=1.0)
    given = [*SETTINGS, "airspace.unknown=closed", "sorties.stations=[[-30.0,-25.0]]"]
    with pytest.raises(PlannerError, match="where the scan has points, or set") as caught:
        plan(scene, load_config(None, given))
    assert "\n" not in str(caught.value)
