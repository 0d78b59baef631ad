"""Compiled loops of photos that are moved; import only where they are."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.geometry.compiled import compiled

Array = NDArray[Any]


@compiled
def _pair(a: Array, b: Array, table: Array) -> float:
    """Worth of two views of a sample: ray, nearness and cosine of each, shape (5,)."""
    near, face = min(a[3], b[3]), min(a[4], b[4])
    if near <= 0.0 or face <= 0.0:
        return 0.0
    x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    place = math.sqrt(x * x + y * y + z * z) * (0.5 * (len(table) - 1))
    low = min(int(place), len(table) - 2)
    share = min(place - low, 1.0)
    return float((table[low] + share * (table[low + 1] - table[low])) * near * face)


@compiled
def is_sharp(view: Array, limits: Array) -> bool:
    """Whether a view of a sample is sharp; see :attr:`~planner.viewpoints.moves.Wish.limits`."""
    distance, cosine = (1.0 - view[3]) * limits[0], view[4]
    return bool(cosine >= limits[1] and distance <= min(limits[2], limits[3] * cosine))


@compiled
def by_sample(sample: Array, owner: Array, sight: Array, size: int) -> tuple[Array, Array, Array]:
    """Sort rows by sample, of which there are ``size``: row starts, owners and sights."""
    starts = np.zeros(size + 1, dtype=np.int64)
    for s in sample:
        starts[s + 1] += 1
    for s in range(size):
        starts[s + 1] += starts[s]
    place = starts.copy()
    owners, sights = np.empty_like(owner), np.empty_like(sight)
    for row in range(len(sample)):
        at = place[sample[row]]
        place[sample[row]] += 1
        owners[at] = owner[row]
        for column in range(5):
            sights[at, column] = sight[row, column]
    return starts, owners, sights


@compiled
def tally(  # noqa: PLR0917 - compiled
    rows: Array,
    starts: Array,
    sight: Array,
    table: Array,
    limits: Array,
    value: Array,
    sharp: Array,
) -> None:
    """Write reconstructability and number of sharp views of some samples.

    The views of sample s are rows ``starts[s]`` to the next of ``sight``.
    """
    for s in rows:
        total, count = 0.0, 0
        for i in range(starts[s], starts[s + 1]):
            count += is_sharp(sight[i], limits)
            for j in range(starts[s], i):
                total += _pair(sight[i], sight[j], table)
        value[s], sharp[s] = total, count


@compiled
def own_share(  # noqa: PLR0917 - compiled
    view: int,
    samples: Array,
    starts: Array,
    owner: Array,
    sight: Array,
    table: Array,
    limits: Array,
) -> tuple[Array, Array]:
    """What one view gives to each of its samples, which are distinct: both (n,).

    These are the reconstructability that it adds, and whether it is sharp there, as 0 or 1.
    """
    total, sharp = np.zeros(len(samples)), np.zeros(len(samples), dtype=np.int64)
    for n in range(len(samples)):
        first, last = starts[samples[n]], starts[samples[n] + 1]
        for i in range(first, last):
            if owner[i] == view:
                sharp[n] = is_sharp(sight[i], limits)
                for j in range(first, last):
                    if j != i:
                        total[n] += _pair(sight[i], sight[j], table)
    return total, sharp


@compiled
def gains(  # noqa: PLR0917 - compiled
    request: Array,
    sample: Array,
    seen: Array,
    member: Array,
    views: Array,
    base: Array,
    base_sharp: Array,
    want: Array,
    target: Array,
    sharp_worth: float,
    limits: Array,
    starts: Array,
    owner: Array,
    sight: Array,
    table: Array,
) -> Array:
    """What a view moved to a place would add to each sample that it would see from there.

    Rows of ``seen`` (n, 5) are the rays, nearness and cosine; ``request`` (n,) the place of
    each row and ``sample`` (n,) its sample. Place r is one for view ``views[member[r]]``, and
    ``base`` and ``base_sharp`` (members, S) hold what the other views give.
    """
    gain = np.zeros(len(request))
    for k in range(len(request)):
        s, row = sample[k], member[request[k]]
        room, total = target[s] - base[row, s], 0.0
        for i in range(starts[s], starts[s + 1]):
            if total >= room:
                break
            if owner[i] != views[row]:
                total += _pair(seen[k], sight[i], table)
        gain[k] = max(0.0, min(total, room))
        if base_sharp[row, s] < want[s] and is_sharp(seen[k], limits):
            gain[k] += sharp_worth
    return gain


@compiled
def best_aims(
    rays: Array, gain: Array, indptr: Array, axes: Array, bounds: Array
) -> tuple[Array, Array]:
    """Aim of each place whose picture holds most gain, and that gain; the first one on ties.

    ``rays`` (n, 3) run from the camera to the sample, place by place as in ``indptr``; ``axes``
    (A, 3, 3) and ``bounds`` describe the pictures.
    """
    places, aims = len(indptr) - 1, len(axes)
    best, most = np.zeros(places, dtype=np.int64), np.zeros(places)
    total = np.empty(aims)
    west, east, south, north = bounds[0], bounds[1], bounds[2], bounds[3]
    for p in range(places):
        total[:] = 0.0
        for k in range(indptr[p], indptr[p + 1]):
            x, y, z = rays[k, 0], rays[k, 1], rays[k, 2]
            for a in range(aims):
                depth = axes[a, 2, 0] * x + axes[a, 2, 1] * y + axes[a, 2, 2] * z
                if depth <= 0.0:
                    continue
                right = axes[a, 0, 0] * x + axes[a, 0, 1] * y + axes[a, 0, 2] * z
                if right < west * depth or right > east * depth:
                    continue
                up = axes[a, 1, 0] * x + axes[a, 1, 1] * y + axes[a, 1, 2] * z
                if south * depth <= up <= north * depth:
                    total[a] += gain[k]
        best[p] = np.argmax(total)
        most[p] = total[best[p]]
    return best, most
