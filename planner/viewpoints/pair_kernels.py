"""Compiled loops over position-sample pairs; import only where pairs are made."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.geometry.compiled import compiled

Array = NDArray[Any]


@compiled
def facing_pairs(  # noqa: PLR0917 - compiled
    positions: Array,
    samples: Array,
    normals: Array,
    tangents: Array,
    rows: Array,
    limits: Array,
    sectors: int,
    starts: Array,
    sample: Array,
    distance: Array,
    cosine: Array,
    sector: Array,
    stages: Array,
) -> int:
    """Find the pairs within all limits but occlusion; return how many.

    ``limits`` holds nearest, farthest, least cosine, reach, sines of the lowest and highest
    elevation and the cosine of the cap. ``rows`` are the samples to look at. The outputs
    hold the pairs position by position; ``stages`` (3, S) gains how many positions pass
    range and incidence, then the gimbal too, then the ground sample distance too.
    """
    near2, far2 = limits[0] * limits[0], limits[1] * limits[1]
    least, reach, low, high, cap = limits[2], limits[3], limits[4], limits[5], limits[6]
    around = max(1, sectors - 1)
    turn = around / (2.0 * math.pi)
    count = 0
    xs, ys, zs = samples[rows, 0], samples[rows, 1], samples[rows, 2]
    ranges, near = np.empty(len(rows)), np.empty(len(rows), dtype=np.int64)
    for v in range(len(positions)):
        starts[v] = count
        px, py, pz = positions[v, 0], positions[v, 1], positions[v, 2]
        for k in range(len(rows)):  # without branches, several samples at once
            dx, dy, dz = px - xs[k], py - ys[k], pz - zs[k]
            ranges[k] = dx * dx + dy * dy + dz * dz
        size = 0
        for k in range(len(rows)):  # without branches too: few are near, which few is chance
            near[size] = k
            size += 1 if near2 <= ranges[k] <= far2 else 0
        for k in near[:size]:
            s, squared = rows[k], ranges[k]
            dx, dy, dz = px - xs[k], py - ys[k], pz - zs[k]
            along = dx * normals[s, 0] + dy * normals[s, 1] + dz * normals[s, 2]
            if along <= 0.0:
                continue
            length = math.sqrt(squared)
            if along < least * length:
                continue
            stages[0, s] += 1
            if -dz < low * length or -dz > high * length:
                continue
            stages[1, s] += 1
            if squared > reach * along:
                continue
            stages[2, s] += 1
            sample[count] = s
            distance[count] = length
            cosine[count] = along / length
            if sectors < 2 or along >= cap * length:
                sector[count] = 0
            else:
                x = dx * tangents[s, 0] + dy * tangents[s, 1]
                # second tangent = normal x first, which is level
                y = (dy * normals[s, 2] - dz * normals[s, 1]) * tangents[s, 0] - (
                    dx * normals[s, 2] - dz * normals[s, 0]
                ) * tangents[s, 1]
                place = math.floor((math.atan2(y, x) + 2.0 * math.pi) * turn) % around
                sector[count] = 1 + place
            count += 1
    starts[len(positions)] = count
    return count


@compiled
def in_pictures(  # noqa: PLR0917 - compiled
    positions: Array,
    samples: Array,
    starts: Array,
    sample: Array,
    axes: Array,
    bounds: Array,
    inside: Array,
) -> None:
    """Tell which pairs lie in the one picture taken at each position, rim included.

    ``axes`` (V, 3, 3) are those of the cameras, ``bounds`` the rim at depth 1; ``inside`` (n,)
    gets the answer for the pairs ``starts[v]`` to ``starts[v + 1]`` of each position.
    """
    west, east, south, north = bounds[0], bounds[1], bounds[2], bounds[3]
    for v in range(len(positions)):
        a = axes[v]
        for at in range(starts[v], starts[v + 1]):
            s = sample[at]
            x = samples[s, 0] - positions[v, 0]
            y = samples[s, 1] - positions[v, 1]
            z = samples[s, 2] - positions[v, 2]
            right = a[0, 0] * x + a[0, 1] * y + a[0, 2] * z
            up = a[1, 0] * x + a[1, 1] * y + a[1, 2] * z
            depth = a[2, 0] * x + a[2, 1] * y + a[2, 2] * z
            across = west * depth <= right <= east * depth
            along = south * depth <= up <= north * depth
            inside[at] = depth > 0.0 and across and along


@compiled
def unit_rays(positions: Array, samples: Array, starts: Array, sample: Array, rays: Array) -> None:
    """Fill ``rays`` (n, 3) with the unit vectors from sample to position of each pair."""
    for v in range(len(positions)):
        for at in range(starts[v], starts[v + 1]):
            s = sample[at]
            x = positions[v, 0] - samples[s, 0]
            y = positions[v, 1] - samples[s, 1]
            z = positions[v, 2] - samples[s, 2]
            length = math.sqrt(x * x + y * y + z * z)
            rays[at, 0], rays[at, 1], rays[at, 2] = x / length, y / length, z / length
