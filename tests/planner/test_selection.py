"""Chosen viewpoints: candidates, demands met, reasons, and the paper's marks."""

import pickle
import re
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest

from planner.config import ViewpointSettings
from planner.scene.cloud import Mesh
from planner.surface.samples import ScoredSamples
from planner.viewpoints import select as select_module
from planner.viewpoints.camera import Camera
from planner.viewpoints.candidates import aim_directions, generate_candidates
from planner.viewpoints.completion import complete_cover
from planner.viewpoints.cover import cover_candidates, photo_prices
from planner.viewpoints.demand import Demand, view_demand
from planner.viewpoints.frustum import camera_axes, in_frustum
from planner.viewpoints.pairs import visible_pairs
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.reasons import REASONS, Reason
from planner.viewpoints.select import reassess, select_viewpoints
from planner.viewpoints.sight import SightRule
from planner.viewpoints.visibility import coverage
from solvers.result import Result

CAMERA = Camera(width_px=600, height_px=400, focal_px=400.0)
LIMITS = {"d_min": 3.0, "d_max": 22.0, "gsd": 30.0 / 400.0}
BLOCK = np.array([[-6.0, -5.0, 0.0], [6.0, 5.0, 9.0]])
VOXEL = 4.0


def block_mesh():
    """A block on a ground of 60 m."""
    x, y, z = BLOCK.T
    corners = np.array([[x[i], y[j], z[k]] for k in (0, 1) for j in (0, 1) for i in (0, 1)])
    faces = [[0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5], [4, 5, 7, 6]]
    ground = np.array([[-30, -30, 0], [30, -30, 0], [30, 30, 0], [-30, 30, 0]], dtype=float)
    triangles = [[f[0], f[1], f[2]] for f in faces] + [[f[0], f[2], f[3]] for f in faces]
    return Mesh(np.vstack([corners, ground]), [*triangles, [8, 9, 10], [8, 10, 11]])


def block_samples(spacing=1.5):
    """Facades, roof and the ground around, four clusters by quarter."""
    low, high = BLOCK
    faces = []
    for axis, side in ((0, 0), (0, 1), (1, 0), (1, 1), (2, 1)):
        normal = np.zeros(3)
        normal[axis] = 2.0 * side - 1.0
        spans = [np.arange(low[k] + 0.7, high[k], spacing) for k in range(3)]
        spans[axis] = np.array([BLOCK[side, axis]])
        faces.append((np.stack(np.meshgrid(*spans), -1).reshape(-1, 3), normal))
    ring = np.stack(np.meshgrid(*[np.arange(-12.0, 12.1, spacing)] * 2), -1).reshape(-1, 2)
    ring = ring[(np.abs(ring) > high[:2] + 0.5).any(axis=1)]
    faces.append((np.column_stack([ring, np.zeros(len(ring))]), np.array([0.0, 0.0, 1.0])))
    xyz = np.concatenate([points for points, _ in faces])
    normals = np.concatenate([np.broadcast_to(n, p.shape) for p, n in faces])
    cluster = 2 * (xyz[:, 0] > 0) + (xyz[:, 1] > 0)
    quality = np.random.default_rng(4).uniform(0, 1, len(xyz))
    return ScoredSamples(xyz, normals, cluster, spacing, quality, quality, quality)


def free_positions(top=24.0):
    axis = np.arange(-22.0, 22.1, VOXEL)
    grid = np.stack(np.meshgrid(axis, axis, np.arange(3.0, top, VOXEL)), -1).reshape(-1, 3)
    away = np.maximum(np.maximum(BLOCK[0] - grid, grid - BLOCK[1]), 0.0)
    return grid[np.linalg.norm(away, axis=1) >= LIMITS["d_min"]]


MESH, SAMPLES, POSITIONS = block_mesh(), block_samples(), free_positions()


def select(**changes):
    options = {name: changes.pop(name) for name in ("map", "seed") if name in changes}
    samples, positions = changes.pop("samples", SAMPLES), changes.pop("positions", POSITIONS)
    mesh, camera = changes.pop("mesh", MESH), changes.pop("camera", CAMERA)
    settings = ViewpointSettings(**{"objective": "hits", **changes})
    return select_viewpoints(
        positions, mesh, samples, camera, settings=settings, voxel=VOXEL, **LIMITS, **options
    )


@pytest.fixture(scope="module")
def pairs():
    rule = SightRule.of(CAMERA, ViewpointSettings(), **LIMITS)
    return visible_pairs(POSITIONS, SAMPLES, RayCaster(MESH), rule)


def test_aim_directions_are_spread_over_the_gimbals_range():
    camera = Camera(pitch_min_deg=-90.0, pitch_max_deg=0.0)
    yaw, pitch = aim_directions(62, camera)
    forward = camera_axes(yaw, pitch)[:, 2]
    assert pitch[0] == -90.0
    assert ((pitch >= -90.0) & (pitch <= 0.0)).all()
    assert ((yaw > -180.0) & (yaw <= 180.0)).all()
    nearest = np.degrees(np.arccos(np.sort(forward @ forward.T, axis=1)[:, -2].clip(-1, 1)))
    assert nearest.min() > 5.0
    rng = np.random.default_rng(0)
    probe = rng.normal(size=(2000, 3))
    probe[:, 2] = -np.abs(probe[:, 2])
    probe /= np.linalg.norm(probe, axis=1, keepdims=True)
    assert np.degrees(np.arccos((probe @ forward.T).max(axis=1))).max() < 20.0


def test_each_candidate_holds_exactly_what_is_in_its_picture(pairs):
    weights = np.random.default_rng(0).integers(1, 9, len(SAMPLES)) / 8
    got = generate_candidates(
        POSITIONS, pairs, SAMPLES, CAMERA, aims=3, directions=40, weights=weights
    )
    for k in range(0, len(got), 7):
        at = np.arange(pairs.indptr[got.owner[k]], pairs.indptr[got.owner[k] + 1])
        rays = SAMPLES.xyz[pairs.sample[at]] - POSITIONS[got.owner[k]]
        inside = in_frustum(rays, got.yaw_deg[k], got.pitch_deg[k], CAMERA)
        np.testing.assert_array_equal(got.row(k), at[inside])


def test_aims_are_the_greedy_choice_of_brute_force(pairs):
    weights = np.random.default_rng(0).integers(1, 9, len(SAMPLES)) / 8
    got = generate_candidates(
        POSITIONS, pairs, SAMPLES, CAMERA, aims=3, directions=40, weights=weights
    )
    yaw, pitch = aim_directions(40, CAMERA)
    for place in range(0, len(POSITIONS), 23):
        seen = pairs.sample[pairs.indptr[place] : pairs.indptr[place + 1]]
        rays = SAMPLES.xyz[seen] - POSITIONS[place]
        inside = np.array([in_frustum(rays, y, p, CAMERA) for y, p in zip(yaw, pitch, strict=True)])
        left, expected = np.ones(len(seen), dtype=bool), []
        for _ in range(3):
            worth = (inside & left) @ weights[seen]
            if worth.max() < 1e-9:
                break
            expected.append(int(np.argmax(worth)))
            left &= ~inside[expected[-1]]
        mine = np.flatnonzero(got.owner == place)
        np.testing.assert_array_equal(got.yaw_deg[mine], yaw[expected])
        np.testing.assert_array_equal(got.pitch_deg[mine], pitch[expected])


def test_prices_follow_the_mean_confidence(pairs):
    settings = ViewpointSettings(confidence_price=0.5)
    demand = view_demand(SAMPLES.quality, settings)
    candidates = cover_candidates(
        POSITIONS, pairs, SAMPLES, CAMERA, demand=demand, settings=settings
    )
    got = photo_prices(candidates, settings=settings, d_min=3.0, d_max=22.0)
    assert ((got >= 1.0) & (got <= 1.5)).all()
    row = candidates.row(5)
    distance, cosine = pairs.distance[row].astype(float), pairs.cosine[row].astype(float)
    confidence = (1 - ((distance - 12.5) / 9.5) ** 2) * np.exp(
        -(((1 - cosine) / (1 - np.cos(np.radians(30)))) ** 2)
    )
    assert got[5] == pytest.approx(1 + 0.5 * (1 - confidence.mean()), abs=1e-6)


def test_every_demand_that_the_positions_allow_is_met_by_fresh_rays(pairs):
    selection = select()
    demand = view_demand(SAMPLES.quality, ViewpointSettings())
    again = coverage(
        selection.viewpoints, MESH, SAMPLES, CAMERA, settings=ViewpointSettings(), **LIMITS
    )
    assert (again.hits >= np.minimum(demand.hits, pairs.available)).all()
    assert (again.sectors >= np.minimum(demand.sectors, pairs.sides)).all()
    np.testing.assert_array_equal(again.hits, selection.hits)
    np.testing.assert_array_equal(again.sectors, selection.sectors)
    assert not [finding for finding in selection.findings if finding.partial]


def test_fresh_rays_agree_with_the_solvers_matrix(pairs):
    """The hits and sectors of the chosen rows, counted without rays, are the same."""
    settings = ViewpointSettings()
    demand = view_demand(SAMPLES.quality, settings)
    candidates = cover_candidates(
        POSITIONS, pairs, SAMPLES, CAMERA, demand=demand, settings=settings
    )
    selection = select(connected=False)
    rows = np.concatenate([candidates.row(k) for k in selection.results[0].solution])
    hits = np.bincount(pairs.sample[rows], minlength=len(SAMPLES))
    np.testing.assert_array_equal(hits, selection.hits)
    seen = np.zeros((len(SAMPLES), 8), dtype=bool)
    seen[pairs.sample[rows], pairs.sector[rows]] = True
    np.testing.assert_array_equal(seen.sum(axis=1), selection.sectors)


def test_one_photo_a_place_and_a_target_in_each_picture():
    views = select().viewpoints
    assert len(np.unique(views.positions, axis=0)) == len(views)
    aimed = views.take(np.flatnonzero(views.targets >= 0))
    rays = SAMPLES.xyz[aimed.targets] - aimed.positions
    assert in_frustum(rays, aimed.yaw_deg, aimed.pitch_deg, CAMERA).all()
    assert (views.pitch_deg >= CAMERA.pitch_min_deg).all()
    assert (views.pitch_deg <= CAMERA.pitch_max_deg).all()
    assert set(views.kind) == {"cover", "bridge"}
    assert (np.array(views.kind)[views.targets < 0] == "bridge").all()


def test_photos_are_added_until_the_view_graph_is_firm():
    loose, firm = select(connected=False), select()
    assert not loose.graph.firm
    assert firm.graph.firm
    assert not [finding for finding in firm.findings if finding.code.startswith("photos")]
    assert len(firm.viewpoints) <= 1.2 * len(loose.viewpoints)


def test_the_same_seed_gives_the_same_viewpoints():
    first, second = select(seed=3).viewpoints, select(seed=3).viewpoints
    for name in ("positions", "yaw_deg", "pitch_deg", "targets"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))


def test_the_exact_solver_proves_how_good_greedy_is():
    few = SAMPLES.xyz[:, 2] > 8.9  # the roof alone
    roof = ScoredSamples(
        *(SAMPLES.xyz[few], SAMPLES.normals[few], SAMPLES.cluster[few], SAMPLES.radius),
        *(SAMPLES.completeness[few], SAMPLES.smoothness[few], SAMPLES.quality[few]),
    )
    greedy, exact = (select(samples=roof, aims=1, solver=name) for name in ("greedy", "cvxpy"))
    assert exact.results[0].status == "optimal"
    assert exact.results[0].cost <= greedy.results[0].cost + 1e-9
    assert exact.results[0].bound == pytest.approx(exact.results[0].cost, rel=1e-5)
    assert exact.reason_counts()["covered"] == len(roof)


def test_low_quality_wants_more_and_equal_quality_does_not():
    settings = ViewpointSettings(hits=3, extra_hits=2, low_quality_share=0.25)
    quality = np.arange(100) / 99
    np.testing.assert_array_equal(
        view_demand(quality, settings).hits, np.where(np.arange(100) < 25, 5, 3)
    )
    np.testing.assert_array_equal(view_demand(np.full(10, 0.5), settings).hits, 3)
    half_zero = np.repeat([0.0, 1.0], 50)
    np.testing.assert_array_equal(view_demand(half_zero, settings).hits, np.repeat([5, 3], 50))


def test_where_one_photo_a_place_leads_nowhere_places_give_several(monkeypatch):
    """Conflicts are dropped, photos from one place count once, every demand is still met."""
    refused = []

    def no_conflicts(problem, *args, **options):
        result = solve(problem, *args, **options)
        if problem.conflicts:
            refused.append(result)
            return Result(**{**_fields(result), "solution": None, "cost": np.inf})
        return result

    solve = select_module.solve
    monkeypatch.setattr(select_module, "solve", no_conflicts)
    selection = select()
    assert refused
    assert (selection.hits >= selection.wish.reachable.hits).all()
    assert (selection.sectors >= selection.wish.reachable.sectors).all()
    assert len(selection.results) == 2


def _fields(result):
    return {name: getattr(result, name) for name in Result.__dataclass_fields__}


def test_completion_from_nothing_meets_every_reachable_demand(pairs):
    settings = ViewpointSettings()
    demand = view_demand(SAMPLES.quality, settings)
    candidates = cover_candidates(
        POSITIONS, pairs, SAMPLES, CAMERA, demand=demand, settings=settings
    )
    rows = complete_cover(
        candidates, np.empty(0, dtype=np.int64), demand=demand, prices=np.ones(len(candidates))
    )
    views = candidates.viewpoints(rows, SAMPLES, kind="cover")
    got = coverage(views, MESH, SAMPLES, CAMERA, settings=settings, **LIMITS)
    reachable = demand.clipped(pairs.available, pairs.sides)
    assert (got.hits >= reachable.hits).all()
    assert (got.sectors >= reachable.sectors).all()


def test_dropping_viewpoints_shows_in_hits_reasons_and_findings():
    selection = select()
    left = selection.viewpoints.take(np.arange(len(selection.viewpoints) // 2))
    options = {"settings": ViewpointSettings(), **LIMITS}
    after = reassess(selection, left, MESH, SAMPLES, CAMERA, **options)
    assert (after.hits <= selection.hits).all()
    assert after.reason_counts()["covered"] < selection.reason_counts()["covered"]
    assert [f.code for f in after.findings if f.partial] == ["samples-short"]
    same = reassess(after, selection.viewpoints, MESH, SAMPLES, CAMERA, **options)
    np.testing.assert_array_equal(same.reason, selection.reason)


def test_nowhere_to_fly_is_a_result_with_reasons():
    for preset in ("cover", "paper", "smith"):
        selection = select(positions=np.empty((0, 3)), preset=preset)
        assert len(selection.viewpoints) == 0
        assert (selection.reason == Reason.NO_FREE_POSITION).all()


def short(selection):
    """The finding on samples that fall short, and the share that its sentence tells."""
    (finding,) = [found for found in selection.findings if found.code == "samples-short"]
    return finding, float(
        re.search(r"; ([\d.]+) % of what can be reconstructed", finding.message)[1]
    )


def test_photos_of_smith_are_judged_by_what_they_reconstruct():
    selection = select(preset="smith", views=24, rounds=2)
    good = selection.reconstructability >= 4.0
    np.testing.assert_array_equal(selection.reason == Reason.COVERED, good)
    possible = selection.wish.pairs.reachable
    assert 0.2 < good.mean() < 0.97
    assert possible[good].all()
    assert selection.fulfilled == good[possible].mean()
    finding, share = short(selection)
    assert finding.number == np.count_nonzero(possible & ~good)
    assert share == pytest.approx(100.0 * selection.fulfilled, abs=0.06)


def test_smith_promises_the_share_only_if_the_number_of_photos_is_not_given():
    given = select(preset="smith", views=24, rounds=1)
    assert not short(given)[0].partial
    assert "are wanted" not in short(given)[0].message
    free = select(preset="smith", rounds=1, share=1.0)
    assert short(free)[0].partial
    assert "where 100 % are wanted" in short(free)[0].message
    easy = select(preset="smith", rounds=1, share=0.01)
    assert not [finding for finding in easy.findings if finding.partial]


@pytest.mark.parametrize(
    "given",
    [{"preset": "smith", "views": 1}, {"objective": "reconstructability", "budget": 1}],
)
def test_photos_that_reconstruct_nothing_are_no_complete_answer(given):
    selection = select(**given)
    assert len(selection.viewpoints) == 1
    assert selection.fulfilled == 0.0
    finding, share = short(selection)
    assert (share, finding.partial) == (0.0, True)


def test_the_paper_says_that_its_marks_are_no_views():
    selection = select(preset="paper")
    (finding,) = [found for found in selection.findings if found.code == "samples-short"]
    assert not finding.partial
    assert finding.number == np.count_nonzero(selection.hits < selection.wish.reachable.hits)
    assert finding.message.endswith(
        "the paper's marks count what is near a photo's target, seen or not"
    )


def hand_placed(xyz, normal):
    one = np.ones(1)
    return ScoredSamples([xyz], [normal], [0], 1.0, one, one, one)


UP, DOWN, EAST = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("sample", "positions", "reason"),
    [
        (((0, 0, 9), UP), [(0, 0, 18), (5, 0, 18), (-5, 0, 18)], "covered"),
        (((0, 0, 9), UP), [(0, 0, 18), (5, 0, 18)], "too-few-views"),
        (((0, 0, 9), UP), [(0, 0, 18), (0.1, 0, 18), (0, 0.1, 18)], "parallax"),
        (((0, 0, 9), UP), [(0, 0, 35)], "no-free-position"),  # out of range
        (((0, 0, 9), UP), [(0, 10, 10)], "no-free-position"),  # grazing
        (((0, 0, 9), UP), [(17, 0, 19), (-17, 0, 19)], "gsd"),  # 20 m at 60 degrees
        (((6, 0, 4), EAST), [(-9, 0, 10)], "no-free-position"),  # only from behind
        (((8, 0, 0), UP), [(-4, 0, 12)], "occluded"),  # the block is in between
        (((0, 20, 8), DOWN), [(0, 22, 3)], "gimbal"),  # an underside, only from below
    ],
)
def test_reasons_of_hand_placed_samples(sample, positions, reason):
    got = select(samples=hand_placed(*sample), positions=np.array(positions, dtype=float))
    assert got.reasons[got.reason[0]] == reason


def test_every_sample_has_a_reason_and_the_counts_add_up():
    selection = select(positions=POSITIONS[::40])
    counts = selection.reason_counts()
    assert tuple(counts) == REASONS
    assert sum(counts.values()) == len(SAMPLES)
    assert counts["covered"] < len(SAMPLES)


# The paper's preset


def marks_of(views, samples=SAMPLES):
    """Scanned marks by the paper's radius rule, without any shared code."""
    spread = np.sin(0.5 * CAMERA.vertical_fov)
    marks = np.zeros(len(samples), dtype=int)
    for position, target in zip(views.positions, views.targets, strict=True):
        radius = np.linalg.norm(position - samples.xyz[target]) * spread
        marks += np.linalg.norm(samples.xyz - samples.xyz[target], axis=1) <= radius
    return marks


@pytest.mark.parametrize("changes", [{}, {"local_views": "each"}, {"exclusion_voxels": 3}])
def test_marks_reach_two_for_every_sample_that_two_places_see(changes, pairs):
    views = select(preset="paper", **changes).viewpoints
    reachable = pairs.available >= 2  # stricter than the preset's own rule
    assert (marks_of(views)[reachable] >= 2).all()
    assert set(views.kind) <= {"local", "global"}


def test_viewpoints_of_the_paper_aim_at_their_targets():
    views = select(preset="paper").viewpoints
    rays = SAMPLES.xyz[views.targets] - views.positions
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    np.testing.assert_allclose(np.einsum("ij,ij->i", rays, views.directions), 1.0, atol=1e-9)
    assert (rays[:, 2] <= 1e-9).all()  # it never looks up


def test_global_views_keep_their_distance_while_there_is_room():
    views = select(preset="paper", score_threshold=0.0).viewpoints
    apart = np.abs(views.positions[:, None] - views.positions[None]).max(axis=2)
    np.fill_diagonal(apart, np.inf)
    assert (apart.min(axis=1) > VOXEL * 1.001).mean() > 0.8


def test_as_printed_every_low_quality_sample_gets_its_own_local_view():
    views = select(preset="paper", local_views="each", score_threshold=0.1).viewpoints
    local = [t for t, kind in zip(views.targets, views.kind, strict=True) if kind == "local"]
    assert len(set(local)) == len(local)
    wanted = np.flatnonzero(SAMPLES.quality < 0.1)
    assert len(local) >= 0.9 * len(wanted)  # two clusters may have wanted the same place
    assert set(local) <= set(wanted)


def backwards(function, jobs):
    """Like a pool of processes with its own order: arguments and results are pickled."""
    done = [
        pickle.dumps(function(pickle.loads(pickle.dumps(job))))  # noqa: S301
        for job in reversed(list(jobs))
    ]
    return [pickle.loads(part) for part in reversed(done)]  # noqa: S301


def test_workers_and_their_order_do_not_change_the_viewpoints():
    first, second = select(preset="paper"), select(preset="paper", map=backwards)
    for name in ("positions", "yaw_deg", "pitch_deg", "targets", "kind"):
        np.testing.assert_array_equal(
            getattr(first.viewpoints, name), getattr(second.viewpoints, name)
        )


def test_demand_is_clipped_to_what_can_be_had():
    demand = Demand(np.array([3, 4, 3]), np.array([2, 2, 2]))
    got = demand.clipped(np.array([5, 2, 0]), np.array([1, 3, 0]))
    assert got.hits.tolist() == [3, 2, 0]
    assert got.sectors.tolist() == [1, 2, 0]


@pytest.mark.slow
def test_a_pool_of_two_processes_gives_the_same_viewpoints():
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        second = select(preset="paper", map=pool.map).viewpoints
    first = select(preset="paper").viewpoints
    np.testing.assert_array_equal(first.positions, second.positions)
    np.testing.assert_array_equal(first.yaw_deg, second.yaw_deg)


def test_nothing_to_see_needs_no_photos():
    nothing = ScoredSamples(*[np.empty((0, 3))] * 2, np.empty(0), 1.0, *[np.empty(0)] * 3)
    for preset in ("cover", "paper", "smith"):
        selection = select(samples=nothing, preset=preset)
        assert len(selection.viewpoints) == 0
        assert selection.findings == ()
