"""Real scans and models, of every kind that people have, plan without any setting."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from planner import PlanStatus, plan
from planner.geometry import bezier
from planner.missions.records import read_json

SCENES = [
    "pointclouds/toronto_city_hall.laz",
    "pointclouds/delft_ahn3_part1.laz",
    "pointclouds/brighton_beach_odm.laz",
    "pointclouds/city3d_building_001.ply",
    "meshes/3dbag_thehague_block.ply",
    "meshes/lyon_church_vaulx.ply",
    "meshes/rotterdam_block_220m.ply",
    "planner_scenes/fcplanner_MBS.pcd",
    "planner_scenes/sip_BigBen.stl",
]


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_a_real_scene_plans_without_any_setting(shared_data, tmp_path, name):
    result = plan(shared_data / "scenes" / name)
    assert result.status is PlanStatus.COMPLETE, result.findings
    result.save(tmp_path / "plan")  # proves the written files, or raises
    report = read_json(tmp_path / "plan" / "report.json")
    assert report["check"]["ok"]
    # a third witness: no raw point within d_min of a dense sampling of the curve
    steps = np.linspace(0.0, 1.0, 200)
    controls = result.flight.path.controls
    dense = bezier.evaluate(controls[:, None], np.broadcast_to(steps, (len(controls), 200)))
    nearest, _ = cKDTree(result.scene.cloud.xyz).query(dense.reshape(-1, 3))
    assert nearest.min() >= result.scale.d_min
    covered = report["viewpoints"]["reasons"]["covered"]
    assert covered >= 0.95 * report["surface"]["samples"]
