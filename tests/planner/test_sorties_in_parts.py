"""A place that a wall of no-fly zone cuts in two: a sortie on each side that a station reaches."""

import json
import re

import numpy as np
import pytest

from planner import Plan, check_folder, load_config, plan, synthetic_scene
from planner.flight.limits import Limits
from planner.missions.check import ELSEWHERE
from planner.route.ways import FreeWays
from planner.sorties.parts import parts_left, parts_to_fly, plan_parts
from planner.sorties.station import find_stations

WALL = "airspace.zones=[{polygon=[[-3,-300],[3,-300],[3,300],[-3,300]],name='railway'}]"
SETTINGS = [
    "scale.radius_share=0.08",
    "seed=4",
    "viewpoints.objective=hits",
    "viewpoints.connected=false",
    "sorties.method=split",
    WALL,
]
WEST, EAST = "[-28.0,-24.0]", "[30.0,20.0]"


@pytest.fixture(scope="module")
def scene():
    return synthetic_scene(3, size=(42.0, 40.0), buildings=2, spacing=1.0)


def planned_from(scene, *stations):
    given = f"sorties.stations=[{','.join(stations)}]"
    return plan(scene, load_config(None, [*SETTINGS, given]))


@pytest.fixture(scope="module")
def both(scene):
    return planned_from(scene, EAST, WEST)


@pytest.fixture(scope="module")
def folder(both, tmp_path_factory):
    folder = tmp_path_factory.mktemp("plans") / "plan"
    both.save(folder)
    return folder


def sides(plan_):
    return np.sign(plan_.viewpoints.positions[:, 0])


@pytest.mark.slow
def test_two_stations_fly_both_sides_and_nothing_is_lost(both, folder):
    assert set(sides(both).tolist()) == {-1.0, 1.0}
    assert not len(both.lost)
    assert not [f for f in both.findings if f.code in {"separate-space", "viewpoint-dropped"}]
    main = len(both.flight.viewpoints)
    assert 0 < main < len(both.viewpoints)
    assert len(set(sides(both)[:main].tolist())) == 1
    for sortie in both.sorties.flown:
        pad = both.sorties.stations[sortie.number].pad
        assert (np.sign(sortie.rows(both.scale.d_min)[:, 1]) == np.sign(pad[0])).all()
        assert (sides(both)[sortie.photos] == np.sign(pad[0])).all()
    photos = np.concatenate([np.setdiff1d(s.photos, s.shared) for s in both.sorties.flown])
    np.testing.assert_array_equal(np.sort(photos), np.arange(len(both.viewpoints)))
    found = check_folder(folder)
    assert found.ok
    assert found.viewpoints == len(both.viewpoints)
    report = json.loads((folder / "report.json").read_text())
    assert report["sorties"]["parts_of_free_space"] == 2
    assert report["path"]["dropped_viewpoints"] == 0
    total = sum(s.duration for s in both.sorties.flown)
    ground = both.config.sorties.turnaround_seconds * len(both.sorties.flown)
    assert both.sorties.seconds[both.sorties.method] == pytest.approx(total + ground)
    np.testing.assert_allclose(
        Plan.load(folder).viewpoints.positions, both.viewpoints.positions, atol=1e-9
    )


@pytest.mark.slow
def test_what_is_said_of_the_plan_holds_for_all_sorties(both, tmp_path, monkeypatch):
    import planner.report.folder
    from planner.cli import _outcome

    drawn = {}
    draw = planner.report.folder.draw_overview

    def keep(path, **words):
        drawn.update(words)
        draw(path, **words)

    monkeypatch.setattr(planner.report.folder, "draw_overview", keep)
    both.save(tmp_path / "plan")
    flown = both.sorties.flown
    paths = [both.flight.path, *(flight.path for flight in both.sorties.others)]
    least = min(path.clearance.min() for path in [*paths, *(sortie.path for sortie in flown)])
    assert least < both.flight.path.clearance.min()  # else this shows nothing
    line = _outcome(both)
    for words, pattern in (
        (drawn["caption"], r"proven to stay at least (\S+) m"),
        (line, r"certified clearance (\S+) m"),
    ):
        told = float(re.search(pattern, words)[1])
        assert least - 0.01 < told <= least
    length, seconds = sum(s.length for s in flown), sum(s.duration for s in flown)
    assert f"viewpoints, {length:.0f} m, {seconds:.0f} s, " in line
    assert f"viewpoints, {length:.0f} m, {seconds / 60.0:.1f} min, " in drawn["title"]


def test_centimetres_are_never_rounded_up():
    from planner.report.numbers import rounded_down

    assert [rounded_down(x) for x in (2.3, 6.699, 12.0, np.float64(0.0099))] == [
        *("2.30", "6.69", "12.00", "0.00")
    ]


@pytest.mark.slow
def test_a_photo_that_only_a_sortie_takes_cannot_be_forgotten(both, folder):
    table = folder / "viewpoints.csv"
    lines = table.read_text().splitlines()
    try:
        table.write_text("\n".join(lines[:-1]) + "\n")
        problems = check_folder(folder, sealed=False).problems
        assert any("is missing or too many" in problem for problem in problems)
    finally:
        table.write_text("\n".join(lines) + "\n")
    file = folder / "path.json"
    tree = json.loads(file.read_text())
    assert tree[ELSEWHERE] == len(both.viewpoints) - len(both.flight.viewpoints)
    sorties = json.loads((folder / "sorties.json").read_text())
    keep = [s for s in sorties["sorties"] if s["station"] != sorties["sorties"][-1]["station"]]
    (folder / "sorties.json").write_text(json.dumps({**sorties, "sorties": keep}))
    try:
        problems = check_folder(folder, sealed=False).problems
        assert any("is taken by 0 sorties" in problem for problem in problems)
    finally:
        (folder / "sorties.json").write_text(json.dumps(sorties))


@pytest.mark.slow
def test_one_station_flies_its_side_and_says_how_many_photos_the_other_costs(scene, both):
    side = sides(both)[-1]  # the one with fewer photos
    one = planned_from(scene, WEST if side < 0 else EAST)
    assert (sides(one) == side).all()
    lost = [finding for finding in one.findings if finding.code == "separate-space"]
    assert len(lost) == 1
    assert lost[0].number == len(one.lost) == len(one.route.order) - len(one.viewpoints)
    assert "add one to sorties.stations" in lost[0].message
    assert one.status == "partial"
    assert (np.sign(one.lost[:, 0]) == -side).all()
    for sortie in one.sorties.flown:
        assert (np.sign(sortie.rows(one.scale.d_min)[:, 1]) == side).all()


@pytest.mark.slow
def test_a_part_whose_photos_are_all_dropped_says_why(scene, monkeypatch):
    from planner import attempts
    from planner.clock import Clock

    given = f"sorties.stations=[{EAST},{WEST}]"
    prior = attempts.study(scene, load_config(None, [*SETTINGS, given]), Clock(None))
    terrain = prior.airspace.terrain.height
    stations = find_stations(
        prior.config.sorties.stations, prior.airspace, terrain, margin=prior.config.flight.margin
    )
    fly = attempts.plan_flight

    def careful(views, airspace, *, settings, only, **more):
        if views.positions[only[0], 0] > 0:  # no photo in the east is that far from everything
            settings = settings.model_copy(update={"margin": 500.0})
        return fly(views, airspace, settings=settings, only=only, **more)

    monkeypatch.setattr(attempts, "plan_flight", careful)
    tried = attempts.attempt(
        prior, prior.positions, prior.config, map, Clock(None), stations=stations
    )
    assert len(tried.flights) == len(tried.parts) == 1
    assert (tried.viewpoints.positions[:, 0] < 0).all()
    east = np.flatnonzero(tried.chosen.positions[:, 0] > 0)
    assert len(east) == tried.dropped > 0
    assert {finding.code for finding in tried.findings} == {"viewpoint-dropped"}
    assert sorted(finding.number for finding in tried.findings) == east.tolist()
    assert all("m from solids where" in finding.message for finding in tried.findings)


class Rooms:
    """Free ways in two half-spaces that a wall at x = 0 parts."""

    def between(self, start, end):
        from planner.route.ways import FreeWay

        together = np.sign(start[0]) == np.sign(end[0])
        return FreeWay(np.stack([start, end]) if together else None, not together)


def test_parts_are_flown_from_the_stations_that_reach_them(solids):
    space = solids(ground=0.0, d_min=2.0)
    points = [(-5.0, 0.0), (6.0, 0.0), (9.0, 0.0)]
    stations = find_stations(points, space, lambda xy: np.zeros(len(xy)), margin=0.002)
    places = np.array([[x, 3.0, 8.0] for x in (4, 5, -4, 6, -5)], dtype=float)
    spaces = np.array([0, 0, 1, 0, 1])
    parts = parts_to_fly(spaces, places, stations, Rooms())
    assert [part.stations for part in parts] == [(1, 2), (0,)]
    assert [part.rows.tolist() for part in parts] == [[0, 1, 3], [2, 4]]
    assert parts_left(spaces, places, parts, ("unused",)) == ()
    west = parts_to_fly(spaces, places, stations[:1], Rooms())
    assert [(part.rows.tolist(), part.stations) for part in west] == [([2, 4], (0,))]
    (left,) = parts_left(spaces, places, west, ("unused",))
    assert left.number == 3.0
    nothing = parts_to_fly(spaces, places, (), Rooms())
    assert [(part.rows.tolist(), part.stations) for part in nothing] == [([0, 1, 2, 3, 4], ())]
    assert parts_left(spaces, places, nothing, ("as the order says",)) == ("as the order says",)
    astray = parts_to_fly(np.zeros(3, int), places[[0, 1, 3]], stations[:1], Rooms())
    assert [part.stations for part in astray] == [(0,)]  # for the sorties to refuse


def test_schedules_of_parts_are_numbered_together(solids, viewpoints_at):
    from planner.config import FlightSettings, SortieSettings
    from planner.flight.fly import plan_flight

    space = solids(ground=0.0, d_min=2.0)
    stations = find_stations(
        [(-30.0, 0.0), (30.0, 0.0)], space, lambda xy: np.zeros(len(xy)), margin=0.002
    )
    near = [[x + side, y, 8.0] for side in (20.0, -20.0) for x in (0, 4, 8) for y in (0, 5)]
    views = viewpoints_at(near[:-1])  # six, and five
    spaces = np.repeat([0, 1], [6, 5])
    ways = FreeWays(space, margin=0.002)

    class Walled:
        between = staticmethod(Rooms().between)

    parts = parts_to_fly(spaces, views.positions, stations, Walled())
    flights = tuple(plan_flight(views, space, ways=ways, only=part.rows) for part in parts)
    assert [flight.kept.tolist() for flight in flights] == [[*range(6)], [*range(6, 11)]]
    chain = np.array([[k, k + 1] for k in range(10)])
    found = plan_parts(
        flights,
        parts,
        stations,
        space,
        chain,
        settings=SortieSettings(endurance_seconds=60.0, method="best"),
        flight_settings=FlightSettings(),
        limits=Limits(),
        seed=0,
    )
    assert found.stations == stations
    assert len(found.viewpoints) == 11
    assert len(found.others) == 1
    photos = np.concatenate([np.setdiff1d(s.photos, s.shared) for s in found.flown])
    np.testing.assert_array_equal(np.sort(photos), np.arange(11))
    for sortie in found.flown:
        assert set((sortie.photos >= 6).tolist()) == {sortie.number == 0}
        at = found.viewpoints.positions[sortie.photos]
        np.testing.assert_allclose(sortie.timeline.viewpoints.positions[1:-1], at)
    np.testing.assert_array_equal(np.sort(found.order), np.arange(11))
    flown = sum(s.duration + 120.0 for s in found.flown)
    assert found.seconds[found.method] == pytest.approx(flown)
