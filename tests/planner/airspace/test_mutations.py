"""The proofs are broken on purpose, one way at a time; each time this very check must notice."""

import numpy as np
import pytest

from planner.airspace import solids as solids_module
from planner.airspace.airspace import Airspace, build_airspace
from planner.airspace.collision import Triangles
from planner.airspace.field import DistanceField
from planner.airspace.obstacles import Points
from planner.airspace.occupancy import Occupancy
from planner.airspace.terrain import Terrain
from planner.airspace.zones import Zones
from planner.config import AirspaceSettings, ZoneSettings
from planner.scene.cloud import Mesh

BLOCKS = [((-14, -14, 0), (-2, -2, 14)), ((4, -12, 0), (12, -2, 7)), ((2, 6, 9), (16, 10, 10))]
MAST = np.column_stack([np.full(60, -10.0), np.full(60, 10.0), np.linspace(0, 14, 60)])


def town(make):
    zone = ZoneSettings(polygon=((8, 12), (19, 12), (19, 19), (8, 19)), top=12.0)
    hall = make.sheet((-18, -2), (-4, 4), 11.0)  # a roof without walls
    return build_airspace(
        make.scene(MAST),
        make.join(make.boxes(BLOCKS), hall),
        d_min=2.0,
        d_max=15.0,
        settings=AirspaceSettings(zones=(zone,), ceiling=25.0),
    )


def prove(airspace, solids):
    """No free point or edge of many comes too near to anything; and some are free."""
    blocks = [*BLOCKS, ((-17.6, -1.6, 0), (-4.4, 3.6, 11))]
    exact, rng = solids(blocks, ground=0.0), np.random.default_rng(0)

    def least(points):
        mast = np.linalg.norm(points[:, None] - MAST, axis=2).min(axis=1)
        inside = ((points[:, :2] > [8, 12]) & (points[:, :2] < [19, 19])).all(axis=1)
        barred = (inside & (points[:, 2] < 12)) | (points[:, 2] > 25)
        return np.where(barred, -1.0, np.minimum(exact.clearance(points), mast))

    points = rng.uniform((-24, -24, -3), (24, 24, 27), (4000, 3))
    middles = [[-8, -8, 7.0], [-8, -8, 5.0], [-11, 1, 5.5]]  # farther than d_min from all surfaces
    points = np.concatenate([points, middles])
    free = airspace.is_free(points)
    assert least(points[free]).min() >= 2.0
    assert free.sum() > 500
    edges = 0
    starts = np.concatenate([points[free][:120], middles])
    ends = np.concatenate([points[free][120:240], middles])
    for a, b in zip(starts, ends, strict=True):
        if airspace.edge_is_free(a, b):
            edges += 1
            assert least(a + np.linspace(0, 1, 200)[:, None] * (b - a)).min() >= 2.0
    assert edges > 15
    field = DistanceField.from_arrays(airspace.to_arrays())
    clear = np.linalg.norm(points[:, None] - MAST, axis=2).min(axis=1)
    truth = np.minimum(exact.clearance(points), clear)
    assert (field.lower_bound(points) <= truth.clip(-np.inf) + 0.4).all()  # curtains are off a bit
    assert (field.clearance(points)[truth < -0.5] < 0).all()


def everywhere(points):
    return np.ones(len(points), bool)


MUTATIONS = {
    "the grid calls everything sky": (
        Occupancy,
        "is_sky",
        lambda _self, points: (everywhere(points), everywhere(points)),
    ),
    "the side is ignored": (Airspace, "_is_sky", lambda _self, points: everywhere(points)),
    "doubtful places are outside": (Airspace, "_walk_reaches_sky", lambda _self, _point: True),
    "FCL's distances are too large": (
        Triangles,
        "distance",
        lambda self, points, old=Triangles.distance: 1.1 * old(self, points),
    ),
    "sweeps are always clear": (Triangles, "capsule_is_clear", lambda *_: True),
    "sweeps are too thin": (
        Triangles,
        "capsule_is_clear",
        lambda self, a, b, r, old=Triangles.capsule_is_clear: old(self, a, b, 0.9 * r),
    ),
    "points are forgotten": (
        Points,
        "distance",
        lambda _self, points: np.full(len(points), np.inf),
    ),
    "sweeps forget the points": (Points, "capsule_is_clear", lambda *_: True),
    "zones are forgotten": (Zones, "margin", lambda _self, points: np.full(len(points), np.inf)),
    "edges forget the zones": (Zones, "margin_at_least", lambda *_: True),
    "the ground is far below": (
        Terrain,
        "mesh",
        lambda self, low, high, old=Terrain.mesh: Mesh(
            old(self, low, high).vertices - [0, 0, 3], old(self, low, high).triangles
        ),
    ),
    "roofs without walls stay open": (
        solids_module,
        "occupancy",
        lambda *args, old=solids_module.occupancy, **options: old(
            *args, **{**options, "under_roofs": False}
        ),
    ),
}


def test_the_airspace_as_it_is_passes(make, solids):
    prove(town(make), solids)


@pytest.mark.parametrize("name", MUTATIONS)
def test_a_broken_airspace_is_noticed(make, solids, monkeypatch, name):
    where, what, instead = MUTATIONS[name]
    monkeypatch.setattr(where, what, instead)
    with pytest.raises(AssertionError):
        prove(town(make), solids)
