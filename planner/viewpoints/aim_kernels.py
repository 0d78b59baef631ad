"""Compiled loops over aim directions; import only where candidates are made."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.geometry.compiled import compiled

Array = NDArray[Any]


@compiled
def best_aims(  # noqa: PLR0917 - compiled
    positions: Array,
    samples: Array,
    indptr: Array,
    sample: Array,
    axes: Array,
    bounds: Array,
    weights: Array,
    chosen: Array,
    sizes: Array,
    masks: Array,
) -> None:
    """Choose each position's aims one by one by the weight of what they newly see.

    ``axes`` (A, 3, 3) and ``bounds`` describe the A <= 64 pictures. ``chosen`` (V, most) gets
    the aims in order of choice, -1 where nothing new is left; ``sizes`` how many pairs each
    holds; ``masks`` (n,) the aims that hold each pair, a bit each. ``weights`` (S,) are whole
    numbers, so that equal aims tie exactly and the first one wins.
    """
    aims, most = len(axes), chosen.shape[1]
    west, east, south, north = bounds[0], bounds[1], bounds[2], bounds[3]
    rx, ry, rz = axes[:, 0, 0].copy(), axes[:, 0, 1].copy(), axes[:, 0, 2].copy()
    ux, uy, uz = axes[:, 1, 0].copy(), axes[:, 1, 1].copy(), axes[:, 1, 2].copy()
    fx, fy, fz = axes[:, 2, 0].copy(), axes[:, 2, 1].copy(), axes[:, 2, 2].copy()
    gain = np.empty(aims, dtype=np.int64)
    one = np.uint64(1)
    for v in range(len(positions)):
        for a in range(aims):
            gain[a] = 0
        for at in range(indptr[v], indptr[v + 1]):
            s = sample[at]
            x = samples[s, 0] - positions[v, 0]
            y = samples[s, 1] - positions[v, 1]
            z = samples[s, 2] - positions[v, 2]
            mask = np.uint64(0)
            for a in range(aims):  # without branches, several aims at once
                depth = fx[a] * x + fy[a] * y + fz[a] * z
                right = rx[a] * x + ry[a] * y + rz[a] * z
                up = ux[a] * x + uy[a] * y + uz[a] * z
                across = (right >= west * depth) & (right <= east * depth)
                along = (up >= south * depth) & (up <= north * depth)
                held = one if (depth > 0.0) & across & along else np.uint64(0)
                mask |= held << np.uint64(a)
            masks[at] = mask
            _weigh(gain, mask, weights[s])
        for turn in range(most):
            chosen[v, turn], sizes[v, turn] = -1, 0
        seen = np.uint64(0)
        for turn in range(most):
            best = 0
            for a in range(1, aims):
                if gain[a] > gain[best]:
                    best = a
            bit = one << np.uint64(best)
            size, fresh = 0, 0
            for at in range(indptr[v], indptr[v + 1]):
                mask = masks[at]
                if not mask & bit:
                    continue
                size += 1
                if mask & seen:
                    continue
                fresh += 1
                _weigh(gain, mask, -weights[sample[at]])
            if fresh == 0:
                break
            chosen[v, turn], sizes[v, turn] = best, size
            seen |= bit


@compiled
def _weigh(gain: Array, mask: np.uint64, weight: int) -> None:
    """Add a weight to the gains of the aims in a mask."""
    for a in range(len(gain)):
        gain[a] += weight if (mask >> np.uint64(a)) & np.uint64(1) else 0


@compiled
def list_pairs(indptr: Array, masks: Array, owner: Array, aim: Array, out: Array) -> None:
    """Write the pairs that each candidate (position ``owner``, ``aim``) holds, in order."""
    count = 0
    for k in range(len(owner)):
        bit = np.uint64(1) << np.uint64(aim[k])
        for at in range(indptr[owner[k]], indptr[owner[k] + 1]):
            if masks[at] & bit:
                out[count] = at
                count += 1
