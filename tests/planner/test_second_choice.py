"""The second choice of photos keeps away from where the first one could not be flown to."""

from types import SimpleNamespace

import numpy as np
import pytest

from planner import attempts
from planner.attempts import Attempt, refilled
from planner.clock import Clock
from planner.config import Config

GRID = np.stack(np.meshgrid([0.0, 4.0, 8.0], [0.0, 4.0], [10.0], indexing="ij"), -1).reshape(-1, 3)


@pytest.fixture
def tried(viewpoints_at):
    """Two flown photos, one lost beside them, and one lost in another part of free space."""

    def make(*, kept):
        chosen = viewpoints_at([[0.5, 0.0, 10.0], [3.2, 1.1, 11.0], [8.0, 3.0, 9.0], [4, 4, 10]])
        route = SimpleNamespace(spaces=np.array([0, 0, 0, 1]))
        covers = SimpleNamespace(reason_counts=lambda: {"covered": 7})
        return Attempt(covers, route, (SimpleNamespace(kept=np.array(kept)),), (), chosen, ())

    return make


def second_places(monkeypatch, first):
    """What the second choice may choose from, or nothing if there is none."""
    asked = []

    def attempt(prior, positions, *_, **__):
        asked.append(positions.tolist())
        return first

    monkeypatch.setattr(attempts, "attempt", attempt)
    prior = SimpleNamespace(positions=GRID)
    assert refilled(first, prior, Config(), map, Clock(None)) is first
    return asked


def test_the_position_that_a_lost_photo_was_moved_from_is_left_out(tried, monkeypatch):
    first = tried(kept=[0, 2])
    assert first.lost.tolist() == [[3.2, 1.1, 11.0], [4.0, 4.0, 10.0]]
    assert first.astray.tolist() == [[3.2, 1.1, 11.0]]
    left = [place for place in GRID.tolist() if place != [4.0, 0.0, 10.0]]
    assert second_places(monkeypatch, first) == [left]


def test_each_lost_photo_costs_the_position_nearest_to_it(tried, monkeypatch):
    first = tried(kept=[1, 3])
    left = [place for place in GRID.tolist() if place not in ([0.0, 0.0, 10.0], [8.0, 4.0, 10.0])]
    assert second_places(monkeypatch, first) == [left]


def test_a_part_that_cannot_be_reached_is_no_reason_to_choose_again(tried, monkeypatch):
    first = tried(kept=[0, 1, 2])
    assert len(first.lost) == 1
    assert second_places(monkeypatch, first) == []
