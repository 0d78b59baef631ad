"""Every format, written by hand here, gives back the same numbers."""

import base64
import json
import struct

import numpy as np
import pytest

from planner.scene.readers.formats import extensions, read_source

# a box of 2 x 3 x 4 far from zero, needing float64; wound outwards
FAR = np.array([630_250.125, 4_834_500.25, 46.875])
CORNERS = FAR + np.array([[x, y, z] for x in (0, 2) for y in (0, 3) for z in (0, 4)], dtype=float)
QUADS = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
NORMALS = np.tile([0.0, 0.6, 0.8], (8, 1))
COLOURS = np.arange(24).reshape(8, 3) * 10


def read(path):
    return read_source(path, limit=1_000_000)


def volume(source):
    a, b, c = np.moveaxis(source.xyz[source.triangles] - source.xyz.mean(axis=0), 1, 0)
    return float((a * np.cross(b, c)).sum()) / 6.0


def is_the_box(source, *, decimals=9):
    got = np.unique(np.round(source.xyz, decimals), axis=0)
    np.testing.assert_allclose(got, np.unique(CORNERS, axis=0), atol=0.6 * 10.0**-decimals)
    assert volume(source) == pytest.approx(24.0, rel=1e-6)
    assert len(source.triangles) == 12


# PLY


def ply_header(kind, faces=0, extra=""):
    face = f"element face {faces}\nproperty list uchar int vertex_indices\n" if faces else ""
    return (
        f"ply\nformat {kind} 1.0\ncomment by hand\nelement vertex 8\n"
        "property double x\nproperty double y\nproperty double z\n"
        f"{extra}{face}end_header\n"
    ).encode()


def test_ply_ascii_mesh(tmp_path):
    path = tmp_path / "box.ply"
    vertices = "".join(f"{x!r} {y!r} {z!r}\n" for x, y, z in CORNERS.tolist())
    faces = "".join("4 " + " ".join(map(str, quad)) + "\n" for quad in QUADS)
    path.write_bytes(ply_header("ascii", 6) + (vertices + faces).encode())
    is_the_box(read(path))


@pytest.mark.parametrize(("kind", "order"), [("little", "<"), ("big", ">")])
def test_ply_binary_mesh_of_either_byte_order(tmp_path, kind, order):
    path = tmp_path / "box.ply"
    faces = b"".join(struct.pack(f"{order}B4i", 4, *quad) for quad in QUADS)
    body = CORNERS.astype(f"{order}f8").tobytes() + faces
    path.write_bytes(ply_header(f"binary_{kind}_endian", 6) + body)
    is_the_box(read(path))


def test_ply_faces_of_mixed_length_and_other_elements(tmp_path):
    path = tmp_path / "box.ply"
    faces = b"".join(struct.pack("<B4i", 4, *quad) for quad in QUADS[:5])
    faces += b"".join(struct.pack("<B3i", 3, *t) for t in ([1, 5, 7], [1, 7, 3]))
    header = ply_header("binary_little_endian", 7).replace(
        b"element face", b"element tag 2\nproperty list uchar short ids\nelement face"
    )
    tags = struct.pack("<Bh", 1, 7) + struct.pack("<B2h", 2, 7, 8)
    path.write_bytes(header + CORNERS.astype("<f8").tobytes() + tags + faces)
    is_the_box(read(path))


def test_ply_cloud_keeps_doubles_normals_and_colours(tmp_path):
    path = tmp_path / "cloud.ply"
    extra = "".join(f"property float {n}\n" for n in ("nx", "ny", "nz"))
    extra += "".join(f"property uchar {n}\n" for n in ("red", "green", "blue"))
    table = np.zeros(8, dtype=[("p", "<f8", 3), ("n", "<f4", 3), ("c", "u1", 3)])
    table["p"], table["n"], table["c"] = CORNERS, NORMALS, COLOURS
    path.write_bytes(ply_header("binary_little_endian", extra=extra) + table.tobytes())
    source = read(path)
    assert source.triangles is None
    np.testing.assert_array_equal(source.xyz, CORNERS)
    np.testing.assert_allclose(source.normals, NORMALS, atol=1e-7)
    np.testing.assert_array_equal(source.colours, COLOURS)


# LAS


@pytest.mark.parametrize("suffix", ["las", "laz"])
def test_las_keeps_classes_colours_and_crs(tmp_path, suffix):
    import laspy
    from pyproj import CRS

    header = laspy.LasHeader(point_format=7, version="1.4")
    header.offsets, header.scales = np.floor(FAR), np.full(3, 0.001)
    header.add_crs(CRS.from_epsg(7415))
    las = laspy.LasData(header)
    las.x, las.y, las.z = CORNERS.T
    las.classification = np.array([2, 2, 6, 6, 9, 9, 1, 1])
    las.red, las.green, las.blue = (COLOURS * 256).T
    path = tmp_path / f"scan.{suffix}"
    las.write(path)
    source = read(path)
    np.testing.assert_allclose(source.xyz, CORNERS, atol=5.1e-4)
    assert source.classes.tolist() == [2, 2, 6, 6, 9, 9, 1, 1]
    np.testing.assert_array_equal(source.colours, COLOURS)
    assert source.crs == "EPSG:7415"
    fewer = read_source(path, limit=3)
    np.testing.assert_allclose(fewer.xyz, CORNERS[::3], atol=5.1e-4)
    assert fewer.notes == ("Took one point in 3 of 8.",)


# PCD


def pcd_header(data, rgb="F"):
    return (
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z pad rgb\n"
        f"SIZE 8 8 8 2 4\nTYPE F F F U {rgb}\nCOUNT 1 1 1 3 1\nWIDTH 8\nHEIGHT 1\n"
        f"VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 8\nDATA {data}\n"
    ).encode()


def packed_colours():
    red, green, blue = COLOURS.astype(np.uint32).T
    return red << 16 | green << 8 | blue


def pcd_table():
    table = np.zeros(8, dtype=[("p", "<f8", 3), ("pad", "<u2", 3), ("rgb", "<u4")])
    table["p"], table["rgb"] = CORNERS, packed_colours()
    return table


def lzf_literals(data):
    """The laziest LZF stream: runs of up to 32 literal bytes."""
    return b"".join(
        bytes([len(data[i : i + 32]) - 1]) + data[i : i + 32] for i in range(0, len(data), 32)
    )


def write_pcd(path, kind):
    table = pcd_table()
    if kind == "ascii":
        rows = [
            f"{x!r} {y!r} {z!r} 0 0 0 {c}\n"
            for (x, y, z), c in zip(CORNERS.tolist(), packed_colours().tolist(), strict=True)
        ]
        path.write_bytes(pcd_header("ascii", rgb="U") + "".join(rows).encode())
    elif kind == "binary":
        path.write_bytes(pcd_header("binary") + table.tobytes())
    else:
        plain = CORNERS.T.astype("<f8").tobytes() + bytes(48) + table["rgb"].tobytes()
        packed = lzf_literals(plain)
        sizes = struct.pack("<2I", len(packed), len(plain))
        path.write_bytes(pcd_header("binary_compressed") + sizes + packed)


@pytest.mark.parametrize("kind", ["ascii", "binary", "binary_compressed"])
def test_pcd(tmp_path, kind):
    path = tmp_path / "cloud.pcd"
    write_pcd(path, kind)
    source = read(path)
    np.testing.assert_array_equal(source.xyz, CORNERS)
    np.testing.assert_array_equal(source.colours, COLOURS)


def test_organised_pcd_leaves_out_its_empty_pixels(tmp_path):
    path = tmp_path / "cloud.pcd"
    table = pcd_table()
    table["p"][3] = np.nan
    header = pcd_header("binary").replace(b"WIDTH 8\nHEIGHT 1", b"WIDTH 4\nHEIGHT 2")
    path.write_bytes(header + table.tobytes())
    source = read(path)
    np.testing.assert_array_equal(source.xyz, np.delete(CORNERS, 3, axis=0))
    assert len(source.colours) == 7


def test_lzf_copies_overlap_and_damage_is_told():
    from planner.scene.readers.lzf import unpack

    # "ab", then a copy of 3 from 2 back, then of 9 (7 + 2, with the extra byte) from 1 back
    stream = np.array([1, 97, 98, 1 << 5, 1, 7 << 5, 0, 0], dtype=np.uint8)
    block, length = unpack(stream, 14)
    assert bytes(block[:length]) == b"ab" + b"aba" + b"a" * 9
    for damaged in (stream[:-1], stream[:2], np.array([1 << 5, 5], dtype=np.uint8)):
        assert unpack(damaged, 14)[1] == -1
    assert unpack(stream, 5)[1] == -1


# tables


@pytest.mark.parametrize(
    ("name", "head", "row"),
    [
        ("a.xyz", "", "{x!r} {y!r} {z!r}"),
        ("b.xyz", "8\n", "{x!r}\t{y!r}\t{z!r}  "),
        ("c.csv", "X,Y,Z\n", "{x!r},{y!r},{z!r}"),
        ("d.csv", "z;x;y;note\n", "{z!r};{x!r};{y!r};7"),
        ("e.txt", "//X Y Z Intensity\n", "{x!r} {y!r} {z!r} 3"),
        ("f.txt", "# a remark\n", "{x!r},{y!r},{z!r},"),
        ("g.csv", "\ufeffx[m];y[m];z[m]\n", "{x!r};{y!r};{z!r}"),
    ],
)
def test_tables_of_many_dialects(tmp_path, name, head, row):
    path = tmp_path / name
    rows = [row.format(x=x, y=y, z=z) for x, y, z in CORNERS.tolist()]
    path.write_text(head + "\n".join(rows) + "\n", encoding="utf-8")
    np.testing.assert_array_equal(read(path).xyz, CORNERS)


def test_decimal_commas(tmp_path):
    path = tmp_path / "a.csv"
    rows = [f"{x};{y};{z}".replace(".", ",") for x, y, z in CORNERS.tolist()]
    path.write_text("\n".join(rows))
    np.testing.assert_array_equal(read(path).xyz, CORNERS)


def test_six_columns_are_colours_if_whole_else_normals(tmp_path):
    path = tmp_path / "a.xyz"
    np.savetxt(path, np.hstack([CORNERS, COLOURS]), fmt="%.10g")
    np.testing.assert_array_equal(read(path).colours, COLOURS)
    np.savetxt(path, np.hstack([CORNERS, NORMALS]), fmt="%.10g")
    np.testing.assert_allclose(read(path).normals, NORMALS)


# meshes


def test_obj_with_quads_slashes_negative_rows_and_a_long_line(tmp_path):
    path = tmp_path / "box.obj"
    lines = ["mtllib x.mtl", "o box"]
    lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in CORNERS.tolist()]
    lines += ["vn 0 0 1", "f " + " ".join(f"{i + 1}//1" for i in QUADS[0])]
    lines += ["f " + " ".join(str(i - 8) for i in quad) for quad in QUADS[1:5]]
    lines += ["f 2/1 6/1 \\", "  8/1 4/1", "l 1 2"]
    path.write_text("\n".join(lines))
    is_the_box(read(path))


def box_triangles():
    return [t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))]


def test_stl_binary(tmp_path):
    path = tmp_path / "box.stl"
    records = b"".join(
        struct.pack("<3f9fH", 0, 0, 0, *(CORNERS[list(t)] - FAR).ravel(), 0)
        for t in box_triangles()
    )
    path.write_bytes(b"solid facet, in truth binary".ljust(80) + struct.pack("<I", 12) + records)
    source = read(path)
    assert len(source.xyz) == 8
    assert volume(source) == pytest.approx(24.0)


def test_stl_ascii(tmp_path):
    path = tmp_path / "box.stl"
    facets = "".join(
        "facet normal 0 0 0\n outer loop\n"
        + "".join("  vertex {!r} {!r} {!r}\n".format(*p) for p in CORNERS[list(t)].tolist())
        + " endloop\nendfacet\n"
        for t in box_triangles()
    )
    path.write_text(f"solid box\n{facets}endsolid box\n")
    is_the_box(read(path))


@pytest.mark.parametrize("head", ["OFF\n8 6 12\n", "# by hand\nOFF 8 6 0\n"])
def test_off(tmp_path, head):
    path = tmp_path / "box.off"
    vertices = "".join(f"{x!r} {y!r} {z!r}\n" for x, y, z in CORNERS.tolist())
    faces = "".join("4 " + " ".join(map(str, quad)) + " 255 0 0\n" for quad in QUADS)
    path.write_text(head + vertices + "# half way\n" + faces)
    is_the_box(read(path))


def gltf_tree(buffer):
    """The box less FAR, y up, halved and shifted by its nodes, so that they must be applied."""
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [
            {"children": [1], "translation": [FAR[0], FAR[2], -FAR[1]]},
            {"mesh": 0, "scale": [2, 2, 2], "rotation": [0, 0, 0, 1]},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 96},
            {"buffer": 0, "byteOffset": 96, "byteLength": 72},
        ],
        "buffers": [buffer],
    }


def gltf_body():
    x, y, z = 0.5 * (CORNERS - FAR).T
    points = np.column_stack([x, z, -y]).astype("<f4")
    return points.tobytes() + np.array(box_triangles(), dtype="<u2").tobytes()


def write_glb(path):
    body = gltf_body()
    text = json.dumps(gltf_tree({"byteLength": len(body)})).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<2I", len(text), 0x4E4F534A) + text
    chunks += struct.pack("<2I", len(body), 0x004E4942) + body
    path.write_bytes(struct.pack("<4s2I", b"glTF", 2, 12 + len(chunks)) + chunks)


def turned_up(source):
    x, y, z = source.xyz.T
    return type(source)(np.column_stack([x, -z, y]), source.triangles)


def test_glb_applies_its_nodes(tmp_path):
    path = tmp_path / "box.glb"
    write_glb(path)
    source = read(path)
    assert (source.up, source.unit_metres) == ("y", 1.0)
    is_the_box(turned_up(source))


@pytest.mark.parametrize("embedded", [True, False])
def test_gltf_with_its_data_inside_or_beside(tmp_path, embedded):
    uri = "box.bin"
    (tmp_path / uri).write_bytes(gltf_body())
    if embedded:
        uri = "data:application/octet-stream;base64," + base64.b64encode(gltf_body()).decode()
    path = tmp_path / "box.gltf"
    path.write_text(json.dumps(gltf_tree({"byteLength": 168, "uri": uri})))
    is_the_box(turned_up(read(path)))


# CityJSON


def city_vertices():
    """The box's corners as whole millimetres."""
    return np.rint((CORNERS - FAR) * 1000).astype(int).tolist()


def solid(lod, quads=QUADS):
    return {"type": "Solid", "lod": lod, "boundaries": [[[quad] for quad in quads]]}


TRANSFORM = {"scale": [0.001, 0.001, 0.001], "translate": FAR.tolist()}


def city(objects, **extra):
    return {
        "type": "CityJSON",
        "version": "2.0",
        "transform": TRANSFORM,
        "metadata": {"referenceSystem": "https://www.opengis.net/def/crs/EPSG/0/7415"},
        "CityObjects": objects,
        "vertices": city_vertices(),
        **extra,
    }


def test_cityjson_takes_the_best_level_and_no_footprint_of_a_parent(tmp_path):
    foot = {"type": "MultiSurface", "lod": "0", "boundaries": [[QUADS[4]]]}
    objects = {
        "a": {"type": "Building", "children": ["b"], "geometry": [foot]},
        "b": {
            "type": "BuildingPart",
            "parents": ["a"],
            "geometry": [solid("1.2", QUADS[:3]), solid("2.2")],
        },
    }
    path = tmp_path / "box.city.json"
    path.write_text(json.dumps(city(objects)))
    source = read(path)
    is_the_box(source)
    assert source.crs == "EPSG:7415"


def test_cityjson_sequence(tmp_path):
    head = city({}) | {"vertices": []}
    features = [
        {
            "type": "CityJSONFeature",
            "id": name,
            "CityObjects": {name: {"type": "Building", "geometry": [geometry]}},
            "vertices": city_vertices(),
        }
        for name, geometry in (("a", solid("1", QUADS[:3])), ("b", solid("1", QUADS[3:])))
    ]
    path = tmp_path / "box.city.jsonl"
    path.write_text("\n".join(json.dumps(line) for line in (head, *features)) + "\n")
    is_the_box(read(path))


def test_cityjson_template_is_put_in_place(tmp_path):
    template = {
        "templates": [{"type": "MultiSurface", "lod": "2", "boundaries": [[q] for q in QUADS]}],
        "vertices-templates": (0.5 * (CORNERS - FAR)).tolist(),
    }
    matrix = [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1]
    instance = {
        "type": "GeometryInstance",
        "template": 0,
        "boundaries": [0],
        "transformationMatrix": matrix,
    }
    objects = {"a": {"type": "CityFurniture", "geometry": [instance]}}
    path = tmp_path / "box.json"
    path.write_text(json.dumps(city(objects, **{"geometry-templates": template})))
    is_the_box(read(path))


def test_the_formats_that_are_promised():
    promised = "csv glb gltf json jsonl las laz obj off pcd ply stl txt xyz"
    assert extensions() == tuple("." + name for name in promised.split())
