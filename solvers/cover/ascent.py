"""Lower bounds by Lagrangian relaxation, climbed by the volume algorithm."""

import numpy as np
from numpy.typing import NDArray

from solvers.arrays import Floats
from solvers.cover.rows import Rows, restricted

_FIRST, _LONGEST = 10, 100  # steps between two pricings of all sets
_SPARE = 5  # sets that a row of the core has to choose from, over its demand
_WHOLE = 0.6  # share of all entries above which a core does not pay
_MISSED = 1e-6  # relative; what the sets outside may take off before they are let in


class Ascent:
    r"""Multipliers :math:`u \ge 0` of the demand, and the lower bound that they prove.

    .. math::
        L(u) = \sum_r w_r(u)\,u_r + \sum_j \min\Big(0, p_j - \sum_{r \ni j} u_r\Big)

    with the wanted hits ``w`` of plain rows, and for each group of sector rows the sum of
    its smallest multipliers, as many as sectors are wanted; of a part of conflicting sets
    only the smallest term counts. L is concave, and its maximum is the bound of the linear
    relaxation (without conflicts that overlap).

    It is climbed by the volume algorithm (Barahona and Anbil, 2000,
    doi:10.1007/s101070050002), aimed at 1.05 times the best value, on a core of promising
    sets that is priced against all of them every now and then (as by Caprara, Fischetti and
    Toth, 1999, doi:10.1287/opre.47.5.730). The bound comes from pricings alone.

    Attributes
    ----------
    bound
        Best value of L so far, with every set priced; infinite once it is above the price
        of all sets, since then there is no cover.
    multipliers
        Multipliers behind it, shape (rows,).
    taken, work
        Steps taken and entries looked at so far: what it cost, but for the machine.
    done
        Whether it cannot go on: the maximum is reached, as far as can be told.

    """

    def __init__(self, rows: Rows) -> None:
        from solvers.cover import ascent_kernels

        self._rows = rows
        count = len(rows.wanted)
        sizes = np.diff(rows.starts)
        share = np.repeat(rows.prices / np.maximum(sizes, 1), sizes)
        self._centre = np.full(count, np.inf)
        np.minimum.at(self._centre, rows.rows, share)
        self._want, self._hits = np.empty(count, np.int32), np.empty(count, np.int32)
        self._reduced = np.empty(len(rows.prices))
        self._kernels = ascent_kernels
        self._core = rows
        self._inside: NDArray[np.bool_] = np.zeros(len(rows.prices), dtype=np.bool_)
        self._step = np.array([0.1, 0.1, 0.0, 0.0])
        self._pace, self.taken, self._refresh = _FIRST, 0, _FIRST
        self._mark = (0, -np.inf)
        self.work = 0
        self.done = False
        self.bound = -np.inf
        value = self._price()
        self._direction = (self._want - self._hits).astype(np.float64)
        self._renew_core(missed=True)
        self._value = value

    def reduced_at(self, multipliers: Floats) -> Floats:
        """Reduced costs of the sets at some multipliers, shape (sets,)."""
        reduced = np.empty(len(self._rows.prices))
        self._kernels.relax(self._rows, multipliers, self._want, self._hits, reduced)
        return reduced

    def core(self, reduced: Floats, spare: int) -> NDArray[np.bool_]:
        """Whether each set has a negative reduced cost or is among the best of a row.

        A row has its demand to choose from, and ``spare`` sets more.
        """
        order = np.argsort(reduced, kind="stable")
        return np.asarray(self._kernels.core(self._rows, order, reduced, spare))

    def climb(self, *, work: float, steps: int) -> None:
        """Go on until that many entries more were looked at, or steps taken, or it is done."""
        enough, last = self.work + work, self.taken + steps
        while not self.done and self.work < enough and self.taken < last:
            pace = min(self._pace, last - self.taken)
            reached = self._kernels.climb(
                self._core, self._centre, self._direction, self._value, self._step, pace
            )
            self.taken += pace
            self.work += pace * len(self._core.rows)
            self._value = self._price()
            missed = self._value < reached - _MISSED * abs(reached)
            if self._value < self.bound:  # the core led astray
                self._centre[:], self._value = self.multipliers, self.bound
            self._pace = max(_FIRST, pace // 2) if missed else min(_LONGEST, 2 * pace)
            self.done |= bool(self._step[3]) and not missed
            self._step[3] = 0.0
            self._slow_down()
            self._renew_core(missed=missed)

    def _price(self) -> float:
        """Value at the centre with every set looked at; keeps it if it is the best."""
        value = self._kernels.relax(self._rows, self._centre, self._want, self._hits, self._reduced)
        self.work += len(self._rows.rows)
        if value > self.bound:
            self.bound, self.multipliers = value, self._centre.copy()
            if value > 1.001 * self._rows.prices.sum():
                self.bound, self.done = np.inf, True
        return value

    def _slow_down(self) -> None:
        """Average over more supergradients where fifty steps brought less than a hundredth."""
        steps, bound = self._mark
        if self.taken - steps >= 50:
            if self.bound < bound + 0.01 * abs(bound):
                self._step[1] = max(1e-4, 0.7 * self._step[1])
            self._mark = (self.taken, self.bound)

    def _renew_core(self, *, missed: bool) -> None:
        """Let in what was missed; at steps 10, 20, 40 and so on also choose anew."""
        if self._inside.all() or not (missed or self.taken >= self._refresh):
            return
        fresh = self.core(self._reduced, _SPARE)
        if not missed:
            self._inside[:] = False
            self._refresh = 2 * self.taken
        self._inside |= fresh
        if np.diff(self._rows.starts)[self._inside].sum() > _WHOLE * len(self._rows.rows):
            self._inside[:] = True
        chosen = np.flatnonzero(self._inside)
        self._core = self._rows if self._inside.all() else restricted(self._rows, chosen)
