"""What the flight keeps beyond d_min: every photo is put where that is kept, however much it is."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner import load_config, plan, synthetic_scene
from planner.viewpoints.free_balls import free_balls

BLOCK = np.array([[-6.0, -5.0, 0.0], [6.0, 5.0, 9.0]])


def kept(space, places, margin):
    """Whether the flight takes these places, (m, 3), as they are rounded."""
    at = np.round(places, 4)
    return (space.clearance(at) >= space.d_min + margin) & (space.zone_margin(at) >= margin)


@given(st.integers(0, 10_000), st.floats(0.001, 3.0))
@settings(max_examples=25, deadline=None)
def test_whatever_is_moved_into_the_balls_can_be_flown_to(solids, seed, margin):
    space = solids([BLOCK], ground=0.0, d_min=3.0, ceiling=22.0)
    low, high = (-18.0, -18.0, 3.0), (18.0, 18.0, 22.0)
    rng = np.random.default_rng(seed)
    centres = rng.uniform(low, high, (500, 3))
    centres = centres[kept(space, centres, margin + 3e-3)]
    balls = free_balls(centres, space, margin=margin)
    moved = balls.nearest(rng.uniform((-25, -25, -5), (25, 25, 30), (200, 3)))
    assert balls.radii.max() > 0.0
    assert kept(space, moved, margin).all()


@pytest.mark.slow
@pytest.mark.parametrize("preset", ["cover", "smith"])
def test_a_wide_margin_costs_no_photo(preset):
    zone = "airspace.zones=[{polygon=[[-3,-300],[3,-300],[3,300],[-3,300]],top=14}]"
    given = ["scale.radius_share=0.08", "viewpoints.iterations=40", "airspace.ceiling=25", zone]
    scene = synthetic_scene(3, size=(42.0, 40.0), buildings=2, spacing=1.0)
    found = plan(
        scene, load_config(None, [*given, f"viewpoints.preset={preset}", "flight.margin=1.0"])
    )
    assert len(found.viewpoints) > 5
    assert not len(found.lost)
    assert not [f for f in found.findings if f.code == "viewpoint-dropped"]
