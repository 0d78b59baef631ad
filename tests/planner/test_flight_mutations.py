"""Break the proof on purpose, one part at a time, and see that it would be noticed."""

import copy

import numpy as np
import pytest

from planner.config import FlightSettings
from planner.flight import certificate, fly, repair
from planner.flight.fly import plan_flight
from planner.geometry import bezier
from planner.route import ways


def swinging_arc(solids, viewpoints_at, assert_safe):
    """An arc that swings to both sides of its chord, along a wall: its middle tells nothing."""
    space = solids([((0, -2, -50), (40, 0, 50))])
    spots = [[-15, -10, 0], [0, 3, 0], [40, 3, 0], [55, 16, 0]]
    flight = plan_flight(viewpoints_at(spots), space)
    assert_safe(flight, space)
    assert len(flight.kept) == 4


def wide_solid(solids, viewpoints_at, assert_safe):
    """A viewpoint deep inside of a solid, far from every surface."""
    space = solids([((-30, -30, 0), (30, 30, 60))])
    spots = [[-40, 0, 30], [0, 0, 30], [1, 0, 30], [40, 40, 30]]
    flight = plan_flight(viewpoints_at(spots), space)
    assert_safe(flight, space)
    assert flight.kept.tolist() == [0, 3]


def mast(solids, viewpoints_at, assert_safe):
    """A mast beside the way, which hardly any point would meet."""
    space = solids([((6.9, -0.05, 0), (7.1, 0.05, 60))], d_min=1.0)
    flight = plan_flight(viewpoints_at([[-20, 0, 30], [20, 0, 30], [20, 9, 30]]), space)
    assert_safe(flight, space)
    assert len(flight.kept) == 3


def tower(solids, viewpoints_at, assert_safe):
    """A tower that has to be flown around."""
    space = solids([((-5, -5, 0), (5, 5, 30))], ground=0.0)
    spots = [[-20, 0, 10], [20, 0, 10], [20, 15, 10], [0, -15, 10]]
    flight = plan_flight(viewpoints_at(spots), space, settings=FlightSettings(iterations=500))
    assert_safe(flight, space)
    assert len(flight.kept) == 4
    assert flight.repaired.size >= 1


def floor_and_lid(solids, viewpoints_at, assert_safe):
    """Arcs that would dip into the ground and rise above a ceiling."""
    space = solids(ground=0.0, ceiling=20.0)
    spots = [[0, 0, 18], [20, 0, 2.5], [40, 0, 2.5], [60, 0, 19.5], [80, 0, 19.5], [99, 0, 5]]
    flight = plan_flight(viewpoints_at(spots), space)
    assert_safe(flight, space)
    assert len(flight.kept) == 6


def without_radius(patch, space):
    patch.setattr(bezier, "hull_radius", lambda controls: np.zeros(controls.shape[:-2]))


def without_sign(patch, space):
    signed = space.clearance
    patch.setattr(space, "clearance", lambda self, points: np.abs(signed(self, points)))


def without_sweeps(patch, space):
    patch.setattr(space, "capsule_clearance_at_least", lambda *_: True)


def without_lengths(patch, space):
    patch.setattr(bezier, "polygon_length", lambda controls: np.zeros(controls.shape[:-2]))


def without_edges(patch, space):
    patch.setattr(repair, "edge_is_free", lambda *_: True)


def without_zones(patch, space):
    patch.setattr(space, "zone_margin", lambda _, points: np.full(len(points), np.inf))


def without_ground(patch, space):
    for name in ("clearance", "segment_distance"):
        patch.setattr(space, name, blind_to_ground(getattr(space, name)))


def without_second_halves(patch, space):
    whole = certificate._Proof.split

    def first_half(self, parts):
        both = whole(self, parts)
        return both.take(np.arange(len(both.owner)) < len(both.owner) // 2)

    patch.setattr(certificate._Proof, "split", first_half)


def without_refusal(patch, space):
    patch.setattr(certificate, "DEPTH", 0)
    patch.setattr(certificate._Proof, "refuse", lambda *_: None)


def with_rounding_after_the_proof(patch, space):
    whole = fly._assemble

    def coarse(found, **options):
        for leg in found:
            object.__setattr__(leg, "controls", np.round(leg.controls))
        return whole(found, **options)

    patch.setattr(fly, "_assemble", coarse)


def blind_to_ground(method):
    def blind(self, *points):
        airy = copy.copy(self)
        airy.ground = None
        return method(airy, *points)

    return blind


BREAKS = [
    (without_radius, swinging_arc),
    (without_sign, wide_solid),
    (without_sweeps, mast),
    (without_sweeps, tower),
    (without_lengths, swinging_arc),
    (without_lengths, mast),
    (without_edges, tower),
    (without_zones, floor_and_lid),
    (without_ground, floor_and_lid),
    (without_second_halves, tower),
    (without_second_halves, floor_and_lid),
    (without_refusal, mast),
    (without_refusal, tower),
    (with_rounding_after_the_proof, tower),
]


@pytest.mark.parametrize("case", [swinging_arc, wide_solid, mast, tower, floor_and_lid])
def test_as_it_is_every_case_is_safe(case, solids, viewpoints_at, assert_safe):
    case(solids, viewpoints_at, assert_safe)


@pytest.mark.parametrize("broken", BREAKS)
def test_each_break_is_noticed(broken, solids, viewpoints_at, assert_safe, monkeypatch):
    mutation, case = broken

    class Broken(solids):
        """What the planner believes."""

    def assert_truly_safe(flight, believed):
        truth = solids.__new__(solids)
        truth.__dict__.update(vars(believed))
        assert_safe(flight, truth)

    mutation(monkeypatch, Broken)
    with pytest.raises(AssertionError):
        case(Broken, viewpoints_at, assert_truly_safe)


@pytest.mark.parametrize("case", [tower, mast])
def test_a_roadmap_that_lies_costs_no_safety(case, solids, viewpoints_at, assert_safe, monkeypatch):
    monkeypatch.setattr(ways.FreeWays, "_edge_is_free", lambda *_: True)
    case(solids, viewpoints_at, assert_safe)
    monkeypatch.undo()
    monkeypatch.setattr(solids, "clearance_range", lambda _, p: (np.full(len(p), 99.0),) * 2)
    case(solids, viewpoints_at, assert_safe)
