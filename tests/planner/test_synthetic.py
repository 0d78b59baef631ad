"""Made-up town blocks: sound as geometry, varied, repeatable, and seen as from a first flight."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from trimesh.triangles import closest_point

from planner.scene.cloud import Mesh
from planner.scene.first_flight import MOST_SIGMAS, NadirFlight, ray_scene
from planner.scene.sampling import sample_mesh, triangle_normals
from planner.scene.synthetic import scene_of, synthetic_block, synthetic_scene
from planner.scene.town.building import Kind
from planner.scene.town.inside import inside

SEEDS = st.integers(0, 2**63)


@pytest.fixture(scope="module")
def block():
    return synthetic_block(7)


def volumes(block):
    """Volume of each part by the divergence theorem; the ground's is meaningless."""
    a, b, c = np.moveaxis(block.mesh.vertices[block.mesh.triangles], 1, 0)
    return np.bincount(block.parts, np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0)


def assert_sound(block):
    triangles = block.mesh.triangles[block.parts > 0]
    edges = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    count = len(block.mesh.vertices)
    there, back = edges @ [count, 1], edges @ [1, count]
    assert len(np.unique(there)) == len(there)  # each directed edge once ...
    np.testing.assert_array_equal(np.sort(there), np.sort(back))  # ... and once the other way
    assert volumes(block)[1:].min() > 1e-3
    normals, areas = triangle_normals(block.mesh)
    assert areas.min() > 1e-6
    assert normals[block.parts == 0, 2].min() > 0.8


@settings(max_examples=40, deadline=None)
@given(seed=SEEDS)
@example(seed=0)
def test_every_seed_gives_closed_outward_solids_on_a_ground_that_faces_up(seed):
    block = synthetic_block(seed, spacing=None)
    assert_sound(block)
    assert 5 <= block.buildings.max() + 1 <= 40
    assert set(np.unique(block.kinds)) >= set(Kind) - {Kind.COURTYARD, Kind.BALCONY}


@settings(max_examples=25, deadline=None)
@given(
    seed=SEEDS,
    size=st.none() | st.tuples(st.floats(40, 200), st.floats(40, 200)),
    buildings=st.none() | st.integers(1, 9),
    heights=st.tuples(st.floats(3, 30), st.floats(3, 60)).map(sorted),
    extras=st.tuples(st.booleans(), st.booleans()),
)
def test_every_option_gives_a_sound_place_within_its_limits(seed, size, buildings, heights, extras):
    bridge, trees = extras
    block = synthetic_block(
        seed,
        size=size,
        buildings=buildings,
        heights=tuple(heights),
        relief=0.0,
        turn=0.0,
        bridge=bridge,
        trees=trees,
        spacing=None,
    )
    assert_sound(block)
    numbers = block.buildings[block.buildings >= 0]
    assert buildings is None or set(numbers) == set(range(buildings))
    tops = np.full(numbers.max() + 1, -np.inf)
    highest = block.mesh.vertices[block.mesh.triangles][..., 2].max(axis=1)
    np.maximum.at(tops, numbers, highest[block.buildings >= 0])
    assert (tops >= heights[0] - 1e-9).all()
    assert (tops <= heights[1] + 1e-9).all()
    extent = np.ptp(block.mesh.vertices[:, :2], axis=0)
    assert size is None or extent == pytest.approx(size)  # nothing sticks out over the rim
    streets = bool((block.kinds == Kind.STREET).any())
    assert (block.kinds == Kind.BRIDGE).any() == (bridge and streets)
    assert (block.kinds == Kind.CROWN).any() <= trees


def test_the_same_seed_gives_the_same_bytes_and_another_seed_another_place(block):
    again, other = synthetic_block(7), synthetic_block(8)
    for a, b in (
        (block.mesh.vertices, again.mesh.vertices),
        (block.mesh.triangles, again.mesh.triangles),
        (block.cloud.xyz, again.cloud.xyz),
        (block.cloud.colours, again.cloud.colours),
        (block.cloud.classes, again.cloud.classes),
        (block.cameras, again.cameras),
        (block.kinds, again.kinds),
    ):
        assert a.tobytes() == b.tobytes()
    assert scene_of(block).sha256 == scene_of(again).sha256 != scene_of(other).sha256
    assert len(other.mesh) != len(block.mesh)


def test_the_cloud_does_not_change_the_place(block):
    bare = synthetic_block(7, spacing=None)
    assert bare.mesh.vertices.tobytes() == block.mesh.vertices.tobytes()
    assert len(bare.cloud) == len(bare.cameras) == 0


def test_layouts_vary_between_seeds():
    blocks = [synthetic_block(seed, size=None, spacing=None) for seed in range(12)]
    assert len({len(block.mesh) for block in blocks}) == 12
    assert len({block.buildings.max() for block in blocks}) >= 6
    extents = np.array([np.ptp(block.mesh.vertices, axis=0) for block in blocks])
    assert np.ptp(extents[:, 0]) > 20.0
    assert np.ptp(extents[:, 2]) > 8.0
    assert any(np.ptp(block.ground.heights) == 0.0 for block in blocks)
    assert any(np.ptp(block.ground.heights) > 0.5 for block in blocks)


def test_the_default_cloud_is_a_coarse_one_of_60_to_150_thousand_points(block):
    assert 60_000 <= len(block.cloud) <= 150_000
    assert set(np.unique(block.cloud.classes)) == {2, 5, 6, 17}
    assert block.cloud.colours.std(axis=0).min() > 20  # not grey
    assert block.cameras[:, 2].min() > block.mesh.vertices[:, 2].max() + 30.0


@settings(max_examples=8, deadline=None)
@given(seed=SEEDS)
def test_every_point_lies_within_its_noise_of_the_truth(seed):
    block = synthetic_block(seed, spacing=1.0)
    corners = block.mesh.vertices[block.mesh.triangles[block.triangles]]
    on_mesh = np.linalg.norm(closest_point(corners, block.truth) - block.truth, axis=1)
    assert on_mesh.max() < 1e-3  # beyond an edge by the rounding of a float32 ray
    assert np.median(on_mesh) < 1e-10
    off = np.linalg.norm(block.cloud.xyz - block.truth, axis=1)
    assert (off <= MOST_SIGMAS * block.sigma + 1e-9).all()  # so none is deeper in a solid
    assert block.sigma.max() < 0.5


def test_every_point_was_measured_on_a_face_in_the_open(block):
    normals, _ = triangle_normals(block.mesh)
    before = block.truth + 0.02 * normals[block.triangles]
    assert inside(block.mesh, before).mean() < 0.002  # corners within 2 cm of another solid
    behind = block.truth - 0.02 * normals[block.triangles]
    assert inside(block.mesh, behind).mean() > 0.999


def exposed_area(block, rows):
    """Area of the chosen triangles that is not inside another solid, by samples."""
    samples = sample_mesh(block.mesh, 0.5, 0)
    open_ = ~inside(block.mesh, samples.xyz + 0.02 * samples.normals)
    nearest = ray_scene(block.mesh).compute_closest_points(samples.xyz.astype(np.float32))
    on = nearest["primitive_ids"].numpy().astype(np.int64)
    return 0.25 * float((open_ & rows[on]).sum())


@pytest.mark.parametrize("seed", [0, 7, 13])
def test_facades_get_less_than_half_the_points_of_roofs(seed):
    block = synthetic_block(seed)
    normals, _ = triangle_normals(block.mesh)
    building = block.kinds == Kind.BUILDING
    wall, roof = building & (np.abs(normals[:, 2]) < 0.1), building & (normals[:, 2] > 0.5)
    hits = np.bincount(block.triangles, minlength=len(block.mesh))
    on_walls = hits[wall].sum() / exposed_area(block, wall)
    on_roofs = hits[roof].sum() / exposed_area(block, roof)
    assert 0.0 < on_walls < 0.5 * on_roofs


@pytest.mark.parametrize("seed", range(8))
def test_a_bridge_leaves_free_space_under_it(seed):
    block = synthetic_block(seed)
    under = block.kinds == Kind.UNDER_BRIDGE
    centres = block.mesh.vertices[block.mesh.triangles[under]].mean(axis=1)
    centres[:, 2] += 0.05
    clear = centres[~inside(block.mesh, centres)]  # piers and walls stand on the rest
    assert len(clear) > 0
    up = np.column_stack([clear, np.broadcast_to([0.0, 0.0, 1.0], clear.shape)])
    answer = ray_scene(block.mesh).cast_rays(up.astype(np.float32))
    assert answer["t_hit"].numpy().min() > 4.0
    assert (block.kinds[answer["primitive_ids"].numpy().astype(int)] == Kind.BRIDGE).all()


def test_the_first_flight_sees_little_of_a_courtyard_and_less_under_a_bridge():
    """Points a square metre, over blocks: open streets, courtyards, under bridges."""
    hits, areas = np.zeros(len(Kind)), np.zeros(len(Kind))
    for seed in range(6):
        block = synthetic_block(seed, spacing=0.5)
        hits += np.bincount(block.kinds[block.triangles], minlength=len(Kind))
        areas += np.bincount(block.kinds, triangle_normals(block.mesh)[1], minlength=len(Kind))
    density = hits / np.maximum(areas, 1e-9)
    assert density[Kind.UNDER_BRIDGE] < 0.7 * density[Kind.STREET]
    assert density[Kind.COURTYARD] < 0.95 * density[Kind.STREET]


def test_trees_stand_clear_of_walls(block):
    trees = np.isin(block.kinds, (Kind.CROWN, Kind.TRUNK))
    corners = block.mesh.vertices[np.unique(block.mesh.triangles[trees])]
    assert len(corners) > 100
    assert not inside_built(block, corners).any()


def inside_built(block, points):
    """Which points lie in a building or the bridge."""
    solid = np.isin(block.kinds, (Kind.BUILDING, Kind.BALCONY, Kind.BRIDGE))
    return inside(Mesh(block.mesh.vertices, block.mesh.triangles[solid]), points)


def test_true_ground_agrees_with_the_ground_triangles(block):
    floor = block.mesh.vertices[block.mesh.triangles[block.parts == 0]].mean(axis=1)
    assert np.abs(block.ground.height(floor) - floor[:, 2]).max() < 0.25


def test_a_scene_knows_only_what_the_cloud_tells(block):
    scene = scene_of(block)
    assert scene.mesh is None
    assert scene_of(block, truth=True).mesh is block.mesh
    assert scene.metric
    assert scene.source is None
    assert scene.name == "synthetic-7"
    assert scene.box.contains(scene.cloud.xyz, margin=1e-6).all()
    assert scene.box.size[:2] == pytest.approx([90.0, 70.0], abs=1.0)
    ground = scene.cloud.xyz[scene.cloud.classes == 2]
    gap = np.abs(scene.ground.height(ground) - ground[:, 2])
    assert np.percentile(gap, 99) < 0.4
    again = synthetic_scene(7)
    assert again.sha256 == scene.sha256


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"size": (30.0, 70.0)}, "size must be 40 to 2000 m"),
        ({"size": (90.0, np.nan)}, "size must be 40 to 2000 m"),
        ({"heights": (12.0, 6.0)}, "heights must rise"),
        ({"buildings": 0}, "buildings must be 1 or more"),
        ({"buildings": 500}, "500 buildings do not fit"),
        ({"spacing": 0.0}, "spacing must be above 0"),
        ({"relief": -1.0}, "relief must be 0 to 5"),
    ],
)
def test_impossible_wishes_are_refused_with_their_values(options, message):
    with pytest.raises(ValueError, match=message):
        synthetic_block(0, **options)


def test_a_scene_without_a_cloud_is_refused():
    with pytest.raises(ValueError, match="give a spacing"):
        synthetic_scene(0, spacing=None)


def test_random_state_of_the_program_is_left_alone():
    np.random.seed(5)  # noqa: NPY002
    expected = np.random.random()  # noqa: NPY002
    np.random.seed(5)  # noqa: NPY002
    synthetic_block(3, spacing=2.0, flight=NadirFlight(views=2))
    assert np.random.random() == expected  # noqa: NPY002


@pytest.mark.slow
def test_a_thousand_seeds_are_all_sound():
    for seed in range(1000):
        assert_sound(synthetic_block(seed, size=None, spacing=None))
