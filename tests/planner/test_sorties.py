"""Sorties on exact solids: certified, within limits, linked, and refused where they cannot be."""

import numpy as np
import pytest

from planner.config import FlightSettings, SortieSettings
from planner.errors import PlannerError
from planner.flight.fly import plan_flight
from planner.flight.limits import Limits
from planner.flight.profile import rest_to_rest
from planner.flight.timing import STATION, fly_in_time
from planner.sorties.schedule import plan_sorties
from planner.sorties.shared import linked
from planner.sorties.station import Station, find_stations, outside_scan, shortfall
from planner.sorties.thought import usable_seconds

BLOCK = [[[10, 10, 0], [30, 30, 20]]]


def level(points):
    return np.zeros(len(points))


def stations(solids, points, **space):
    return find_stations(points, solids(**{"ground": 0.0, **space}), level, margin=0.002)


def around_the_block(count=16):
    """Places around and above the block, in the order of a walk."""
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    ring = [20 + 22 * np.cos(angle), 20 + 22 * np.sin(angle), 12 + 6 * np.sin(3 * angle)]
    return np.stack(ring, axis=1)


def schedule(solids, viewpoints_at, spots, edges=None, points=((-8.0, -8.0),), **settings):
    space = solids(BLOCK, ground=0.0, bounds=((-30, -30, -5), (90, 70, 50)))
    flight = plan_flight(viewpoints_at(spots), space)
    timeline = fly_in_time(flight.path, flight.viewpoints, Limits())
    count = len(spots)
    chain = np.stack([np.arange(count - 1), np.arange(1, count)], axis=1)
    wanted = SortieSettings(stations=points, **settings)
    found = plan_sorties(
        flight,
        timeline,
        find_stations(points, space, level, margin=0.002),
        space,
        chain if edges is None else np.array(edges),
        settings=wanted,
        flight_settings=FlightSettings(),
        seed=0,
    )
    assert_sound(found, wanted, space, count)
    return found


def assert_sound(found, wanted, space, count):
    """Every photo is flown once, every row keeps its distance, every limit is kept."""
    taken = [np.setdiff1d(sortie.photos, sortie.shared) for sortie in found.flown]
    assert sorted(np.concatenate(taken).tolist()) == list(range(count))
    assert sorted(found.order.tolist()) == list(range(count))
    share = np.linspace(0.0, 1.0, 8)[:, None, None]
    for sortie in found.flown:
        assert sortie.duration <= usable_seconds(wanted) + 1e-6
        assert wanted.most_waypoints is None or sortie.waypoints <= wanted.most_waypoints
        rows = sortie.rows(space.d_min)
        assert (np.diff(rows[:, 0]) > 0.0).all()
        assert rows[-1, 0] == pytest.approx(sortie.duration, abs=1e-5)
        np.testing.assert_array_equal(rows[[0, -1], 1:4], [sortie.station.pad] * 2)
        flown = rows[1:-1, 1:4]
        lines = (1 - share) * flown[:-1] + share * flown[1:]
        assert space.clearance(lines.reshape(-1, 3)).min() >= space.d_min
        assert sortie.timeline.viewpoints.kind[0] == sortie.timeline.viewpoints.kind[-1] == STATION
        at = np.abs(rows[:, 0][:, None] - sortie.photo_times).argmin(axis=0)
        places = found.flight.viewpoints.positions[sortie.photos]
        np.testing.assert_allclose(rows[at, 1:4], places, atol=1e-4)


def test_a_long_endurance_needs_one_sortie(solids, viewpoints_at):
    found = schedule(solids, viewpoints_at, around_the_block(), method="split")
    assert len(found.flown) == 1
    sortie = found.flown[0]
    inner = sortie.timeline.done[-2] - sortie.timeline.done[0]
    whole = found.timeline.done[-1] - found.timeline.depart[0]
    assert inner == pytest.approx(whole, rel=0.02)
    assert found.proven


@pytest.mark.parametrize("method", ["split", "best"])
def test_short_endurance_and_few_waypoints_make_more_sorties(solids, viewpoints_at, method):
    limits = {"endurance_seconds": 75.0, "reserve": 0.2, "most_waypoints": 20}
    found = schedule(solids, viewpoints_at, around_the_block(), method=method, **limits)
    assert len(found.flown) >= 3
    assert found.seconds[found.method] == pytest.approx(
        sum(sortie.duration + 120.0 for sortie in found.flown)
    )
    assert found.seconds[found.method] == min(found.seconds.values())


def test_each_sortie_starts_where_that_is_shortest(solids, viewpoints_at):
    points = ((-8.0, -8.0), (48.0, 48.0))
    found = schedule(
        solids, viewpoints_at, around_the_block(), points=points, endurance_seconds=70.0
    )
    assert {sortie.number for sortie in found.flown} == {0, 1}


def test_a_sortie_takes_the_photos_that_link_its_own(solids, viewpoints_at):
    # even and odd photos match among themselves, and both match the last one
    spots = np.array([[0, -5 + 5 * k, 10] for k in range(10)], dtype=float)
    edges = [*([k, k + 2] for k in range(8)), [0, 9], [1, 9], [6, 9]]
    limits = {"turnaround_seconds": 0.0, "most_waypoints": 9, "method": "split"}
    found = schedule(solids, viewpoints_at, spots, edges, **limits)
    links = {frozenset(edge) for edge in edges}
    for sortie in found.flown:
        photos, seen = sortie.photos.tolist(), [sortie.photos[0]]
        for photo in seen:
            seen += [p for p in photos if p not in seen and frozenset((photo, p)) in links]
        assert sorted(seen) == sorted(photos)
    assert any(len(sortie.shared) for sortie in found.flown)
    loose = schedule(solids, viewpoints_at, spots, edges, connected=False, **limits)
    assert not any(len(sortie.shared) for sortie in loose.flown)


def test_links_add_the_shortest_chain_at_the_cheapest_place():
    seconds = np.abs(np.subtract.outer(np.arange(6.0), np.arange(6.0)))
    edges = np.array([[0, 1], [1, 2], [2, 5], [1, 3], [3, 4], [4, 5]])
    assert linked(np.array([0, 5]), edges, seconds).tolist() == [0, 1, 2, 5]
    assert linked(np.array([0, 1, 2]), edges, seconds).tolist() == [0, 1, 2]
    assert linked(np.array([4, 0]), edges, seconds).tolist() == [4, 3, 1, 0]
    alone = np.array([[0, 1]])
    assert linked(np.array([0, 5]), alone, seconds).tolist() == [0, 5]  # nothing links them


def test_a_photo_out_of_reach_is_refused_with_the_endurance_that_it_needs(solids, viewpoints_at):
    spots = np.array([[0, 0, 10], [80, 0, 10]], dtype=float)
    points = ((0.0, 0.0),)
    with pytest.raises(PlannerError, match=r"endurance_seconds = 30: the photo at \(80") as caught:
        schedule(solids, viewpoints_at, spots, points=points, endurance_seconds=30.0)
    words = str(caught.value)
    assert "\n" not in words
    needed = float(words.rsplit("; ", maxsplit=1)[-1].split(maxsplit=1)[0])
    found = schedule(
        solids, viewpoints_at, spots, points=points, endurance_seconds=needed, method="split"
    )
    less = SortieSettings(endurance_seconds=needed - 1.0)
    assert found.flown[-1].duration > usable_seconds(less)


def test_too_few_waypoints_for_a_photo_are_refused(solids, viewpoints_at):
    with pytest.raises(PlannerError, match="most_waypoints = 2: a sortie of one photo has 3"):
        schedule(solids, viewpoints_at, around_the_block(4), most_waypoints=2)


def test_only_stations_farther_than_d_min_from_the_scan_are_told(solids):
    placed = stations(solids, [(0.0, 0.0), (1.9, 0.0), (6.0, 8.0)])

    def to_one_point(points):
        return np.linalg.norm(points, axis=1)

    (finding,) = outside_scan(placed, to_one_point, 2.0)
    assert finding.code == "station-outside-scan"
    assert finding.number == pytest.approx(10.0)
    assert "sorties.stations[2] = (6, 8) is 10.0 m from the nearest point" in finding.message
    assert outside_scan((), to_one_point, 2.0) == ()


def test_a_station_in_the_open_starts_just_above_what_is_kept(solids):
    (station,) = stations(solids, [(0.0, 0.0)])
    assert station.pad.tolist() == [0.0, 0.0, 0.0]
    assert 2.002 <= station.entry[2] <= 2.3
    raised = stations(solids, [(0.0, 0.0, 5.0)], boxes=[[[-1, -1, 0], [1, 1, 5]]])[0]
    assert 2.002 <= raised.climb <= 2.3


@pytest.mark.parametrize(
    ("point", "space", "words"),
    [
        ((20.0, 20.0), {"boxes": BLOCK}, "inside of or beside something solid"),
        ((9.5, 20.0), {"boxes": BLOCK}, "beside something solid"),
        ((600.0, 0.0), {}, "100.0 m outside of the space in which"),
        ((0.0, 0.0), {"ceiling": 1.0}, "zones or the ceiling leave"),
        ((0.0, 0.0), {"bounds": ((-9, -9, -9), (9, 9, 1))}, "considered up to 1.0 m only"),
        ((20.0, 20.0), {"boxes": BLOCK, "bounds": ((-9, -9, -9), (50, 50, 21))}, "room where"),
    ],
)
def test_a_station_that_cannot_be_is_refused_with_its_number(solids, point, space, words):
    with pytest.raises(PlannerError, match=words) as caught:
        stations(solids, [(-5.0, -5.0), point][1:], **space)
    assert str(caught.value).startswith("sorties.stations[0] = ")
    assert "\n" not in str(caught.value)


def test_a_climb_must_leave_the_ground_and_pass_nothing_else(solids):
    def climb(space, x):
        pad = np.array([x, 0.0, 0.0])
        return shortfall(Station(pad, pad + [0, 0, 20.0]), space.clearance, space.d_min)

    wall = [[[-5, -20, 0], [0, 20, 30]]]
    assert climb(solids(wall, ground=0.0), 2.001) is None
    short = climb(solids(wall, ground=0.0), 1.5)
    assert short.found == pytest.approx(1.5)
    assert short.needed > 1.5
    assert climb(solids([[[-5, -5, 12], [5, 5, 13]]], ground=0.0), 0.0).found < 2.0


def test_way_from_rest_to_rest():
    assert rest_to_rest(20.0, 4.0, 2.0) == pytest.approx(7.0)
    assert rest_to_rest(2.0, 4.0, 2.0) == pytest.approx(2.0)
    assert rest_to_rest(0.0, 4.0, 2.0) == 0.0
