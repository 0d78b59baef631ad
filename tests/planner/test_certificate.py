"""The certificate against dense sampling of solids with exact distances."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.flight.certificate import DEPTH, certify
from planner.geometry import bezier


def least_clearance(controls, space, spacing=0.02):
    """Brute force: the smallest clearance of points at most ``spacing`` apart."""
    count = int(bezier.polygon_length(controls) / spacing) * 2 + 2
    points = bezier.evaluate(controls[None], np.linspace(0.0, 1.0, count))
    return float(space.clearance(points).min())


def random_town(solids, seed, d_min=2.0):
    rng = np.random.default_rng(seed)
    low = np.column_stack([rng.uniform(-40, 40, (12, 2)), np.zeros(12)])
    size = rng.uniform((4, 4, 5), (14, 14, 30), (12, 3))
    balls = np.column_stack([rng.uniform(-40, 40, (5, 2)), rng.uniform(5, 30, 5), np.full(5, 2.0)])
    return solids(np.stack([low, low + size], axis=1), balls, ground=0.0, d_min=d_min)


def random_pieces(seed, count=40):
    rng = np.random.default_rng(seed)
    start = rng.uniform((-45, -45, 3), (45, 45, 40), (count, 3))
    end = start + rng.normal(0, 12, (count, 3))
    bend = rng.normal(0, 3, (count, 2, 3))
    return np.stack(
        [start, (2 * start + end) / 3 + bend[:, 0], (start + 2 * end) / 3 + bend[:, 1], end], 1
    )


def test_exact_solids_agree_with_dense_sampling(solids):
    space = random_town(solids, 0)
    rng = np.random.default_rng(1)
    for a, b in rng.uniform((-45, -45, 3), (45, 45, 40), (200, 2, 3)):
        fine = space.clearance(a + np.linspace(0, 1, 4001)[:, None] * (b - a)).min()
        exact = space.segment_distance(a, b)
        step = np.linalg.norm(b - a) / 4000
        assert max(fine, 0.0) - step <= max(exact, 0.0) <= max(fine, 0.0) + 1e-9


def test_never_claims_more_than_there_is_and_refuses_nothing_that_is_clearly_safe(solids):
    losses, safe, unsafe = [], 0, 0
    for seed in range(12):
        space, pieces = random_town(solids, seed), random_pieces(seed)
        certificate = certify(pieces, space)
        for piece, good, bound in zip(pieces, certificate.safe, certificate.clearance, strict=True):
            true = least_clearance(piece, space)
            if good:
                safe += 1
                assert space.d_min <= bound <= true + 1e-9
                losses.append((true - bound) / space.d_min)
            else:
                unsafe += 1
                assert true < space.d_min + 1e-3
    assert safe > 100
    assert unsafe > 100
    assert np.mean(losses) <= 0.10


@given(st.floats(-0.5, 0.5), st.floats(0.0, 8.0))
@settings(max_examples=150, deadline=None)
def test_a_curve_that_grazes_is_proven_or_refused_by_the_exact_limit(solids, gap, arch):
    space = solids(balls=[(0, 0, 0, 3.0)], d_min=2.0)
    height = 5.0 + gap
    piece = np.array(
        [[-10, 0, height + arch], [-3, 0, height], [3, 0, height], [10, 0, height + arch]]
    )
    piece[1:3, 2] -= arch / 3.0  # its lowest point stays at the height of the gap
    true = least_clearance(piece, space)
    certificate = certify(piece[None], space)
    if true < 2.0:
        assert not certificate.safe[0]
    elif true > 2.0 + 1e-4:
        assert certificate.safe[0]
        assert certificate.clearance[0] <= true + 1e-9


def test_a_curve_that_bows_into_a_wall_between_its_ends_is_refused(solids):
    wall = solids([((5, -20, 0), (6, 20, 20))], d_min=2.0)
    chord_free = np.array([[0.0, -10, 5], [6, -3, 5], [6, 3, 5], [0, 10, 5]])
    assert wall.capsule_clearance_at_least(chord_free[0], chord_free[3], 2.0)
    assert not certify(chord_free[None], wall).safe[0]
    assert certify(bezier.straight(chord_free[:1], chord_free[3:]), wall).safe[0]


def test_a_needle_thin_solid_between_the_samples_is_found(solids):
    mast = solids([((-1e-4, -1e-4, 0), (1e-4, 1e-4, 40))], d_min=0.05)
    for offset in np.linspace(-0.0499, 0.0499, 11):
        piece = bezier.straight(np.array([[-37.0, offset, 9]]), np.array([[41.0, offset, 9]]))
        assert not certify(piece, mast).safe[0]
    clear = bezier.straight(np.array([[-37.0, 0.06, 9]]), np.array([[41.0, 0.06, 9]]))
    assert certify(clear, mast).safe[0]


def test_a_solid_that_no_sampled_point_meets_is_refused_all_the_same(solids):
    """A wire's end midway between the last two points that are looked at, in the way of a line."""
    space = solids(balls=[(0.0, 0.0, 0.0, 1e-6)], d_min=0.05)
    part = 0.16
    first, last = -part * (2**DEPTH + 0.5), part * (2**DEPTH - 0.5)  # ends of parts at +-0.08
    for beside, safe in ((0.049, False), (5.0, True)):
        ends = np.array([[first, beside, 0.0], [last, beside, 0.0]])
        points = np.linspace(*ends, 2 ** (DEPTH + 1) + 1)
        assert space.clearance(points).min() > 0.09
        assert certify(bezier.straight(*ends[:, None]), space).safe[0] == safe


def test_the_inside_of_a_solid_is_never_safe_however_far_its_surface(solids):
    block = solids([((-30, -30, -30), (30, 30, 30))], d_min=2.0)
    inside = bezier.straight(np.array([[-5.0, 0, 0]]), np.array([[5.0, 0, 0]]))
    certificate = certify(inside, block)
    assert not certificate.safe[0]
    assert certificate.clearance[0] == -np.inf


def test_a_ceiling_is_kept_and_its_margin_is_a_lower_bound(solids):
    space = solids(ground=0.0, ceiling=20.0, d_min=2.0)
    arch = np.array([[[0.0, 0, 15], [3, 0, 23], [6, 0, 23], [9, 0, 15]]])
    assert not certify(arch, space).safe[0]  # it reaches 21 m
    arch[0, 1:3, 2] = 21.0  # now 19.5 m
    certificate = certify(arch, space)
    assert certificate.safe[0]
    assert 0.5 - 0.081 <= certificate.zone_margin[0] <= 0.5 + 1e-12
    assert np.isinf(certify(arch, solids(ground=0.0)).zone_margin[0])


def test_where_names_the_place_of_the_smallest_clearance(solids):
    space = solids(balls=[(1.0, 0, 0, 1.0)], d_min=2.0)
    piece = bezier.straight(np.array([[-20.0, 5, 0]]), np.array([[20.0, 5, 0]]))
    certificate = certify(piece, space)
    assert certificate.seen[0] == pytest.approx(4.0, abs=0.1)
    assert np.abs(certificate.where[0] - [1, 5, 0]).max() < 1.0


def test_points_that_are_no_numbers_are_refused(solids):
    piece = bezier.straight(np.array([[0.0, 0, 9]]), np.array([[5.0, 0, np.nan]]))
    assert not certify(piece, solids(ground=0.0)).safe[0]


def test_no_pieces_and_pieces_without_length(solids):
    space = solids(ground=0.0, d_min=2.0)
    assert certify(np.zeros((0, 4, 3)), space).safe.shape == (0,)
    still = np.tile([[[1.0, 2, 9]]], (1, 4, 1))
    assert certify(still, space).clearance[0] == pytest.approx(9.0, abs=0.081)
    still[..., 2] = 1.0
    assert not certify(still, space).safe[0]


def test_rows_do_not_depend_on_their_company(solids):
    space, pieces = random_town(solids, 3), random_pieces(3)
    together = certify(pieces, space)
    for row in range(len(pieces)):
        alone = certify(pieces[row : row + 1], space)
        assert alone.safe[0] == together.safe[row]
        assert alone.clearance[0] == together.clearance[row]
