"""The simulated first flight on places small enough to reason about."""

import numpy as np
import pytest

from planner.scene.cloud import Mesh
from planner.scene.first_flight import MOST_SIGMAS, NadirFlight, fly_first
from planner.scene.town.solids import Footprint, box, loft
from planner.scene.town.terrain import random_relief, sheet

FLAT, _ = sheet((60.0, 50.0), random_relief(0.0, np.random.default_rng(0)), [])


def together(*parts):
    first = np.cumsum([0, *(len(part.vertices) for part in parts)])
    return Mesh(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([part.triangles + at for part, at in zip(parts, first, strict=False)]),
    )


def within(points, low, high):
    return ((points >= low) & (points <= high)).all(axis=1)


def test_open_ground_gets_one_point_a_spacing_squared_everywhere():
    flown = fly_first(together(FLAT), NadirFlight(), spacing=0.5, heading=0.0, seed=1)
    assert len(flown.xyz) == pytest.approx(60 * 50 / 0.25, rel=0.03)
    counts, _, _ = np.histogram2d(
        flown.surface[:, 0], flown.surface[:, 1], bins=(12, 10), range=((-30, 30), (-25, 25))
    )
    assert counts.min() > 60  # 100 expected in each 5 m x 5 m


def test_noise_grows_with_the_cube_of_the_distance_over_flat_ground():
    """There cos(incidence) = depth / distance, so that (d / depth)^2 / cos = (d / depth)^3."""
    flight = NadirFlight(height=50.0, noise=0.1)
    flown = fly_first(together(FLAT), flight, spacing=0.5, heading=0.4, seed=2)
    far = np.linalg.norm(flown.surface - flown.cameras[flown.camera], axis=1)
    np.testing.assert_allclose(flown.sigma, 0.1 * (far / 50.0) ** 3, rtol=1e-9)
    error = flown.xyz - flown.surface
    size = np.linalg.norm(error, axis=1)
    assert (size <= MOST_SIGMAS * flown.sigma + 1e-12).all()
    assert np.std(size / flown.sigma * np.sign(error[:, 2])) == pytest.approx(0.987, abs=0.02)
    ray = (flown.surface - flown.cameras[flown.camera]) / far[:, None]
    np.testing.assert_allclose(np.abs((error * ray).sum(axis=1)), size, atol=1e-9)


def test_without_noise_every_point_lies_on_the_mesh():
    flown = fly_first(together(FLAT), NadirFlight(noise=0.0), spacing=1.0, heading=0.0, seed=0)
    np.testing.assert_allclose(flown.xyz[:, 2], 0.0, atol=1e-12)
    np.testing.assert_array_equal(flown.xyz, flown.surface)


def test_nothing_under_a_wide_roof_in_the_air_is_seen():
    table = box(Footprint(0.0, 0.0, 12.0, 12.0), 4.0, 4.5)
    flown = fly_first(together(FLAT, table), NadirFlight(), spacing=0.5, heading=0.0, seed=0)
    hidden = within(flown.surface, [-6, -6, -1], [6, 6, 4.2])
    assert hidden.sum() == 0
    assert within(flown.surface, [-6, -6, 4.3], [6, 6, 5]).sum() > 400


def test_walls_get_fewer_points_than_roofs_and_a_narrow_street_has_none_low_down():
    """A street of 3 m between walls of 20 m shows its floor only from within 9 degrees of nadir."""
    left, right = (box(Footprint(x, 0.0, 8.0, 20.0), -1.0, 20.0) for x in (-9.5, 9.5))
    flown = fly_first(together(FLAT, left, right), NadirFlight(), spacing=0.4, heading=0.0, seed=0)
    xyz = flown.surface
    roof = within(xyz, [-17.4, -19.9, 19.99], [-1.6, 19.9, 20.1]).sum() / (15.8 * 39.8)
    outer = within(xyz, [-17.51, -19.9, 0.5], [-17.49, 19.9, 19.5]).sum() / (39.8 * 19.0)
    low = within(xyz, [-1.51, -19.9, 0.2], [1.51, 19.9, 10.0])
    walls = low & (np.abs(np.abs(xyz[:, 0]) - 1.5) < 0.01)
    assert 0.0 < outer < 0.7 * roof
    assert walls.sum() == 0


def test_steeper_than_the_limit_is_not_matched():
    """A needle of 85 degrees is too steep from straight above, but not from the side."""
    cone = loft([Footprint(0, 0, 4, 4).corners()], [-0.5], apex=np.array([[0, 0, 30.0]]))
    steep = 75.0
    flight = NadirFlight(max_incidence_deg=steep)
    mesh = together(FLAT, cone)
    flown = fly_first(mesh, flight, spacing=0.5, heading=0.0, seed=0)
    a, b, c = np.moveaxis(mesh.vertices[mesh.triangles[flown.triangles]], 1, 0)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    ray = flown.cameras[flown.camera] - flown.surface
    cosine = (ray * normal).sum(axis=1) / np.linalg.norm(ray, axis=1)
    assert cosine.min() >= np.cos(np.radians(steep)) - 1e-6


def test_more_views_demanded_never_gives_more_points():
    tower = box(Footprint(5.0, 5.0, 6.0, 6.0), -1.0, 35.0)
    counts = [
        len(
            fly_first(
                together(FLAT, tower), NadirFlight(views=views), spacing=1.0, heading=0.0, seed=0
            ).xyz
        )
        for views in (1, 2, 3, 5, 9)
    ]
    assert counts == sorted(counts, reverse=True)
    assert counts[0] > counts[-1]


def test_heading_turns_the_lines_of_the_flight():
    flown = fly_first(together(FLAT), NadirFlight(), spacing=2.0, heading=0.3, seed=0)
    c, s = np.cos(0.3), np.sin(0.3)
    across = flown.cameras[:, :2] @ np.array([-s, c])
    assert len(np.unique(np.round(across, 6))) < len(flown.cameras) / 3
