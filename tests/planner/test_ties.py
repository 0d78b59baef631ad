"""New photos are tied to those of the first flight by the rule of all links, or say why not."""

import json

import numpy as np
import pytest

from planner import PlannerError, load_config, plan, synthetic_scene
from planner.report.numbers import summary
from planner.scene.cloud import Mesh
from planner.scene.first_flight import NadirFlight
from planner.scene.images import Images
from planner.scene.synthetic import synthetic_block
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.anchors import Anchors
from planner.viewpoints.bridges import connect
from planner.viewpoints.camera import Camera
from planner.viewpoints.frustum import in_frustum
from planner.viewpoints.graph import LinkRule, link
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.ties import Matching, tie, untied
from planner.viewpoints.viewpoints import Viewpoints

CAMERA = Camera(width_px=600, height_px=400, focal_px=400.0)
CASTER = RayCaster(Mesh(np.empty((0, 3)), np.empty((0, 3))))
GROUND = np.stack(np.meshgrid(np.arange(120.0), np.arange(60.0), [0.0]), -1).reshape(-1, 3)
FIELD = SurfaceSamples(GROUND, np.tile([0.0, 0.0, 1.0], (7200, 1)), np.zeros(7200), 1.0)
NONE = np.full(3, np.nan)


def down(x, height=12.0, pitch=-90.0):
    """Photos above the middle line, tops of the pictures to the north."""
    count = len(x)
    places = np.column_stack([x, np.full(count, 30.0), np.broadcast_to(height, count)])
    angles = np.zeros(count), np.broadcast_to(pitch, count)
    return Viewpoints(places, *angles, ("pair",) * count, np.full(count, -1))


def flown(x, height, pitch=-90.0, optics=NONE):
    views = down(np.asarray(x, dtype=float), height, pitch)
    names = tuple(f"first-{row}" for row in range(len(x)))
    return Images(
        views.positions, views.yaw_deg, views.pitch_deg, names, np.tile(optics, (len(x), 1))
    )


def matching(images, ties=3, **rule):
    anchors = Anchors.of(images, FIELD, CASTER, CAMERA, ties=ties)
    return Matching(FIELD, CASTER, CAMERA, anchors, 90.0, LinkRule(**rule))


def grid(*heights):
    axes = np.arange(0.0, 120.0, 4.0), [22.0, 26.0, 30.0, 34.0, 38.0], heights
    return np.stack(np.meshgrid(*axes), -1).reshape(-1, 3)


LINE = np.arange(40.0, 80.0, 4.0)


def test_ties_are_what_brute_force_finds():
    rng = np.random.default_rng(4)
    views = down(rng.uniform(20, 100, 9), rng.uniform(8, 30, 9), rng.uniform(-90, -50, 9))
    images = flown(rng.uniform(20, 100, 6), rng.uniform(15, 60, 6), rng.uniform(-90, -60, 6))
    graph = matching(images).graph(views)
    old = Viewpoints(
        images.positions, images.yaw_deg, images.pitch_deg, ("first",) * 6, np.full(6, -1)
    )

    def shows(photos, row):
        rays = GROUND - photos.positions[row]
        far = np.linalg.norm(rays, axis=1)
        inside = in_frustum(rays, photos.yaw_deg[row], photos.pitch_deg[row], CAMERA)
        seen = inside & (-rays[:, 2] / far >= np.cos(np.radians(85.0)))
        if photos is views:
            seen &= far <= 90.0
        return set(np.flatnonzero(seen)), np.median(far[seen]) if seen.any() else np.inf

    expected = []
    for view in range(9):
        for image in range(6):
            mine, near = shows(views, view)
            theirs, away = shows(old, image)
            smaller = min(len(mine), len(theirs))
            enough = len(mine & theirs) >= max(0.3 * smaller, min(15, 0.5 * smaller), 1)
            alike = views.directions[view] @ old.directions[image] >= np.cos(np.radians(40.0))
            if enough and alike and max(near, away) <= 2.0 * min(near, away):
                expected.append([view, image])
    assert 3 < len(expected) < 54
    assert graph.ties.tolist() == expected


def test_photos_that_match_already_are_left_alone():
    views = down(LINE)
    case = matching(flown([48.0, 56.0, 64.0], 20.0))
    assert case.graph(views).tied == 3
    assert len(tie(views, grid(12.0), case, airspace=None)) == len(views)
    assert untied(views, case.graph(views), case) == ()


@pytest.mark.parametrize(("height", "heights"), [(40.0, [24.0]), (80.0, [24.0, 45.0])])
def test_a_first_flight_high_above_is_reached_by_a_ladder(height, heights):
    views = down(LINE)
    case = matching(flown([50.0, 56.0, 62.0, 68.0], height))
    assert case.graph(views).tied == 0
    got = tie(views, grid(12.0, *heights), case, airspace=None)
    graph = case.graph(got)
    assert graph.tied >= 3
    assert graph.components == 1  # through each rung of the ladder
    added = got.positions[len(views) :]
    assert got.kind[len(views) :] == ("tie",) * len(added)
    assert set(added[:, 2]) == set(heights)
    assert len(added) <= 3 + len(heights)
    places = {tuple(place) for place in grid(12.0, *heights)}
    assert all(tuple(place) in places for place in added)
    whole = connect(
        got, grid(12.0, *heights), FIELD, CASTER, CAMERA, reference=90.0, anchors=case.anchors
    )
    assert case.graph(whole).firm


def test_without_a_free_place_between_the_reason_is_the_scale():
    views = down(LINE)
    case = matching(flown([50.0, 60.0, 70.0], 60.0))
    got = tie(views, grid(12.0), case, airspace=None)
    assert len(got) == len(views)
    (finding,) = untied(got, case.graph(got), case)
    assert finding.code == "first-flight-untied"
    assert finding.number == 0
    assert not finding.partial
    ratio = float(finding.message.split("scale ratio ")[1].split(" > 2")[0])
    assert ratio == pytest.approx(60.0 / 12.0, rel=0.1)
    assert "airspace.beyond" in finding.message
    assert "axes" not in finding.message


def test_a_first_flight_that_looks_another_way_is_told_by_its_angle():
    views = down(LINE)
    case = matching(flown([60.0], 12.0, pitch=-45.0))
    (finding,) = untied(views, case.graph(views), case)
    assert "0 of 3 wanted photos" in finding.message
    assert "axes 45.0 > 40 degrees apart" in finding.message
    assert "airspace.beyond" not in finding.message
    nowhere = matching(flown([60.0], 12.0, pitch=30.0))
    (finding,) = untied(views, nowhere.graph(views), nowhere)
    assert "show nothing that new ones show" in finding.message


def test_scale_is_that_of_pixels_where_the_first_camera_is_another_one():
    views = down(LINE)
    far = flown([50.0, 56.0, 62.0], 48.0)
    assert matching(far).graph(views).tied == 0
    long_lens = flown([50.0, 56.0, 62.0], 48.0, optics=(2400.0, 1600.0, 1600.0))
    assert matching(long_lens).graph(views).tied == 3


def test_links_to_the_first_flight_count_as_links():
    views = down([60.0, 64.0])
    alone = link(views, FIELD, CASTER, CAMERA, reference=90.0)
    case = matching(flown([56.0, 60.0, 64.0], 20.0))
    assert (case.graph(views).degree == alone.degree + 3).all()
    assert case.graph(views).edges.tolist() == alone.edges.tolist()


def test_no_more_ties_are_asked_for_than_there_are_photos_that_show_anything():
    images = flown([60.0, 64.0, 900.0], 20.0)
    assert matching(images).anchors.wanted == 2
    assert Anchors.of(images, FIELD, CASTER, CAMERA, ties=0) is None
    assert Anchors.of(None, FIELD, CASTER, CAMERA, ties=3) is None


def test_the_simulated_flight_knows_its_photos():
    block = synthetic_block(3, size=(45.0, 40.0), buildings=3, spacing=1.0)
    scene = synthetic_scene(3, size=(45.0, 40.0), buildings=3, spacing=1.0, images=True)
    images = scene.images
    np.testing.assert_array_equal(images.positions, block.cameras)
    assert (images.pitch_deg == -90.0).all()
    width, height, focal = images.optics[0]
    camera = Camera(width_px=int(width), height_px=int(height), focal_px=focal)
    across, along = block.flight.half_angles_deg[1], block.flight.half_angles_deg[0]
    assert np.degrees(camera.horizontal_fov) == pytest.approx(2 * across, abs=0.01)
    assert np.degrees(camera.vertical_fov) == pytest.approx(2 * along, abs=0.01)
    rays = block.truth - images.positions[np.asarray(_owners(block))]
    assert in_frustum(rays, images.yaw_deg[0], -90.0, camera).mean() > 0.99


def _owners(block):
    """Camera that each point was measured by: the points come camera by camera."""
    ray = block.cloud.xyz - block.truth
    far = np.linalg.norm(ray, axis=1) > 1e-3
    owners = np.zeros(len(ray), dtype=int)
    for row in np.flatnonzero(far):  # noise lies along the ray
        to = block.truth[row] - block.cameras
        off = np.linalg.norm(np.cross(to, ray[row]), axis=1) / np.linalg.norm(to, axis=1)
        owners[row] = np.argmin(off)
    owners[~far] = np.argmin(
        np.linalg.norm(block.truth[~far, None, :2] - block.cameras[None, :, :2], axis=2), axis=1
    )
    return owners


SETTINGS = ["scale.radius_share=0.045", "seed=4", "viewpoints.iterations=60"]


@pytest.mark.slow
def test_a_plan_is_tied_through_the_air_above_it_and_says_so(tmp_path):
    options = {"size": (45.0, 40.0), "buildings": 3, "spacing": 0.8}
    scene = synthetic_scene(3, images=True, flight=NadirFlight(height=220.0), **options)
    low = plan(scene, load_config(None, SETTINGS))
    assert "first-flight-untied" in [finding.code for finding in low.findings]
    high = plan(scene, load_config(None, [*SETTINGS, "airspace.beyond=110.0"]))
    graph = high.selection.graph
    assert graph.tied >= 3
    assert graph.firm
    assert high.viewpoints.kind.count("tie") >= 1
    assert "first-flight-untied" not in [finding.code for finding in high.findings]
    numbers = json.loads(json.dumps(summary(high)))["viewpoints"]
    assert numbers["first_flight"]["matched"] == graph.tied
    assert numbers["kinds"]["tie"] == high.viewpoints.kind.count("tie")
    with pytest.raises(PlannerError, match=r"budget = 1: .* has \d; .* viewpoints\.ties = 0"):
        plan(scene, load_config(None, [*SETTINGS, "airspace.beyond=110.0", "viewpoints.budget=1"]))
    high.save(tmp_path / "plan")  # proven safe, beyond where photos are taken from


@pytest.mark.slow
def test_poses_in_a_file_give_the_plan_of_poses_in_memory(tmp_path):
    options = {"size": (45.0, 40.0), "buildings": 3, "spacing": 0.8}
    bare, known = synthetic_scene(3, **options), synthetic_scene(3, images=True, **options)
    images = known.images
    rows = np.column_stack([images.positions, images.yaw_deg, images.pitch_deg, images.optics])
    lines = [",".join(f"{value:.6f}" for value in row) for row in rows]
    head = "x,y,z,yaw_deg,pitch_deg,width_px,height_px,focal_px"
    (tmp_path / "poses.csv").write_text("\n".join([head, *lines]))
    file = f"scene.images={tmp_path / 'poses.csv'}"
    read, kept = (
        plan(scene, load_config(None, settings))
        for scene, settings in ((bare, [*SETTINGS, file]), (known, SETTINGS))
    )
    assert read.viewpoints.positions.tolist() == kept.viewpoints.positions.tolist()
    assert read.selection.graph.ties.tolist() == kept.selection.graph.ties.tolist()
