"""Handles that make a piece quick, against speeds worked out by hand."""

import numpy as np
import pytest

from planner.config import FlightSettings
from planner.flight.fly import plan_flight
from planner.flight.handles import piece_seconds
from planner.flight.limits import Limits
from planner.flight.smooth import arcs
from planner.flight.timing import fly_in_time
from planner.geometry import bezier


@pytest.mark.parametrize(
    ("metres", "shoot", "expected"),
    [
        (20.0, "stop", 7.0),  # 2 s and 4 m to 4 m/s, 12 m in 3 s, 2 s to rest
        (2.0, "stop", 2.0),  # 1 m of speeding up, 1 m of braking, at 2 m/s2
        (20.0, "through", 5.0),
    ],
)
def test_a_straight_piece_takes_as_long_as_by_hand(metres, shoot, expected):
    piece = bezier.straight(np.zeros((1, 3)), np.array([[metres, 0.0, 0.0]]))
    seconds = piece_seconds(piece, FlightSettings(shoot=shoot))
    np.testing.assert_allclose(seconds, [expected], rtol=0.03)


def test_bends_that_are_flown_through_ask_for_long_handles_and_stops_for_shorter_ones():
    start, end = np.zeros((1, 3)), np.array([[30.0, 0.0, 0.0]])
    up, down = np.array([[0.0, 1.0, 0.0]]), np.array([[0.0, -1.0, 0.0]])
    shares = np.linspace(0.04, 0.5, 24)
    trials = np.concatenate([arcs(start, end, up, down, share) for share in shares])
    stop = piece_seconds(trials, FlightSettings()).argmin()
    through = piece_seconds(trials, FlightSettings(shoot="through")).argmin()
    assert shares[stop] < shares[through]


@pytest.mark.parametrize("seed", range(3))
def test_the_flight_is_shorter_and_sooner_than_with_handles_of_one_length(
    solids, viewpoints_at, seed, monkeypatch
):
    spots = np.random.default_rng(seed).uniform((0, 0, 10), (60, 60, 40), (30, 3))
    flights = []
    for handles in (None, (1.0,)):
        if handles is not None:
            monkeypatch.setattr("planner.flight.curve.HANDLES", handles)
        flight = plan_flight(viewpoints_at(spots), solids(ground=0.0))
        seconds = fly_in_time(flight.path, flight.viewpoints, Limits()).duration
        assert not flight.path.corners().size
        flights.append((flight.path.length, seconds))
    assert flights[0][0] < flights[1][0]
    assert flights[0][1] < flights[1][1]
