"""Solids whose distances are known exactly, to hold the flight against."""

import numpy as np
import pytest

from planner.viewpoints.viewpoints import Viewpoints


class Solids:
    """An airspace of boxes, balls and level ground with closed formulas for every distance."""

    def __init__(self, boxes=(), balls=(), *, ground=None, ceiling=np.inf, d_min=2.0, bounds=None):
        self.boxes = np.array(boxes, dtype=float).reshape(-1, 2, 3)
        self.balls = np.array(balls, dtype=float).reshape(-1, 4)
        self.ground, self.ceiling, self.d_min = ground, ceiling, d_min
        low, high = bounds or ((-500, -500, -100), (500, 500, 500))
        self.bounds = np.array(low, dtype=float), np.array(high, dtype=float)

    def clearance(self, points):
        points = np.asarray(points, dtype=float)
        near = np.full(len(points), np.inf)
        for low, high in self.boxes:
            out = np.maximum(low - points, points - high)
            outside = np.linalg.norm(out.clip(0.0), axis=1)
            near = np.minimum(near, np.where(outside > 0, outside, out.max(axis=1)))
        for *centre, radius in self.balls:
            near = np.minimum(near, np.linalg.norm(points - centre, axis=1) - radius)
        return near if self.ground is None else np.minimum(near, points[:, 2] - self.ground)

    def clearance_range(self, points):
        clearance = self.clearance(points)
        return clearance, clearance

    def zone_margin(self, points):
        return self.ceiling - np.asarray(points)[:, 2]

    def is_free(self, points):
        return (self.clearance(points) >= self.d_min) & (self.zone_margin(points) >= 0.0)

    def capsule_clearance_at_least(self, a, b, radius):
        return bool(self.segment_distance(np.asarray(a), np.asarray(b)) >= radius + 1e-9)

    def zone_margin_at_least(self, a, b, margin):
        return bool(self.ceiling - max(a[2], b[2]) >= margin)

    def segment_distance(self, a, b):
        """Exact distance of the segment to the solids, 0 where it touches one."""
        near = np.inf if self.ground is None else min(a[2], b[2]) - self.ground
        step = b - a
        for low, high in self.boxes:  # the slope of the squared distance is piecewise linear
            with np.errstate(divide="ignore", invalid="ignore"):
                crossings = np.concatenate([(low - a) / step, (high - a) / step])
            inner = crossings[np.isfinite(crossings) & (crossings > 0) & (crossings < 1)]
            at = np.sort(np.concatenate([[0.0, 1.0], inner]))
            place = a + at[:, None] * step
            excess = (place - high).clip(0.0) - (low - place).clip(0.0)
            slope = excess @ step
            k = int(np.searchsorted(slope > 0, True))  # first breakpoint where it rises
            best = at[min(k, len(at) - 1)]
            if 0 < k < len(at) and slope[k] > slope[k - 1]:
                best = at[k - 1] - slope[k - 1] * (at[k] - at[k - 1]) / (slope[k] - slope[k - 1])
            place = a + best * step
            gap = (place - high).clip(0.0) - (low - place).clip(0.0)
            near = min(near, float(np.linalg.norm(gap)))
        for *centre, radius in self.balls:
            along = np.clip((centre - a) @ step / max(float(step @ step), 1e-300), 0.0, 1.0)
            near = min(near, float(np.linalg.norm(a + along * step - centre)) - radius)
        return near


def viewpoints_at(positions):
    """Viewpoints at these places, with made-up directions."""
    positions = np.asarray(positions, dtype=float).reshape(-1, 3)
    count = len(positions)
    rng = np.random.default_rng(count)
    return Viewpoints(
        positions,
        np.round(rng.uniform(-179, 180, count), 4),
        np.round(rng.uniform(-90, 0, count), 4),
        ("cover",) * count,
        np.full(count, -1),
    )


def points_of(path, spacing=0.02):
    """Points of the whole curve at most ``spacing`` apart, by no code of the planner."""
    found = [np.zeros((0, 3))]
    for a, b, c, d in path.controls:
        length = sum(np.linalg.norm(step) for step in (b - a, c - b, d - c))
        t = np.linspace(0, 1, 3 * int(length / spacing) + 2)[:, None]
        found.append(
            (1 - t) ** 3 * a + 3 * (1 - t) ** 2 * t * b + 3 * (1 - t) * t**2 * c + t**3 * d
        )
    return np.concatenate(found)


def check_safe(flight, space):
    """The strongest statement there is: not one point of the curve is too close."""
    path = flight.path
    points = points_of(path)
    if len(points):
        assert space.clearance(points).min() >= space.d_min
        assert space.zone_margin(points).min() >= 0.0
        assert (points >= space.bounds[0]).all()
        assert (points <= space.bounds[1]).all()
    for piece in range(len(path)):
        t = np.linspace(0, 1, 400)[:, None]
        a, b, c, d = path.controls[piece]
        one = (1 - t) ** 3 * a + 3 * (1 - t) ** 2 * t * b + 3 * (1 - t) * t**2 * c + t**3 * d
        assert space.d_min < path.clearance[piece] <= space.clearance(one).min() + 1e-9
        assert 0.0 < path.zone_margin[piece] <= space.zone_margin(one).min() + 1e-9


@pytest.fixture(scope="session")
def solids():
    """Class of exact solids."""
    return Solids


@pytest.fixture(scope="session", name="viewpoints_at")
def _viewpoints_at():
    return viewpoints_at


@pytest.fixture(scope="session")
def dense_points():
    """Points all along a path."""
    return points_of


@pytest.fixture(scope="session")
def assert_safe():
    """Brute-force check of a flight."""
    return check_safe
