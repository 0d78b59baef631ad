"""The protocol that photos are judged by: every number by another way, on small cases."""

import importlib.util
import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from planner.config import Config, ScaleSettings
from planner.evaluation.place import coarser, fresh_samples, prepare
from planner.evaluation.reachable import DIRECTIONS, evaluation_grid, in_any_picture, reachable
from planner.evaluation.sightings import Sightings
from planner.evaluation.views import closed_tour, measure_views, shaken, trial
from planner.scene.cloud import Mesh
from planner.scene.synthetic import synthetic_scene
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.camera import Camera
from planner.viewpoints.candidates import aim_directions
from planner.viewpoints.frustum import in_frustum
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.reconstructability import parallax_weight, reconstructability
from planner.viewpoints.viewpoints import Viewpoints

CAMERA = Camera(width_px=600, height_px=400, focal_px=400.0)
PAGE = Path(__file__).parents[2] / "docs" / "comparisons" / "views.py"


@pytest.fixture(scope="module")
def page():
    spec = importlib.util.spec_from_file_location("views", PAGE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def place():
    scene = synthetic_scene(3, size=(40.0, 40.0), buildings=2, trees=False, bridge=False)
    scale = ScaleSettings(radius=3.0, gsd=0.01, d_min=4.0)
    return prepare(scene, Config(scale=scale))


@pytest.fixture(scope="module")
def case(place):
    return trial(place)


def sightings(rays, sample, size):
    rays = np.array(rays, dtype=float)
    distance = np.linalg.norm(rays, axis=1)
    unit = rays / distance[:, None]
    return Sightings(size, np.array(sample), unit, distance, unit[:, 2])


def at(*degrees, distance=10.0):
    """Rays in the x-z plane, so many degrees from the vertical."""
    angle = np.radians(degrees)
    return distance * np.column_stack([np.sin(angle), 0.0 * angle, np.cos(angle)])


@pytest.mark.parametrize(
    ("degrees", "good"),
    [
        ((0, 10, 40), True),  # 10 degrees apart
        ((0, 10), False),  # two photos
        ((0, 4, 8), True),  # 8 degrees between the outer ones
        ((0, 2, 4), False),
        ((-60, 0, 60), False),  # 60 degrees apart
        ((0, 15, 75), False),  # the third beyond 70 degrees
        ((-35, 0, 35), False),  # 35 degrees
        ((0, 29, 69), True),
    ],
)
def test_three_photos_at_a_useful_angle_match(degrees, good):
    assert sightings(at(*degrees), [0] * len(degrees), 2).matchable().tolist() == [good, False]


def test_nearest_photo_that_faces_the_sample():
    rays = np.vstack([at(75, distance=4.0), at(60, distance=6.0), at(0, distance=9.0)])
    distance, stretched = sightings(rays, [1, 1, 1], 3).nearest()
    np.testing.assert_allclose(distance, [np.inf, 6.0, np.inf])
    np.testing.assert_allclose(stretched, [np.inf, 12.0, np.inf])


def test_directions_of_the_grid_hold_what_any_of_their_pictures_holds():
    rays = np.random.default_rng(0).normal(size=(500, 3))
    yaw, pitch = aim_directions(DIRECTIONS, CAMERA)
    each = [in_frustum(rays, y, p, CAMERA) for y, p in zip(yaw, pitch, strict=True)]
    np.testing.assert_array_equal(in_any_picture(rays, CAMERA), np.any(each, axis=0))


def test_a_sample_is_reachable_if_all_positions_together_suffice(place):
    """Brute force over all pairs of positions, without the table."""
    samples, few = place.samples, evaluation_grid(place)[::7]
    got = reachable(place, samples, positions=few)
    yaw, pitch = aim_directions(DIRECTIONS, place.camera)
    blocked = RayCaster(place.surface.mesh).blocked
    lifted = RayCaster(place.surface.mesh).lift(samples.xyz, samples.normals, radius=samples.radius)
    for s in range(0, len(samples), 29):
        rays = few - samples.xyz[s]
        length = np.linalg.norm(rays, axis=1)
        cosine = rays @ samples.normals[s] / length
        starts = np.tile(lifted[s], (len(few), 1))
        seen = (length <= place.reference) & (cosine >= np.cos(np.radians(85.0)))
        seen &= ~blocked(starts, few.astype(np.float32))
        seen &= [in_frustum(-ray, yaw, pitch, place.camera).any() for ray in rays]
        h = 0.0
        for i, j in itertools.combinations(np.flatnonzero(seen), 2):
            angle = np.arccos(np.clip(rays[i] @ rays[j] / length[i] / length[j], -1, 1))
            near = 1 - max(length[i], length[j]) / place.reference
            h += float(parallax_weight(angle)) * near * min(cosine[i], cosine[j])
        assert got[s] == (h >= 3.0) or h == pytest.approx(3.0, abs=1e-3)


def test_a_roof_is_reachable_and_what_is_under_it_is_not(place):
    top = place.scene.box.centre + [0, 0, 0.5 * place.scene.box.size[2] + 3.0]
    corners = top + 15.0 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    lid = Mesh(corners, [[0, 1, 2], [0, 2, 3]])
    covered = replace(place, surface=replace(place.surface, mesh=lid))
    up = np.array([[0.0, 0.0, 1.0]] * 2)
    ends = SurfaceSamples([top + [0, 0, 0.01], top - [0, 0, 1.0]], up, [0, 0], 1.0)
    above = top + np.array([[x, y, 12.0] for x in (-6, -2, 2, 6) for y in (-6, -2, 2, 6)])
    assert reachable(covered, ends, positions=above).tolist() == [True, False]


def test_fresh_samples_lie_on_the_same_surface_and_are_none_of_the_old(place, case):
    again = fresh_samples(place)
    np.testing.assert_array_equal(again.xyz, case.fresh.xyz)
    gaps = np.linalg.norm(case.fresh.xyz[:, None] - place.samples.xyz[None], axis=2).min(axis=1)
    assert gaps.min() > 0.0
    assert gaps.max() < 2.0 * place.scale.radius
    assert len(case.fresh) == pytest.approx(len(place.samples), rel=0.1)
    assert case.reachable.mean() == pytest.approx(case.fresh_reachable.mean(), abs=0.05)


def test_a_coarser_place_has_fewer_samples_and_positions_and_the_same_limits(place):
    wide = coarser(place, 1.5)
    assert len(wide.samples) < 0.6 * len(place.samples)
    assert len(wide.positions) < 0.5 * len(place.positions)
    assert wide.scale is place.scale


def test_noise_has_the_size_it_says_and_repeats():
    many = np.zeros(20_000)
    views = Viewpoints(np.zeros((20_000, 3)), many, many - 45, ("x",) * 20_000, many - 1)
    moved = shaken(views, 0)
    np.testing.assert_allclose(moved.positions.std(axis=0), 0.5, rtol=0.03)
    np.testing.assert_allclose([moved.yaw_deg.std(), moved.pitch_deg.std()], 2.0, rtol=0.03)
    np.testing.assert_array_equal(moved.positions, shaken(views, 0).positions)
    assert not np.array_equal(moved.positions, shaken(views, 1).positions)


def test_a_tour_around_a_circle_is_as_long_as_its_polygon():
    angle = np.random.default_rng(0).permutation(np.linspace(0, 2 * np.pi, 12, endpoint=False))
    ring = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    assert closed_tour(ring) == pytest.approx(12 * 2 * np.sin(np.pi / 12))
    assert closed_tour(ring[:1]) == 0.0


def test_measures_of_chosen_photos_are_those_of_fresh_rays(page, case):
    place = case.place
    chosen = page.choose(place, {"preset": "cover", "objective": "hits"})
    got = measure_views(case, chosen, seconds=1.5)
    caster = RayCaster(place.surface.mesh)
    h = reconstructability(
        *(chosen.viewpoints, case.fresh, caster, place.camera), reference=place.reference
    )
    assert got.share == pytest.approx(np.mean(h[case.fresh_reachable] >= 3.0))
    assert got.better == pytest.approx(np.mean(h[case.fresh_reachable] >= 4.0))
    planned = chosen.reconstructability[case.reachable] >= 3.0
    assert got.planned == pytest.approx(planned.mean())
    assert got.views == len(chosen.viewpoints)
    assert got.seconds == 1.5
    assert got.components == 1
    assert got.least_degree == chosen.graph.degree.min()
    assert got.tour <= sum(
        np.linalg.norm(np.diff(chosen.viewpoints.positions, axis=0, append=0), axis=1)
    )
    assert 0.0 <= got.noisy_better <= got.noisy <= 1.0
    assert got.gsd <= got.coarse_gsd


@pytest.mark.slow
def test_the_comparison_prints_a_line_for_every_preset(page, place, monkeypatch, capsys):
    assert set(page.PRESETS) >= {"smith", "paper low", "paper high", "quick", "standard", "best"}
    presets = ["smith", "paper low", "paper high", "quick"]
    given = ["--scenes", page.BENCHMARK, "--presets", *presets, "--views", "30"]
    monkeypatch.setattr("sys.argv", ["views.py", ".", *given, "--set", "iterations=5"])
    monkeypatch.setattr(page, "load", lambda *_: place)
    page.main()
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("|")]
    assert [line.split(" | ")[0] for line in lines[2:]] == [f"| {name}" for name in presets]
    assert len({line.count("|") for line in lines}) == 1
    assert lines[2].split(" | ")[1] == "30"
    assert not [line for line in lines if "nan" in line]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["lyon_church_vaulx.ply", "3dbag_thehague_block.ply"])
def test_photos_of_real_places_link_into_one_model_and_hold_on_fresh_samples(
    page, shared_data, name
):
    case = trial(page.load(name, shared_data / "scenes" / "meshes"))
    chosen = page.choose(case.place, {**page.PRESETS["quick"], "iterations": 20})
    got = measure_views(case, chosen, seconds=0.0)
    assert chosen.graph.firm
    assert got.components == 1
    assert got.least_degree >= 3
    assert got.share == pytest.approx(got.planned, abs=0.02)
    assert np.isin(chosen.reason, np.arange(len(chosen.reasons))).all()
