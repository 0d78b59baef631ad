"""Photos that are moved in turn, each to where it adds most to what the others show."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from planner.geometry.arrays import Floats, Ints
from planner.viewpoints.camera import Camera
from planner.viewpoints.candidates import aim_directions
from planner.viewpoints.eye import Album, Eye, Seen
from planner.viewpoints.free_balls import FreeBalls
from planner.viewpoints.frustum import in_frustum
from planner.viewpoints.moves import BatchJob, Moves, Wish, move_views
from planner.viewpoints.reconstructability import parallax_weight
from solvers.pairs import chord_table

_APART = 1.0  # of the reference distance: photos farther apart than this are independent
_TOGETHER = 16  # photos of one job


class Crowd:
    """All photos while they are moved.

    Parameters
    ----------
    positions, yaw_deg, pitch_deg
        The photos; shapes (K, 3), (K,) and (K,).
    eye, space, camera
        What can be seen from a place, where photos may be taken, and the field of view.
    wish
        What they are moved for.
    directions
        How many directions of the gimbal are tried at each place.

    """

    def __init__(
        self,
        positions: Floats,
        yaw_deg: Floats,
        pitch_deg: Floats,
        *,
        eye: Eye,
        space: FreeBalls,
        camera: Camera,
        wish: Wish,
        directions: int,
    ) -> None:
        self._eye, self._space, self._camera, self._wish = eye, space, camera, wish
        self._directions = directions
        self._table = chord_table(parallax_weight)
        self.positions = np.array(positions)
        self.yaw_deg, self.pitch_deg = np.array(yaw_deg), np.array(pitch_deg)
        size = len(eye.samples)
        self._shown = list(self._photograph(np.arange(len(yaw_deg))))
        self._value, self._sharp = np.zeros(size), np.zeros(size, dtype=np.int64)
        self._stale = np.ones(size, dtype=np.bool_)  # whose value and sharp are of yesterday

    def move(self, *, step: float, evaluations: int, map: Callable[..., Any] = map) -> int:  # noqa: A002 - it is a map
        """Move each photo once, if that helps; photos far apart are moved at the same time.

        Parameters
        ----------
        step
            First step of each search, metres.
        evaluations
            Places that each search looks at.
        map
            Runs :func:`~planner.viewpoints.moves.move_views`; anything like :func:`map`. The
            result does not depend on who runs it when.

        Returns
        -------
        moved
            Number of photos that were moved.

        """
        moved = 0
        for batch in far_apart(self.positions.copy(), _APART * self._eye.reference):
            jobs = list(self._jobs(batch, step=step, evaluations=evaluations))
            for moves in list(map(move_views, jobs)):
                self._accept(moves)
                moved += len(moves.views)
        return moved

    @property
    def seen(self) -> Seen:
        """What the pictures hold, photo by photo."""
        parts = self._shown
        return Seen(
            np.repeat(np.arange(len(parts)), [len(part.sample) for part in parts]),
            np.concatenate([part.sample for part in parts]),
            np.concatenate([part.sight for part in parts]),
        )

    def _photograph(self, rows: Ints) -> Iterator[Seen]:
        """What the picture of each of some photos holds."""
        seen = self._eye.see(self.positions[rows])
        turn, tilt = self.yaw_deg[rows][seen.owner], self.pitch_deg[rows][seen.owner]
        seen = seen.rows(in_frustum(-seen.sight[:, :3], turn, tilt, self._camera))
        ends = np.searchsorted(seen.owner, np.arange(len(rows) + 1))
        for row in range(len(rows)):
            yield seen.rows(slice(ends[row], ends[row + 1]))

    def _album(self) -> Album:
        """What all photos see now; value and sharp photos of each sample are brought up to it."""
        from planner.viewpoints.move_kernels import tally

        album = Album.of(self.seen, len(self._eye.samples))
        rows, limits = np.flatnonzero(self._stale), self._wish.limits(self._eye.reference)
        tally(rows, album.starts, album.sight, self._table, limits, self._value, self._sharp)
        self._stale[:] = False
        return album

    def _jobs(self, batch: Ints, *, step: float, evaluations: int) -> Iterator[BatchJob]:
        """Jobs that move some photos while all others stay."""
        from planner.viewpoints.move_kernels import own_share

        wish, album = self._wish, self._album()
        known = (album.starts, album.owner, album.sight, self._table)
        limits = wish.limits(self._eye.reference)
        for first in range(0, len(batch), _TOGETHER):
            views = batch[first : first + _TOGETHER]
            base = np.tile(self._value, (len(views), 1))
            base_sharp = np.tile(self._sharp, (len(views), 1))
            worth = np.empty(len(views))
            for row, view in enumerate(views):
                own = self._shown[view].sample
                value, sharp = own_share(view, own, *known, limits)
                base[row, own] = np.maximum(base[row, own] - value, 0.0)
                base_sharp[row, own] -= sharp
                now = wish.worth(self._value[own], self._sharp[own], own)
                worth[row] = (now - wish.worth(base[row, own], base_sharp[row, own], own)).sum()
            yield BatchJob(
                *(self._eye, self._space, self._camera, album, views),
                places=self.positions[views],
                base=base,
                base_sharp=base_sharp,
                worth=worth,
                wish=wish,
                size=step,
                evaluations=evaluations,
                directions=self._directions,
                table=self._table,
            )

    def _accept(self, moves: Moves) -> None:
        """Take over better poses."""
        rows = moves.views
        if not len(rows):
            return
        yaw, pitch = aim_directions(self._directions, self._camera)
        self.positions[rows] = moves.places
        self.yaw_deg[rows], self.pitch_deg[rows] = yaw[moves.aims], pitch[moves.aims]
        for row, fresh in zip(rows, self._photograph(rows), strict=True):
            self._stale[self._shown[row].sample] = self._stale[fresh.sample] = True
            self._shown[row] = fresh


def far_apart(places: Floats, distance: float) -> Iterator[Ints]:
    """Split places, (n, 3), into few groups with no two closer than a distance."""
    left = np.arange(len(places))
    while len(left):
        taken: list[int] = []
        open_ = np.ones(len(left), dtype=np.bool_)
        while open_.any():
            row = left[np.argmax(open_)]
            gaps = places[left] - places[row]
            open_ &= np.einsum("ij,ij->i", gaps, gaps) >= distance**2
            open_[np.searchsorted(left, row)] = False
            taken.append(int(row))
        yield np.array(taken)
        left = np.setdiff1d(left, taken)
