"""Poses of the first flight's photos, from every kind of file, in the scene's local frame."""

import csv
import hashlib
import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from planner import PlannerError, SceneSettings, load_scene
from planner.geometry.angles import circular_difference_deg, direction
from planner.geometry.frames import Frame
from planner.scene.images import load_images, place_images
from planner.scene.readers.poses import Poses, read_poses
from planner.scene.scene import Box
from planner.viewpoints.camera import Camera
from planner.viewpoints.frustum import camera_axes, in_frustum

BOX = Box(np.zeros(3), np.eye(3), np.full(3, 100.0))
HEAD = "x,y,z,yaw_deg,pitch_deg"


def table(folder, text):
    path = folder / "poses.csv"
    path.write_text(text)
    return path


def rotations(yaw, pitch):
    """Turns ``camera_from_world`` with x right, y down, z forward."""
    right, up, forward = np.moveaxis(camera_axes(yaw, pitch), -2, 0)
    return np.stack([right, -up, forward], axis=-2)


def shots(path, xyz, turns, **more):
    vectors = Rotation.from_matrix(turns).as_rotvec()
    features = [
        {
            "type": "Feature",
            "properties": {
                "filename": f"{row}.JPG",
                "translation": list(at),
                "rotation": list(turn),
                **more,
            },
        }
        for row, (at, turn) in enumerate(zip(xyz, vectors, strict=True))
    ]
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    return path


def colmap(path, xyz, turns):
    lines = ["# Image list with two lines of data per image:"]
    for row, (at, turn) in enumerate(zip(xyz, turns, strict=True)):
        x, y, z, w = Rotation.from_matrix(turn).as_quat()
        words = [row + 1, w, x, y, z, *(-turn @ at), 1, f"photo {row}.jpg"]
        lines += [" ".join(map(str, words)), "1.0 2.0 -1" if row % 2 else ""]
    path.write_text("\n".join(lines) + "\n")
    return path


@given(st.integers(0, 2**32 - 1))
def test_every_kind_of_file_says_the_same(tmp_path_factory, seed):
    folder = tmp_path_factory.mktemp("poses")
    rng = np.random.default_rng(seed)
    xyz = rng.uniform(-100.0, 100.0, (7, 3)) + [5e5, 5e6, 100.0]
    yaw, pitch = rng.uniform(-179.0, 180.0, 7), rng.choice([-90.0, -60.0, -10.0, 0.0], 7)
    rows = [",".join(map(repr, map(float, row))) for row in np.column_stack([xyz, yaw, pitch])]
    turns = rotations(yaw, pitch)
    files = (
        table(folder, "\n".join([HEAD, *rows])),
        shots(folder / "shots.geojson", xyz, turns),
        colmap(folder / "images.txt", xyz, turns),
    )
    frame = Frame([5e5, 5e6, 0.0])
    for path in files:
        images = load_images(path, frame=frame, box=BOX)
        np.testing.assert_allclose(images.positions, xyz - frame.origin, atol=1e-6)
        np.testing.assert_allclose(images.pitch_deg, pitch, atol=1e-5)
        assert np.abs(circular_difference_deg(images.yaw_deg, yaw)).max() < 1e-5
        assert np.isnan(images.optics).all()


@given(st.floats(-180.0, 180.0), st.floats(0.0, 360.0), st.floats(0.0, 3.0), st.floats(-3.0, 3.0))
def test_a_photo_that_looks_almost_down_keeps_its_heading(yaw, towards, tilt, roll):
    """A little tilt sideways must not turn the picture by a right angle."""
    turn = rotations(yaw, -90.0)
    way = np.radians(towards)
    tipped = Rotation.from_rotvec(np.radians(tilt) * np.array([np.cos(way), np.sin(way), 0.0]))
    tipped *= Rotation.from_rotvec([0.0, 0.0, np.radians(roll)])
    turn = turn @ tipped.as_matrix().T
    none = np.full((1, 3), np.nan)
    poses = Poses(np.zeros((1, 3)), turn[None, 2], -turn[None, 1], False, ("a",), none)
    images = place_images(poses, Frame(np.zeros(3)))
    assert abs(circular_difference_deg(images.yaw_deg[0], yaw)) <= abs(roll) + 4.0
    look = direction(images.yaw_deg[0], images.pitch_deg[0])
    assert look @ turn[2] >= np.cos(np.radians(3.1))


def test_names_and_optics_are_read_where_they_are_given(tmp_path):
    text = f"name,{HEAD},width_px,height_px,focal_px\nA 1.JPG,1,2,3,350,-45,4000,3000,2800\n\n"
    poses = read_poses(table(tmp_path, text))
    assert poses.names == ("A 1.JPG",)
    assert poses.optics.tolist() == [[4000.0, 3000.0, 2800.0]]
    assert place_images(poses, Frame(np.zeros(3))).yaw_deg[0] == pytest.approx(-10.0)
    path = shots(tmp_path / "shots.json", np.zeros((1, 3)), rotations(np.zeros(1), np.zeros(1)))
    assert np.isnan(read_poses(path).optics).all()
    lens = {"width": 4000, "height": 3000, "focal": 0.7}
    turns = rotations(np.zeros(1), np.zeros(1))
    path = shots(tmp_path / "shots.json", np.zeros((1, 3)), turns, **lens)
    assert read_poses(path).optics.tolist() == [[4000.0, 3000.0, pytest.approx(2800.0)]]


def test_axes_and_units_of_the_scenes_file_hold_for_its_photos():
    y_up = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    frame = Frame([0.0, 0.0, 1.0], None, None, 0.5, y_up, 0.3048)
    none = np.full((1, 3), np.nan)
    poses = Poses([[2.0, 10.0, -4.0]], np.array([[0, -1.0, 0]]), np.array([[1.0, 0, 0]]), False,
                  ("a",), none)  # fmt: skip
    images = place_images(poses, frame)
    np.testing.assert_allclose(images.positions, [[1.0, 2.0, 10.0 * 0.3048 - 1.0]])
    assert (images.yaw_deg[0], images.pitch_deg[0]) == (90.0, -90.0)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "line 1: its header names no column x"),
        ("x,y,z,yaw_deg\n", "line 1: its header names no column pitch_deg"),
        ("x,x,y,z,yaw_deg,pitch_deg\n", "line 1: .* more than one"),
        (f"{HEAD},focal_px\n", "line 1: .* focal_px, but not all"),
        (f"{HEAD}\n", "holds no pose"),
        (f"{HEAD}\n1,2,3,4,-90\n\n1,2,3,4\n", "line 4: it has 4 fields"),
        (f"{HEAD}\n1,2,3,4,-90\n1,2,here,4,-90\n", "line 3: z is 'here'"),
        (f"{HEAD}\n1,2,nan,4,-90\n", "line 2: z is 'nan'"),
        (f"{HEAD}\n1,2,inf,4,-90\n", "line 2: z is 'inf'"),
        (f"{HEAD}\n1,2,3,4,-91\n", "line 2: yaw 4 or pitch -91"),
        (f"{HEAD}\n1,2,3,400,-9\n", "line 2: yaw 400 or pitch"),
        (f'{HEAD}\n1,2,"3,4,-9\n', "line 2"),
        (f"{HEAD},width_px,height_px,focal_px\n1,2,3,4,-9,0,1,1\n", "line 2: .* positive"),
        (f"{HEAD}\n500000,5000000,3,4,-90\n", "nearest photo is 5.02e\\+06 m from the scene"),
    ],
)
def test_a_bad_table_is_named_with_its_line(tmp_path, text, complaint):
    with pytest.raises(PlannerError, match=complaint) as caught:
        load_images(table(tmp_path, text), frame=Frame(np.zeros(3)), box=BOX)
    assert str(caught.value).startswith(f"{tmp_path / 'poses.csv'}: ")
    assert "; " in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "content", "complaint"),
    [
        ("a.xml", b"", "extension"),
        ("a.csv", None, "cannot be read"),
        ("a.csv", b"\xff\xfe\x00", "no text"),
        ("a.json", b"{", "not valid JSON"),
        ("a.json", b"[" * 100_000, "not valid JSON"),
        ("a\0.csv", None, "cannot be read"),
        ("a.json", b"[]", "no features"),
        (
            "a.json",
            b'{"features": [{"properties": {"rotation": [0, 0, 0], "translation": [1, 2, 1'
            + b"0" * 400
            + b"]}}]}",
            "shot 0",
        ),
        ("a.json", b'{"features": 3}', "no features"),
        ("a.json", b'{"features": []}', "no pose"),
        ("a.json", b'{"features": [{"properties": {"rotation": [0, 0, 0]}}]}', "shot 0"),
        ("a.json", b'{"features": [{"properties": null}]}', "shot 0"),
        (
            "a.json",
            b'{"features": [{"properties": {"rotation": [0, 0], "translation": [0, 0, 0]}}]}',
            "shot 0",
        ),
        ("a.txt", b"# nothing\n", "no pose"),
        ("a.txt", b"#\n1 1 0 0 0 1 2 3 1 a.jpg\n\n2 9 0 0 0 1 2 3 1 b.jpg\n", "line 4"),
        ("a.txt", b"1 1 0 0 0 1 2\n", "line 1"),
    ],
)
def test_a_bad_file_is_named_in_one_line(tmp_path, name, content, complaint):
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(PlannerError, match=complaint) as caught:
        read_poses(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "head", "pose", "tail"),
    [
        ("poses.csv", f"{HEAD}\n", "1,2,3,4,-45\n", ""),
        ("shots.json", '{"features":[', "{},", "{}]}"),
        ("images.txt", "", "1 1 0 0 0 0 0 0 1 a.jpg\n\n", ""),
    ],
)
def test_more_photos_than_can_be_held_against_new_ones_are_refused(
    tmp_path, name, head, pose, tail
):
    path = tmp_path / name
    path.write_text(head + 20_001 * pose + tail)
    with pytest.raises(PlannerError, match="more than 20000 photos; leave photos out"):
        read_poses(path)


def test_a_scene_is_read_with_its_photos(tmp_path):
    rng = np.random.default_rng(0)
    level = np.column_stack([rng.uniform(0, 40, (900, 2)), rng.choice([0.0, 6.0], 900)])
    np.savetxt(tmp_path / "a.xyz", level + [500_000.0, 5_000_000.0, 200.0], fmt="%.4f")
    path = table(tmp_path, f"{HEAD}\n500020,5000010,250,45,-90\n")
    scene = load_scene(tmp_path / "a.xyz", SceneSettings(images=str(path)))
    np.testing.assert_allclose(
        scene.images.positions + scene.frame.origin, [[5.0002e5, 5.00001e6, 250.0]]
    )
    assert scene.images.file == "poses.csv"
    assert scene.images.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    assert "The poses of 1 photos of the first flight are in poses.csv." in scene.notes
    assert load_scene(tmp_path / "a.xyz").images is None


@given(st.integers(0, 2**32 - 1), st.sampled_from(["poses.csv", "shots.geojson", "images.txt"]))
def test_spoilt_bytes_end_in_poses_or_in_one_line(tmp_path_factory, seed, name):
    folder = tmp_path_factory.mktemp("spoilt")
    rng = np.random.default_rng(seed)
    xyz, yaw, pitch = rng.uniform(-50, 50, (3, 3)), np.array([1.0, 90.0, -9.0]), np.full(3, -60.0)
    rows = [",".join(map(str, row)) for row in np.column_stack([xyz, yaw, pitch]).tolist()]
    turns = rotations(yaw, pitch)
    path = {
        "poses.csv": lambda: table(folder, "\n".join([HEAD, *rows])),
        "shots.geojson": lambda: shots(folder / name, xyz, turns, width=9, height=8, focal=0.7),
        "images.txt": lambda: colmap(folder / name, xyz, turns),
    }[name]()
    content = bytearray(path.read_bytes())
    for place in rng.integers(0, len(content), 3):
        content[place] = rng.choice([content[place] ^ 1, *b'0e,. -\n"{[N'])
    path.write_bytes(content)
    try:
        images = load_images(path, frame=Frame(np.zeros(3)), box=BOX)
    except PlannerError as error:
        assert "\n" not in str(error)  # noqa: PT017
        assert str(error).startswith(f"{path}: ")  # noqa: PT017
    else:
        assert np.isfinite(images.positions).all()
        assert np.isfinite(images.yaw_deg + images.pitch_deg).all()


@pytest.mark.slow
def test_poses_of_a_real_flight_look_at_the_cloud_that_was_made_of_them(shared_data, tmp_path):
    from pyproj import Transformer

    with (shared_data / "photos/brighton_beach/cameras.csv").open() as file:
        photos = list(csv.DictReader(file))
    lon, lat = (np.array([float(photo[key]) for photo in photos]) for key in ("lon", "lat"))
    x, y = Transformer.from_crs("EPSG:4326", "EPSG:32615", always_xy=True).transform(lon, lat)
    ground = 158.0  # metres, of the cloud; the photos know their height above it
    rows = [
        f"{photo['file']},{east!r},{north!r},{ground + float(photo['rel_alt_m'])},"
        f"{photo['gimbal_yaw_deg']},{photo['gimbal_pitch_deg']},4000,2250,2340"
        for photo, east, north in zip(photos, x.tolist(), y.tolist(), strict=True)
    ]
    path = table(tmp_path, f"name,{HEAD},width_px,height_px,focal_px\n" + "\n".join(rows))
    settings = SceneSettings(images=str(path))
    scene = load_scene(shared_data / "scenes/pointclouds/brighton_beach_odm.laz", settings)
    images = scene.images
    assert len(images) == 18
    cloud = scene.cloud.xyz[::20]
    camera = Camera(width_px=4000, height_px=2250, focal_px=2340.0)
    above = 0
    for row in range(18):  # each sees what is below it, where the cloud goes so far
        rays = cloud - images.positions[row]
        seen = in_frustum(rays, images.yaw_deg[row], images.pitch_deg[row], camera)
        near = np.linalg.norm(rays[:, :2], axis=1) < 8.0
        above += near.sum() > 20
        assert seen[near].all()
        assert seen.any()
    assert above >= 12
