"""Photos chosen by what pairs of them can triangulate, on the block of the other tests."""

import itertools

import hypothesis
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.config import ViewpointSettings
from planner.errors import PlannerError
from planner.geometry.angles import direction
from planner.scene.cloud import Mesh
from planner.surface.samples import ScoredSamples, SurfaceSamples
from planner.viewpoints import subject as subjects
from planner.viewpoints.camera import Camera
from planner.viewpoints.candidates import generate_candidates
from planner.viewpoints.demand import sharp_demand
from planner.viewpoints.free_balls import FreeBalls
from planner.viewpoints.hunt import Hunt, Slack
from planner.viewpoints.pairs import visible_pairs
from planner.viewpoints.pool import Pool
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.reconstructability import reconstructability
from planner.viewpoints.refine import poses_beside
from planner.viewpoints.select import reassess, select_viewpoints
from planner.viewpoints.sight import SightRule
from planner.viewpoints.subject import Subject
from planner.viewpoints.thinning import thin_lattice
from solvers import Status, Stop
from solvers.registry import load

CAMERA = Camera(width_px=600, height_px=400, focal_px=400.0)
LIMITS = {"d_min": 3.0, "d_max": 22.0, "gsd": 30.0 / 400.0}


def roof():
    """A roof of 12 x 10 m seen from a grid of places above and around it."""
    axes = np.arange(-5.0, 5.1, 1.25), np.arange(-4.0, 4.1, 1.25)
    xyz = np.stack(np.meshgrid(*axes, [9.0]), -1).reshape(-1, 3)
    one = np.ones(len(xyz))
    up = np.tile([0.0, 0.0, 1.0], (len(xyz), 1))
    samples = ScoredSamples(xyz, up, np.zeros(len(xyz)), 1.25, one, one, one)
    corners = np.array([[-6, -5, 9], [6, -5, 9], [6, 5, 9], [-6, 5, 9]], dtype=float)
    side = np.arange(-14.0, 14.1, 4.0)
    places = np.stack(np.meshgrid(side, side, [15.0, 19.0, 23.0]), -1).reshape(-1, 3)
    return Mesh(corners, [[0, 1, 2], [0, 2, 3]]), samples, places


def select(**changes):
    mesh, samples, places = roof()
    guards, camera = changes.pop("guards", None), changes.pop("camera", CAMERA)
    seed = changes.pop("seed", 0)
    given = {"objective": "reconstructability", "iterations": 40, **changes}
    return select_viewpoints(
        *(places, mesh, samples, camera),
        settings=ViewpointSettings(**given),
        voxel=4.0,
        seed=seed,
        guards=guards,
        **LIMITS,
    )


@pytest.fixture(scope="module")
def selection():
    return select()


def test_enough_samples_reach_the_target_by_fresh_rays_and_the_exact_formula(selection):
    mesh, samples, _ = roof()
    h = reconstructability(
        selection.viewpoints, samples, RayCaster(mesh), CAMERA, reference=2 * 30.0
    )
    np.testing.assert_array_equal(h, selection.reconstructability)
    possible = selection.wish.pairs.reachable
    good = (h >= 4.0) & (selection.hits >= selection.wish.reachable.hits)
    assert possible.all()
    assert good.mean() >= 0.98
    assert not [finding for finding in selection.findings if finding.partial]
    assert selection.reconstructable(4.0) == h[possible].__ge__(4.0).mean()


def test_the_search_has_a_bound_and_beats_the_cover_at_its_own_price(selection):
    (pairs,) = select(floor=0.0).results
    assert pairs.solver == "lns"
    assert 2 <= pairs.bound <= pairs.cost
    searched, completed = selection.results
    assert (searched.solver, completed.solver) == ("lns", "greedy")
    assert 2 <= completed.bound <= completed.cost == len(selection.viewpoints)
    h = select(objective="hits").reconstructability
    assert np.mean(h >= 4.0) < np.mean(selection.reconstructability >= 4.0)


@given(st.integers(0, 2**32 - 1))
@hypothesis.settings(max_examples=20, deadline=None)
def test_poses_beside_others_are_near_free_and_within_the_gimbals_range(seed):
    mesh, samples, places = roof()
    rule = SightRule(d_min=3.0, d_max=22.0, max_incidence=1.4)
    seen = {"samples": samples, "caster": RayCaster(mesh), "camera": CAMERA, "rule": rule}
    few = places[:3]
    yaw, pitch = np.array([0.0, 90.0, -120.0]), np.array([-90.0, -45.0, 0.0])
    chosen = Pool.at(few, yaw, pitch, **seen)
    room = FreeBalls(places, np.full(len(places), 0.5))
    root = np.random.SeedSequence(seed)
    at, turned, tilted = poses_beside(chosen, room, CAMERA, step=1.0, turn=0.2, copies=4, seed=root)
    gap = np.linalg.norm(at[:, None] - places[None], axis=2).min(axis=1)
    assert gap.max() <= 0.5 + 1e-9
    assert np.linalg.norm(at - np.repeat(few, 4, axis=0), axis=1).max() <= 1.0 + 1e-9
    assert (tilted >= -90.0).all()
    assert (tilted <= 0.0).all()
    before = np.repeat(direction(yaw, pitch), 4, axis=0)
    cosine = (before * direction(turned, tilted)).sum(axis=1)
    assert cosine.min() >= np.cos(0.2) - 1e-9


def test_a_pool_holds_what_its_poses_show_however_it_came_about():
    mesh, samples, places = roof()
    rule = SightRule(d_min=3.0, d_max=22.0, max_incidence=1.4)
    caster = RayCaster(mesh)
    pairs = visible_pairs(places, samples, caster, rule)
    options = {"aims": 2, "directions": 30, "weights": np.ones(len(samples))}
    grid = Pool.of(generate_candidates(places, pairs, samples, CAMERA, **options))
    poses = grid.positions, grid.yaw_deg, grid.pitch_deg
    seen = {"samples": samples, "caster": caster, "camera": CAMERA, "rule": rule}
    again = Pool.at(*poses, **seen)
    rows = np.random.default_rng(0).permutation(len(grid))
    parts = grid.take(rows[:5]).joined(grid.take(rows[5:])).take(np.argsort(rows))
    for name in ("indptr", "sample", "distance", "cosine", "positions"):
        np.testing.assert_array_equal(getattr(grid, name), getattr(again, name))
        np.testing.assert_array_equal(getattr(grid, name), getattr(parts, name))
    back = samples.xyz[grid.sample] + grid.distance[:, None] * grid.rays(samples)
    owner = np.repeat(np.arange(len(grid)), np.diff(grid.indptr))
    np.testing.assert_allclose(back, grid.positions[owner], atol=1e-5)


def test_the_same_seed_gives_the_same_photos(selection):
    again = select().viewpoints
    for name in ("positions", "yaw_deg", "pitch_deg", "targets"):
        np.testing.assert_array_equal(getattr(selection.viewpoints, name), getattr(again, name))


def test_a_budget_bounds_the_photos_and_is_no_failure():
    few = select(budget=4)
    assert 1 <= len(few.viewpoints) <= 4
    assert not [finding for finding in few.findings if finding.partial]


@pytest.mark.parametrize("budget", [2, 3, 5, 8, 13])
def test_all_photos_of_a_budget_are_taken_and_match(budget):
    chosen = select(budget=budget, target=40.0, sharp_views=0)  # never enough
    assert len(chosen.viewpoints) == budget
    assert chosen.graph.firm


def test_more_photos_never_show_less():
    shares = [select(budget=budget).fulfilled for budget in (3, 5, 8, 12)]
    assert shares == sorted(shares)
    assert shares[-1] > shares[0]


def test_nothing_is_added_that_is_worth_nothing():
    everything = select(budget=60)
    assert everything.fulfilled == 1.0
    assert len(everything.viewpoints) < 60


def test_dropping_photos_makes_the_plan_partial(selection):
    mesh, samples, _ = roof()
    settings = ViewpointSettings(objective="reconstructability")
    left = selection.viewpoints.take(np.arange(2))
    after = reassess(selection, left, mesh, samples, CAMERA, settings=settings, **LIMITS)
    assert [finding.code for finding in after.findings if finding.partial] == ["samples-short"]
    assert after.reason_counts()["too-few-views"] > 0


@given(st.integers(2, 9), st.integers(0, 2**32 - 1))
def test_a_thinned_lattice_is_a_lattice_of_about_the_limit(factor, seed):
    axis = np.arange(12.0) * 2.5
    grid = np.stack(np.meshgrid(axis, axis, axis), -1).reshape(-1, 3)
    grid = grid[np.random.default_rng(seed).permutation(len(grid))]
    rows = thin_lattice(grid, spacing=2.5, limit=len(grid) // factor)
    assert len(grid) / factor * 0.8 <= len(rows) <= len(grid) / factor * 1.25
    kept = np.rint(grid[rows] / 2.5).astype(int)
    assert (np.diff(rows) > 0).all()
    points = set(map(tuple, kept))
    for first, second in itertools.islice(itertools.combinations(kept, 2), 50):
        third = 2 * second - first  # lattices go on
        if (third >= 0).all() and (third < 12).all():
            assert tuple(third) in points
    apart = np.linalg.norm(kept[:, None] - kept[None, : min(len(kept), 40)], axis=2)
    assert apart[apart > 0].min() ** 3 >= 0.5 * factor


def other_roof(seed, count=150):
    """Other samples of the roof."""
    rng = np.random.default_rng(seed)
    xyz = np.column_stack([rng.uniform((-6, -5), (6, 5), (count, 2)), np.full(count, 9.0)])
    up = np.tile([0.0, 0.0, 1.0], (count, 1))
    return SurfaceSamples(xyz, up, np.zeros(count), 1.25)


def subject_of(samples, **changes):
    rule = SightRule(d_min=3.0, d_max=22.0, max_incidence=1.2, reach=30.0)
    settings = ViewpointSettings(objective="reconstructability", **changes)
    sharp = np.full(len(samples), settings.sharp_views)
    return Subject.of(samples, RayCaster(roof()[0]), CAMERA, rule, settings, sharp=sharp)


def test_a_pool_widened_by_guards_is_the_pool_of_all_of_them():
    _, samples, places = roof()
    subject = subject_of(samples.places(np.arange(len(samples))))
    both = subject.guarded(other_roof(0))
    assert (both.planned, both.guards) == (len(samples), 150)
    rng = np.random.default_rng(1)
    poses = places[:40], rng.uniform(-180, 180, 40), rng.uniform(-90, 0, 40)
    wide = both.widened(subject.at(*poses), len(samples))
    whole = both.at(*poses)
    for name in ("indptr", "sample", "distance", "cosine"):
        np.testing.assert_array_equal(getattr(wide, name), getattr(whole, name))


def hunt_of(subject, places, guards):
    """A search that stands at a few photos of the roof's grid."""
    grid = subject.grid(places, spacing=4.0, limit=200)
    few = np.arange(0, len(grid), len(grid) // 8)
    return Hunt.begun(subject, grid, grid, None, chosen=few, guards=guards)


def test_slack_is_what_the_shares_leave_and_no_sample_is_counted_twice():
    settings = ViewpointSettings(share=0.9, floor_share=0.97)
    assert Slack.of(1000, 1000, settings) == Slack(weak=70, lost=30)
    assert Slack.of(1000, 1000, settings).below == 100
    assert Slack.of(1000, 2000, settings) == Slack(weak=40, lost=60)
    assert Slack.of(1000, 1000, settings.model_copy(update={"floor": 0.0})) == Slack(0, 100)
    low = settings.model_copy(update={"floor_share": 0.5})
    assert Slack.of(1000, 1000, low) == Slack(0, 100)
    assert Slack.of(9, 9, settings) == Slack(0, 0)


@pytest.mark.parametrize("floor", [0.0, 0.75])
@pytest.mark.parametrize("spare", [0.0, 0.05, 0.9])
def test_missed_guards_are_wanted_but_for_those_to_spare_and_never_sharply(spare, floor):
    _, samples, places = roof()
    given = {"sharp_views": 2, "floor": floor, "floor_share": 1.0 - spare}
    subject = subject_of(
        samples.places(np.arange(len(samples))), share=0.1 if floor else 1.0 - spare, **given
    )
    hunt = hunt_of(subject, places, other_roof(0))
    missed = subject.missed(hunt.guards, hunt.kept, hunt.many)
    assert 7 < len(missed.rows) < 150
    lost = Slack.of(150, 150, subject.settings).lost
    after = hunt.guarded()
    if np.count_nonzero(missed.lost) <= lost:
        assert after is hunt
        return
    assert after.wanted == hunt.wanted + len(missed.rows) - lost
    assert after.subject.guards == len(missed.rows)
    assert len(after.guards) == 150 - len(missed.rows)
    problem = after.subject.problem(after.many, wanted=after.wanted)
    assert problem.wanted == after.wanted
    assert (problem.fine_demand[len(samples) :] == 0).all()
    assert problem.fine_demand[: len(samples)].max() == 2
    np.testing.assert_array_equal(after.sharp[: len(samples)], hunt.sharp)
    again = after.guarded()  # the same photos miss no others
    assert again.wanted == after.wanted


def test_those_that_have_least_want_no_more_than_the_floor():
    _, samples, places = roof()
    settings = {"share": 0.8, "floor": 0.75, "floor_share": 0.95}
    subject = subject_of(samples.places(np.arange(len(samples))), **settings)
    hunt = hunt_of(subject, places, None)
    count = len(samples)
    assert hunt.slack == Slack(int(0.2 * count) - int(0.05 * count), int(0.05 * count))
    weak = hunt.subject.target < 4.0
    assert weak.sum() == hunt.slack.weak
    np.testing.assert_array_equal(hunt.subject.target, np.where(weak, 3.0, 4.0))
    np.testing.assert_array_equal(hunt.subject.sharp, np.where(weak, 0, hunt.sharp))
    value, fine = hunt.subject.shown(hunt.kept)
    order = np.lexsort((value, (value >= 4.0) & (fine >= hunt.sharp)))
    assert set(order[hunt.slack.lost : hunt.slack.below]) == set(np.flatnonzero(weak))
    assert hunt.wanted == count - hunt.slack.lost


@pytest.mark.parametrize("seed", range(3))
def test_no_more_samples_are_below_target_and_floor_than_the_shares_leave(seed):
    _, samples, places = roof()
    settings = {"share": 0.8, "floor": 0.75, "floor_share": 0.95, "sharp_views": 0}
    subject = subject_of(samples.places(np.arange(len(samples))), **settings)
    hunt = hunt_of(subject, places, None).searched(
        hunt_of(subject, places, None).many, None, iterations=200, seed=seed
    )
    value, _ = subject.shown(hunt.kept)
    assert np.count_nonzero(value < 4.0) <= hunt.slack.below
    assert np.count_nonzero(value < 3.0) <= hunt.slack.lost


@pytest.mark.parametrize("seed", range(3))
def test_shares_of_target_and_floor_hold_in_the_end_whatever_guards_there_are(seed):
    narrow = Camera(width_px=600, height_px=400, focal_px=700.0)
    given = {"share": 0.8, "floor": 0.75, "floor_share": 0.95, "sharp_views": 0, "connected": False}
    chosen = select(**given, camera=narrow, guards=other_roof(seed, 300), seed=seed)
    h, wish = chosen.reconstructability, chosen.wish.pairs
    assert np.mean(h[wish.reachable] >= 4.0) >= 0.8
    assert wish.floor.h == 3.0
    assert wish.floor.reached(h) == np.mean(h[wish.floor.reachable] >= 3.0) >= 0.95
    assert (wish.floor.reachable >= wish.reachable).all()
    codes = {finding.code for finding in chosen.findings}
    assert "samples-below-floor" not in codes


def test_a_floor_that_is_missed_is_a_finding_and_no_failure(selection):
    mesh, samples, _ = roof()
    settings = ViewpointSettings(objective="reconstructability")
    left = selection.viewpoints.take(np.arange(2))
    after = reassess(selection, left, mesh, samples, CAMERA, settings=settings, **LIMITS)
    (found,) = [item for item in after.findings if item.code == "samples-below-floor"]
    assert not found.partial
    assert found.number == after.wish.pairs.floor.reached(after.reconstructability) < 0.995


def test_samples_that_cannot_reach_the_target_want_the_floor():
    _, samples, places = roof()
    flat = samples.places(np.arange(len(samples)))
    best = subject_of(flat).shown(subject_of(flat).grid(places, spacing=4.0, limit=200))[0]
    between = float(np.median(best))
    subject = subject_of(flat, target=between, floor=0.5, share=1.0, sharp_views=0)
    hunt = hunt_of(subject, places, None)
    out_of_reach = ~hunt.firm
    assert 0 < out_of_reach.sum() < len(samples)
    np.testing.assert_array_equal(hunt.subject.target == 0.5 * between, out_of_reach)
    assert hunt.wanted == len(samples)


@given(st.lists(st.integers(0, 5), max_size=40), st.floats(0.01, 1.0))
def test_sharp_photos_are_wanted_where_they_are_easiest_to_have(available, share):
    available = np.array(available, dtype=np.int64)
    settings = ViewpointSettings(sharp_views=2, sharp_share=share)
    wanted = sharp_demand(available, settings).hits
    can = available > 0
    assert (wanted[~can] == 2).all()  # in vain, which is their reason
    assert (wanted[can] == 2).sum() == np.ceil(share * can.sum() - 1e-9)
    spared = can & (wanted == 0)
    if spared.any():
        assert available[spared].max() <= available[can & ~spared].min(initial=9)


def test_the_guards_that_photos_miss_are_those_below_the_target_that_others_could_show():
    mesh, samples, places = roof()
    subject, others = subject_of(samples, floor=0.75), other_roof(2)
    grid = subject.grid(places, spacing=4.0, limit=200)
    photos = grid.take(np.arange(0, len(grid), len(grid) // 6))
    views = photos.viewpoints(np.arange(len(photos)), samples, kind="pair")
    h = reconstructability(views, others, RayCaster(mesh), CAMERA, reference=60.0)
    missed = subject.missed(others, photos, grid)
    np.testing.assert_array_equal(missed.rows, np.flatnonzero(h < 4.0))
    np.testing.assert_array_equal(missed.lost, h[missed.rows] < 3.0)
    assert missed.firm.all()
    assert len(subject.missed(others, photos, photos).rows) == 0
    assert len(subject.missed(others, grid, grid).rows) == 0


def corners(count=200):
    """Samples near the four corners of the roof, which may be left out of a share of it."""
    rng = np.random.default_rng(3)
    side = rng.choice([-1.0, 1.0], (count, 2)) * rng.uniform((5.2, 4.2), (5.95, 4.95), (count, 2))
    up = np.tile([0.0, 0.0, 1.0], (count, 1))
    return SurfaceSamples(np.column_stack([side, np.full(count, 9.0)]), up, np.zeros(count), 1.25)


def test_photos_show_guards_that_they_would_miss():
    """With a narrow camera the corners of the roof are the share that may be left out."""
    mesh, samples, _ = roof()
    narrow = Camera(width_px=600, height_px=400, focal_px=700.0)
    given = {"share": 0.8, "camera": narrow, "sharp_views": 0, "connected": False, "floor": 0.0}
    plain, guarded = select(**given), select(**given, guards=corners())

    reference = 2.0 * LIMITS["gsd"] * narrow.focal_px

    def good(selection, what):
        views = selection.viewpoints
        h = reconstructability(views, what, RayCaster(mesh), narrow, reference=reference)
        return np.mean(h >= 4.0)

    assert good(plain, corners()) == 0.0
    assert good(guarded, corners()) >= 0.8
    for selection in (plain, guarded):
        possible = selection.wish.pairs.reachable
        assert good(selection, samples.places(np.flatnonzero(possible))) >= 0.8
    searched, completed = guarded.results
    assert (searched.solver, completed.solver) == ("lns", "greedy")
    assert completed.bound <= completed.cost == len(guarded.viewpoints)


def test_a_floor_lifts_what_the_share_leaves_out():
    """With a narrow camera the corners of the roof are the share that may be left out."""
    narrow = Camera(width_px=600, height_px=400, focal_px=700.0)
    given = {"share": 0.8, "camera": narrow, "sharp_views": 0, "connected": False}
    plain, lifted = select(**given, floor=0.0), select(**given, floor=0.75, floor_share=1.0)
    assert len(lifted.viewpoints) >= len(plain.viewpoints)
    assert np.mean(plain.reconstructability >= 3.0) < 0.95
    assert np.mean(lifted.reconstructability >= 3.0) == 1.0
    assert np.mean(lifted.reconstructability >= 4.0) >= 0.8


class Plugin:
    """A pair solver of someone else, which answers or stops in its n-th search."""

    name, requires, default_stop = "plug-in", (), Stop(iterations=10)

    def __init__(self, number, what):
        self.number, self.what, self.seen = number, what, []

    def run(self, problem, run):
        self.seen.append(run.initial is not None)
        if len(self.seen) == self.number:
            if self.what == "nothing":
                return Status.UNKNOWN
            raise KeyboardInterrupt
        return load("pairs", "lns").run(problem, run)


@pytest.fixture
def plugin(monkeypatch):
    def install(number, what):
        solver = Plugin(number, what)
        own = subjects.load
        monkeypatch.setattr(
            subjects,
            "load",
            lambda family, name, **options: (
                solver if name == "plug-in" else own(family, name, **options)
            ),
        )
        return solver

    return install


@pytest.mark.parametrize("number", [1, 2, 4])
def test_an_interrupted_search_ends_the_choice(plugin, number):
    plugin(number, "interrupt")
    with pytest.raises(KeyboardInterrupt):
        select(pair_solver="plug-in")


def test_other_solvers_begin_with_the_photos_so_far_and_may_fail_later_but_not_at_first(plugin):
    solver = plugin(3, "nothing")
    assert select(pair_solver="plug-in").reconstructable(4.0) >= 0.98
    assert solver.seen == [False, *solver.seen[1:]]
    assert len(solver.seen) == 4
    assert any(solver.seen)
    plugin(1, "nothing")
    with pytest.raises(PlannerError, match=r"pair_solver = 'plug-in'.*found no photos in"):
        select(pair_solver="plug-in")
