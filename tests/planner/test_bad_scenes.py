"""What cannot be planned is refused in one line that names the file, the fault and the remedy."""

import contextlib
import json
import struct

import numpy as np
import pytest

from planner.config import SceneSettings
from planner.errors import PlannerError
from planner.scene.load import load_scene
from planner.scene.readers.formats import read_source


def refused(path, match, settings=None):
    """Load, and return the refusal after checking its form."""
    with pytest.raises(PlannerError, match=match) as caught:
        load_scene(path, settings or SceneSettings())
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    wrong, _, remedy = message.removeprefix(f"{path}: ").partition("; ")
    assert wrong
    assert remedy
    assert caught.value.exit_code == 2
    return message


def block(count=4_000, seed=0, size=(40.0, 30.0, 12.0)):
    """Points on the ground around and on the top and sides of a box, metres."""
    rng = np.random.default_rng(seed)
    xyz = rng.random((count, 3)) * size
    inside = (np.abs(xyz[:, :2] - [20, 15]) < [8, 6]).all(axis=1)
    xyz[:, 2] = np.where(inside, 12.0, 0.0)
    xyz[:, 2] += rng.normal(0, 0.02, count)
    return xyz


def write_xyz(path, xyz):
    np.savetxt(path, xyz, fmt="%.6f")
    return path


def write_ply(path, xyz, *, count=None, more=""):
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {count or len(xyz)}\n"
    header += "".join(f"property double {axis}\n" for axis in "xyz") + more + "end_header\n"
    path.write_bytes(header.encode() + np.asarray(xyz, dtype="<f8").tobytes())
    return path


def write_laz(path, xyz):
    import laspy

    las = laspy.create(point_format=1, file_version="1.2")
    las.header.scales = np.full(3, 0.001)
    las.x, las.y, las.z = np.asarray(xyz).T
    las.write(path)
    return path


# files


def test_a_missing_file_and_a_folder(tmp_path):
    refused(tmp_path / "no.ply", "no such file")
    refused(tmp_path, "folder")


@pytest.mark.parametrize("suffix", ["ply", "las", "laz", "pcd", "xyz", "obj", "stl", "glb", "json"])
def test_an_empty_file(tmp_path, suffix):
    path = tmp_path / f"empty.{suffix}"
    path.touch()
    refused(path, "empty")


@pytest.mark.parametrize("suffix", ["ply", "laz", "pcd", "off", "obj", "stl", "glb", "json", "csv"])
def test_noise_of_any_extension(tmp_path, suffix):
    path = tmp_path / f"noise.{suffix}"
    path.write_bytes(np.random.default_rng(1).bytes(5_000))
    print(refused(path, "noise"))


def test_an_unknown_extension_lists_the_known_ones(tmp_path):
    path = tmp_path / "scan.e57"
    path.write_bytes(b"ASTM-E57")
    refused(path, r"'\.e57' is unknown; convert it to one of .*\.ply")


def test_a_wrong_extension_names_the_right_one(tmp_path):
    path = write_ply(tmp_path / "scan.las", block(200))
    refused(path, r"its content is PLY, not LAS; rename it to scan\.ply")
    path = tmp_path / "scan.ply"
    path.write_bytes(b"\x89PNG\r\n\x1a\n")
    refused(path, "a picture")
    path.write_bytes(b"PK\x03\x04....")
    refused(path, "a ZIP archive")


# damage


@pytest.mark.parametrize("share", [0.02, 0.3, 0.7, 0.99])
def test_a_truncated_laz(tmp_path, share):
    path = write_laz(tmp_path / "scan.laz", block())
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    refused(path, "cut short or damaged")


def test_a_truncated_ply_of_points_and_of_faces(tmp_path):
    path = write_ply(tmp_path / "scan.ply", block(500), count=501)
    refused(path, r"500 of 501")
    more = "element face 9\nproperty list uchar int vertex_indices\n"
    refused(write_ply(path, block(500), more=more), "cut short")
    path.write_bytes(path.read_bytes()[:60])
    refused(path, "end_header")


@pytest.mark.parametrize("data", ["ascii", "binary", "binary_compressed"])
def test_a_truncated_pcd(tmp_path, data):
    path = tmp_path / "scan.pcd"
    head = "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 100\nHEIGHT 1\n"
    path.write_bytes(f"{head}POINTS 100\nDATA {data}\n1 2 3\n".encode())
    refused(path, "cut short")


def test_a_truncated_stl_glb_and_cityjson(tmp_path):
    stl = tmp_path / "a.stl"
    stl.write_bytes(bytes(80) + struct.pack("<I", 9) + bytes(100))
    refused(stl, "2 of 9 triangles")
    glb = tmp_path / "a.glb"
    glb.write_bytes(struct.pack("<4s5I", b"glTF", 2, 900, 800, 0x4E4F534A, 0))
    refused(glb, "cut short")
    city = tmp_path / "a.city.json"
    city.write_text('{"type": "CityJSON", "CityObjects": {')
    refused(city, "no valid CityJSON")


def test_a_declared_count_far_beyond_the_file_takes_no_memory(tmp_path):
    refused(write_ply(tmp_path / "a.ply", block(100), count=10**15), "cut short")
    laz = write_laz(tmp_path / "a.laz", block(1_000))
    data = bytearray(laz.read_bytes())
    struct.pack_into("<I", data, 107, 2**32 - 1)  # number of points in a LAS 1.2 header
    laz.write_bytes(bytes(data))
    refused(laz, "cut short")


def test_a_las_header_full_of_large_numbers_is_refused_at_once(tmp_path):
    laz = write_laz(tmp_path / "a.laz", block(1_000))
    good = laz.read_bytes()
    for offset in (94, 96, 100, 107):  # header size, offset of points, records, points
        data = bytearray(good)
        struct.pack_into("<H" if offset == 94 else "<I", data, offset, 0xFFF0)
        data[offset + 1] = 0xFF
        laz.write_bytes(bytes(data))
        refused(laz, "cut short")


@pytest.mark.parametrize("suffix", ["ply", "pcd", "las", "stl", "glb"])
def test_flipped_bytes_are_read_or_refused_and_never_crash(tmp_path, suffix):
    rng = np.random.default_rng(5)
    path = tmp_path / f"a.{suffix}"
    xyz = block(200)
    if suffix == "ply":
        write_ply(path, xyz)
    elif suffix == "las":
        write_laz(path, xyz)
    elif suffix == "pcd":
        head = (
            "VERSION .7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 200\nHEIGHT 1\n"
        )
        path.write_bytes(f"{head}POINTS 200\nDATA binary\n".encode() + xyz.tobytes())
    elif suffix == "stl":
        records = b"".join(struct.pack("<12fH", *np.tile(p, 4), 0) for p in xyz)
        path.write_bytes(bytes(80) + struct.pack("<I", 200) + records)
    else:
        text = b'{"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}]}  '
        chunks = struct.pack("<2I", len(text), 0x4E4F534A) + text + struct.pack("<2I", 0, 0x4E4942)
        path.write_bytes(struct.pack("<4s2I", b"glTF", 2, 12 + len(chunks)) + chunks)
    good = path.read_bytes()
    for _ in range(60):
        data = bytearray(good)
        for place in rng.integers(0, min(len(data), 400), 3):
            data[place] = rng.integers(256)
        path.write_bytes(bytes(data))
        with contextlib.suppress(PlannerError):
            read_source(path, limit=10_000)


def test_a_face_that_names_a_missing_vertex(tmp_path):
    path = tmp_path / "a.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n")
    refused(path, "names vertex 3 of 3")


def test_deeply_nested_json_is_no_crash(tmp_path):
    path = tmp_path / "a.json"
    path.write_text("[" * 100_000)
    refused(path, "no valid CityJSON")


def test_json_that_is_no_city(tmp_path):
    path = tmp_path / "a.json"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": []}))
    refused(path, "CityJSON is expected")


def test_a_gltf_part_outside_of_its_folder(tmp_path):
    (tmp_path / "in").mkdir()
    (tmp_path / "secret.bin").write_bytes(bytes(1_000))
    tree = {
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri": "../secret.bin"}],
    }
    path = tmp_path / "in" / "a.gltf"
    path.write_text(json.dumps(tree))
    refused(path, "not beside it")


# content


def test_many_numbers_that_are_none_are_refused_and_few_dropped(tmp_path):
    xyz = block(1_000)
    xyz[:30, 1] = np.nan
    xyz[40, 2] = np.inf
    refused(write_ply(tmp_path / "a.ply", xyz), "31 of 1000 points .* NaN")
    xyz[:27] = block(27)
    scene = load_scene(write_ply(tmp_path / "b.ply", xyz))
    assert "Dropped 4 of 1000 points" in scene.notes[0]
    assert np.isfinite(scene.cloud.xyz).all()


def test_a_table_with_a_word_in_it_names_its_line(tmp_path):
    path = write_xyz(tmp_path / "a.xyz", block(200))
    lines = path.read_text().splitlines()
    lines[41] = "1.0 two 3.0"
    path.write_text("\n".join(lines))
    refused(path, "line 42")


def test_three_points(tmp_path):
    refused(write_xyz(tmp_path / "a.xyz", np.eye(3)), "only 3 points")


def test_all_points_on_a_line(tmp_path):
    along = np.linspace(0, 50, 5_000)[:, None]
    refused(write_ply(tmp_path / "a.ply", along * [0.6, 0.5, 0.2]), "on a line")


def test_all_points_in_one_place(tmp_path):
    refused(write_ply(tmp_path / "a.ply", np.ones((500, 3))), "coincide")


@pytest.mark.parametrize("tilt", [0.0, 0.4])
def test_a_flat_plane(tmp_path, tilt):
    xyz = block(5_000)
    xyz[:, 2] = tilt * xyz[:, 0]
    refused(write_ply(tmp_path / "a.ply", xyz), "flat plane")


def test_a_mesh_without_faces_or_without_area(tmp_path):
    path = tmp_path / "a.obj"
    path.write_text("".join(f"v {i} {i % 3} {i % 5}\n" for i in range(200)))
    refused(path, "no faces")
    path.write_text(path.read_text() + "f 1 1 1\nf 2 2 3\n")
    refused(path, "no area")
    off = tmp_path / "a.off"
    off.write_text("OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 1\n")
    refused(off, "no faces")
    stl = tmp_path / "a.stl"
    stl.write_bytes(bytes(84))
    refused(stl, "no faces")


def test_coordinates_in_degrees(tmp_path):
    xyz = block() * [1e-5, 1e-5, 1.0] + [4.36, 52.01, 0.0]
    refused(write_ply(tmp_path / "a.ply", xyz), "degrees")
    geographic = SceneSettings(crs="EPSG:4326")
    refused(write_ply(tmp_path / "b.ply", block()), "map projection", geographic)


def test_a_crs_that_is_none(tmp_path):
    path = write_ply(tmp_path / "a.ply", block())
    refused(path, "'EPSG:123456789' is not known", SceneSettings(crs="EPSG:123456789"))


def test_millimetres_are_refused_until_the_unit_is_set(tmp_path):
    metres = write_ply(tmp_path / "m.ply", block())
    millimetres = write_ply(tmp_path / "mm.ply", 1_000.0 * block())
    refused(millimetres, r"40\.0 km long; set scene\.unit to .*0\.001 for millimetres")
    a = load_scene(metres)
    b = load_scene(millimetres, SceneSettings(unit=0.001))
    np.testing.assert_allclose(b.cloud.xyz, a.cloud.xyz, atol=1e-9)
    np.testing.assert_allclose(b.box.size, a.box.size, atol=1e-9)
    np.testing.assert_allclose(b.ground.heights, a.ground.heights, atol=1e-9)
    assert b.metric
    assert b.frame.unit_metres == 0.001
