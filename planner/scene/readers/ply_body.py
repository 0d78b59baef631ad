"""Bodies of PLY files: elements one after the other, as text or as bytes."""

from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

import numpy as np

from planner.geometry.arrays import Floats, Ints
from planner.scene.readers.source import refusal, truncated


@dataclass(frozen=True, slots=True)
class PlyProperty:
    """A property: its NumPy type, and for a list the type of its length."""

    name: str
    dtype: str
    count_dtype: str | None = None


@dataclass(frozen=True, slots=True)
class PlyElement:
    """A table of the file: its name, rows and properties."""

    name: str
    count: int
    properties: tuple[PlyProperty, ...]


class BinaryBody:
    """Walks a binary body element by element."""

    def __init__(self, path: Path, body: memoryview, order: str) -> None:
        self._path, self._body, self._order, self._at = path, body, order, 0

    def scalars(self, element: PlyElement) -> dict[str, np.ndarray]:
        """Columns of an element without lists."""
        if any(p.count_dtype for p in element.properties):
            raise refusal(self._path, "its vertices carry lists", "export it as a standard PLY")
        fields = [(p.name, self._order + p.dtype) for p in element.properties]
        try:
            dtype = np.dtype(fields)
        except ValueError as error:
            wrong = f"its vertex properties are unusable ({error})"
            raise refusal(self._path, wrong, "export it as a standard PLY") from error
        table = self._table(dtype, element.count)
        return {p.name: table[p.name] for p in element.properties}

    def polygons(self, element: PlyElement) -> list[Ints]:
        """Vertex rows of each face, in groups of equal length, shape (F_k, k)."""
        if element.count == 0:
            return []
        equal = self._equal_lists(element)
        return equal if equal is not None else self._walk(element)

    def skip(self, element: PlyElement) -> None:
        """Pass over an element that is of no use here."""
        if any(p.count_dtype for p in element.properties):
            self._walk(element)
        else:
            self.scalars(element)

    def _table(self, dtype: np.dtype[np.void], count: int) -> np.ndarray:
        need = dtype.itemsize * count
        if need > len(self._body) - self._at:
            have = (len(self._body) - self._at) // max(1, dtype.itemsize)
            raise truncated(self._path, f"{have} of {count} records")
        table = np.frombuffer(self._body, dtype, count, self._at)
        self._at += need
        return table

    def _equal_lists(self, element: PlyElement) -> list[Ints] | None:
        """All faces at once where every list has the length of the first; else ``None``."""
        at = self._at
        fields: list[tuple[str, str, tuple[int, ...]]] = []
        for i, p in enumerate(element.properties):
            if p.count_dtype is None:
                fields.append((f"p{i}", self._order + p.dtype, ()))
                at += np.dtype(p.dtype).itemsize
                continue
            width = np.dtype(p.count_dtype).itemsize
            if at + width > len(self._body):
                return None
            length = int(np.frombuffer(self._body, self._order + p.count_dtype, 1, at)[0])
            if not 0 <= length <= 64:
                return None
            fields.append((f"n{i}", self._order + p.count_dtype, ()))
            fields.append((f"p{i}", self._order + p.dtype, (length,)))
            at += width + length * np.dtype(p.dtype).itemsize
        dtype = np.dtype(fields)
        if dtype.itemsize * element.count > len(self._body) - self._at:
            return None
        table = np.frombuffer(self._body, dtype, element.count, self._at)
        for name in table.dtype.names or ():
            if name.startswith("n") and (table[name] != table[name][0]).any():
                return None
        self._at += dtype.itemsize * element.count
        at_list = _face_list(self._path, element)
        return [table[f"p{at_list}"].astype(np.int64)]

    def _walk(self, element: PlyElement) -> list[Ints]:
        """Face by face, for lists of mixed length."""
        kinds = [
            (
                np.dtype(self._order + p.dtype),
                None if p.count_dtype is None else np.dtype(self._order + p.count_dtype),
            )
            for p in element.properties
        ]
        wanted = _face_list(self._path, element) if element.name == "face" else -1
        found: dict[int, list[np.ndarray]] = {}
        for _ in range(element.count):
            for i, (dtype, count_dtype) in enumerate(kinds):
                length = 1 if count_dtype is None else int(self._table(count_dtype, 1)[0])
                values = self._table(dtype, max(0, length))
                if i == wanted:
                    found.setdefault(len(values), []).append(values)
        return [np.array(rows, dtype=np.int64) for _, rows in sorted(found.items())]


class AsciiBody:
    """Walks an ascii body element by element."""

    def __init__(self, path: Path, body: memoryview) -> None:
        self._path, self._at = path, 0
        self._lines = bytes(body).decode("ascii", "replace").splitlines()

    def scalars(self, element: PlyElement) -> dict[str, np.ndarray]:
        """Columns of an element without lists."""
        names = [p.name for p in element.properties]
        words = " ".join(self._take(element.count)).split()
        if len(words) != element.count * len(names):
            self._damaged(f"{len(words)} numbers in {element.count} lines of {element.name}")
        table = self._numbers(words).reshape(element.count, len(names))
        return {name: table[:, i] for i, name in enumerate(names)}

    def polygons(self, element: PlyElement) -> list[Ints]:
        """Vertex rows of each face, in groups of equal length, shape (F_k, k)."""
        wanted = _face_list(self._path, element) if element.count else -1
        found: dict[int, list[list[int]]] = {}
        for line in self._take(element.count):
            words, at = line.split(), 0
            try:
                for i, p in enumerate(element.properties):
                    length = 1 if p.count_dtype is None else int(words[at])
                    at += 0 if p.count_dtype is None else 1
                    if i == wanted:
                        rows = [int(word) for word in words[at : at + length]]
                        if len(rows) != length:
                            self._damaged(f"face line {line[:40]!r}")
                        found.setdefault(length, []).append(rows)
                    at += length
            except (ValueError, IndexError):
                self._damaged(f"face line {line[:40]!r}")
        return [np.array(rows, dtype=np.int64) for _, rows in sorted(found.items())]

    def skip(self, element: PlyElement) -> None:
        """Pass over an element that is of no use here."""
        self._take(element.count)

    def _take(self, count: int) -> list[str]:
        lines = self._lines[self._at : self._at + count]
        if len(lines) < count:
            self._damaged(f"{len(lines)} of {count} lines")
        self._at += count
        return lines

    def _numbers(self, words: list[str]) -> Floats:
        try:
            return np.array(words, dtype=np.float64)
        except ValueError as error:
            self._damaged(str(error))

    def _damaged(self, what: str) -> NoReturn:
        raise truncated(self._path, what)


def _face_list(path: Path, element: PlyElement) -> int:
    """Which property of a face lists its vertices."""
    for i, p in enumerate(element.properties):
        if p.count_dtype is not None and p.name in {"vertex_indices", "vertex_index"}:
            return i
    raise refusal(path, "its faces name no vertex_indices", "export it as a standard PLY")
