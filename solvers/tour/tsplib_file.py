"""The keywords and sections of a TSPLIB file, with the line that is to blame."""

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from solvers.arrays import Floats
from solvers.errors import InvalidProblem
from solvers.tour.distances import MATRICES, entries
from solvers.tour.problem import Order

LARGEST = 20_000
"""Most places that a file may ask for: the costs of so many fill 3.2 GB."""

_MOST_BYTES = 4_000_000_000  # of a file: LARGEST places as a full matrix of nine characters each


class Lines:
    """The lines of a file with their numbers, for messages that say where."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.number = 0
        try:
            if path.stat().st_size > _MOST_BYTES:
                raise InvalidProblem(f"{path}: larger than {_MOST_BYTES} bytes.")
            self._text = path.read_text(encoding="utf-8", errors="replace").splitlines()
        except OSError as error:
            raise InvalidProblem(f"{path}: cannot be read: {error.strerror}") from error

    def __iter__(self) -> Iterator[str]:
        while self.number < len(self._text):
            self.number += 1
            line = self._text[self.number - 1].strip()
            if line:
                yield line

    def back(self) -> None:
        """Have the line read last once more."""
        self.number -= 1

    def wrong(self, what: str, number: int | None = None) -> InvalidProblem:
        """Error that names the file and a line, by default the one read last."""
        at = self.number if number is None else number
        return InvalidProblem(f"{self.path}, line {at}: {what}.")


@dataclass
class Parts:
    """Keywords and sections of one file, read in order.

    Raises
    ------
    InvalidProblem
        At the first line that makes no sense.

    """

    lines: Lines
    words: dict[str, tuple[str, int]] = field(default_factory=dict)
    places: dict[str, Floats] = field(default_factory=dict)
    numbers: Floats | None = None
    order: Order | None = None

    def __post_init__(self) -> None:
        sections: dict[str, Callable[[str], None]] = {
            "NODE_COORD_SECTION": self._read_places,
            "DISPLAY_DATA_SECTION": self._read_places,
            "EDGE_WEIGHT_SECTION": self._read_matrix,
            "TOUR_SECTION": self._read_order,
        }
        for line in self.lines:
            word, colon, value = (part.strip() for part in line.partition(":"))
            if word == "EOF":
                break
            if word in sections:
                sections[word](word)
            elif re.fullmatch(r"[A-Z_]+_SECTION", word):
                raise self.lines.wrong(f"{word} is not understood")
            elif colon:
                self.words[word] = (value, self.lines.number)
            else:
                raise self.lines.wrong(f"expected 'KEYWORD : value' or a section, got {line!r}")

    def get(self, word: str, default: str = "") -> str:
        """Value of a keyword."""
        return self.words.get(word, (default, 0))[0]

    def need(self, word: str) -> str:
        """Value of a keyword that must be there."""
        if word not in self.words:
            raise self.lines.wrong(f"the file says no {word}")
        return self.get(word)

    def wrong(self, word: str, what: str) -> InvalidProblem:
        """Error that names the line of a keyword."""
        return self.lines.wrong(what, self.words[word][1])

    def size(self) -> int:
        """Number of places, at most :data:`LARGEST`."""
        text = self.need("DIMENSION")
        if not text.isdecimal() or not 1 <= int(text) <= LARGEST:
            raise self.wrong("DIMENSION", f"DIMENSION must be 1 to {LARGEST}, got {text!r}")
        return int(text)

    def _read_places(self, section: str) -> None:
        size = self.size()
        rows: dict[int, list[float]] = {}
        for line in self.lines:
            if not re.match(r"[-+.\d]", line):
                self.lines.back()
                break
            values = self._floats(line)
            number, row = values[0], values[1:]
            if number != int(number) or not 1 <= number <= size:
                raise self.lines.wrong(f"place {number:g} is not one of 1 to {size}")
            if int(number) in rows:
                raise self.lines.wrong(f"place {number:g} comes twice")
            if len(row) not in {2, 3} or (rows and len(row) != len(next(iter(rows.values())))):
                raise self.lines.wrong(f"a place has 2 or 3 coordinates, this one {len(row)}")
            rows[int(number)] = row
        if len(rows) < size:
            absent = next(place for place in range(1, size + 1) if place not in rows)
            raise self.lines.wrong(f"{section} ends without place {absent}")
        self.places[section] = np.array([rows[place + 1] for place in range(size)])

    def _read_matrix(self, _section: str) -> None:
        size, form = self.size(), self.get("EDGE_WEIGHT_FORMAT", "FULL_MATRIX")
        if form not in MATRICES:
            raise self.wrong("EDGE_WEIGHT_FORMAT", f"{form} is none of {', '.join(MATRICES)}")
        wanted, found, rows = entries(form, size), 0, []
        for line in self.lines:
            if found == wanted or not re.match(r"[-+.\d]", line):
                self.lines.back()
                break
            rows.append(np.array(self._floats(line)))
            found += len(rows[-1])
            if found > wanted:
                raise self.lines.wrong(
                    f"{form} of {size} places has {wanted} numbers, here {found}"
                )
        if found < wanted:
            raise self.lines.wrong(f"{form} of {size} places has {wanted} numbers, here {found}")
        self.numbers = np.concatenate(rows) if rows else np.empty(0)

    def _read_order(self, _section: str) -> None:
        size = self.size() if "DIMENSION" in self.words else LARGEST  # some tours do not say
        places: list[int] = []
        for line in self.lines:
            if not re.match(r"[-+\d]", line):
                self.lines.back()
                break
            for number in self._floats(line):
                if number == -1:
                    continue
                if number != int(number) or not 1 <= number <= size:
                    raise self.lines.wrong(f"place {number:g} is not one of 1 to {size}")
                places.append(int(number) - 1)
        once = set(places)
        if "DIMENSION" not in self.words:
            size = max(places, default=-1) + 1
        if len(once) != size or len(places) != size or not places:
            raise self.lines.wrong(
                f"the tour has {len(places)} stops at {len(once)} of {size} places"
            )
        self.order = np.array(places, dtype=np.int64)

    def _floats(self, line: str) -> list[float]:
        try:
            values = [float(word) for word in line.split()]
        except ValueError as error:
            raise self.lines.wrong(f"{line[:60]!r} are not all numbers") from error
        if not all(map(math.isfinite, values)):
            raise self.lines.wrong(f"{line[:60]!r} are not all finite")
        return values
