"""Which reader reads a file: by its extension, after a look at its first bytes."""

from collections.abc import Callable
from pathlib import Path

from planner.scene.readers.cityjson import read_cityjson
from planner.scene.readers.gltf import read_gltf
from planner.scene.readers.las import read_las
from planner.scene.readers.obj import read_obj
from planner.scene.readers.off import read_off
from planner.scene.readers.pcd import read_pcd
from planner.scene.readers.ply import read_ply
from planner.scene.readers.source import Source, refusal
from planner.scene.readers.stl import read_stl
from planner.scene.readers.xyz import read_xyz

_READERS: dict[str, Callable[[Path], Source]] = {
    ".ply": read_ply,
    ".pcd": read_pcd,
    ".xyz": read_xyz,
    ".csv": read_xyz,
    ".txt": read_xyz,
    ".obj": read_obj,
    ".stl": read_stl,
    ".off": read_off,
    ".glb": read_gltf,
    ".gltf": read_gltf,
    ".json": read_cityjson,
    ".jsonl": read_cityjson,
}
_LAS = (".las", ".laz")
_LARGEST = 16 * 10**9  # bytes
_MAGIC: tuple[tuple[bytes, tuple[str, ...]], ...] = (  # first bytes, what they stand for
    (b"ply", (".ply",)),
    (b"LASF", _LAS),
    (b"glTF", (".glb",)),
    (b"# .PCD", (".pcd",)),
    (b"VERSION", (".pcd",)),
    (b"FIELDS", (".pcd",)),
    (b"OFF", (".off",)),
    (b"COFF", (".off",)),
    (b"NOFF", (".off",)),
    (b"CNOFF", (".off",)),
    (b"STOFF", (".off",)),
    (b"PK\x03\x04", ("a ZIP archive",)),
    (b"\x1f\x8b", ("a GZIP archive",)),
    (b"<?xml", ("an XML document",)),
    (b"\x89PNG", ("a picture",)),
    (b"\xff\xd8\xff", ("a picture",)),
    (b"II*\x00", ("a picture",)),
)


def extensions() -> tuple[str, ...]:
    """Every extension that :func:`read_source` takes, sorted."""
    return tuple(sorted((*_READERS, *_LAS)))


def read_source(path: Path, *, limit: int) -> Source:
    """Read a scene file by its extension.

    Parameters
    ----------
    path
        File to read.
    limit
        Most points to take from a format that is made for huge clouds (LAS).

    Returns
    -------
    source
        The content, with at least one point.

    Raises
    ------
    PlannerError
        If the file is missing, empty, of an unknown or wrong extension, or damaged.

    """
    _check_file(path)
    kind = path.suffix.lower()
    source = read_las(path, limit=limit) if kind in _LAS else _READERS[kind](path)
    if len(source.xyz) == 0:
        raise refusal(path, "it holds no points", "give a scan with points or a mesh with faces")
    if source.triangles is not None and len(source.triangles) == 0:
        raise refusal(path, "the mesh has no faces", "export it with faces, or as a PLY cloud")
    return source


def _check_file(path: Path) -> None:
    """Refuse what cannot be a scene file, before anything is read of it."""
    if path.is_dir():
        raise refusal(path, "it is a folder", "name a scene file in it")
    if not path.exists():
        raise refusal(path, "there is no such file", "check the path")
    if not path.is_file():
        raise refusal(path, "it is no ordinary file", "name a scene file")
    kind = path.suffix.lower()
    if kind not in extensions():
        known = " ".join(extensions())
        raise refusal(path, f"the extension {kind!r} is unknown", f"convert it to one of {known}")
    size = path.stat().st_size
    if size == 0:
        raise refusal(path, "the file is empty", "copy or export it again")
    if size > _LARGEST:
        raise refusal(path, f"it has {size / 1e9:.0f} GB", "thin it or cut out the part to plan")
    try:
        with path.open("rb") as file:
            start = file.read(1024)
    except OSError as error:
        raise refusal(path, f"it cannot be read ({error.strerror})", "mend its rights") from error
    _check_content(path, kind, start)


def _check_content(path: Path, kind: str, start: bytes) -> None:
    """Refuse a file whose first bytes say that it is something else than its extension."""
    text = start.removeprefix(b"\xef\xbb\xbf").lstrip()
    while text.startswith(b"#") and not text.startswith(b"# .PCD"):
        text = text.partition(b"\n")[2].lstrip()
    for magic, kinds in _MAGIC:
        if not text.startswith(magic):
            continue
        if kind in kinds:
            return
        if kinds[0] in extensions():
            wrong = f"its content is {kinds[0][1:].upper()}, not {kind[1:].upper()}"
            raise refusal(path, wrong, f"rename it to {path.with_suffix(kinds[0]).name}")
        raise refusal(path, f"it is {kinds[0]}", "give the scan or the model itself")
    if any(kind in kinds for _, kinds in _MAGIC):
        wrong = f"its content is not {kind[1:].upper()}"
        raise refusal(path, wrong, "give it the extension of its format, or export it again")
