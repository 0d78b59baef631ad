"""The gradient that Poisson reconstruction fits, for Eq. 1: smoothed normals, or their projection.

Poisson reconstruction looks for the function whose gradient is nearest to the field of smoothed
normals. Both fields are scaled so that a flat, fully measured sheet has a gradient of length 1.
"""

import numpy as np

from planner.geometry.arrays import Floats, Ints
from planner.scene.cloud import PointCloud
from planner.surface.oriented import normals_of

_CELLS_PER_WIDTH = 1.25  # grid cells in one standard deviation of the smoothing
_REACH = 3.0  # standard deviations after which the smoothing is cut off


def smoothed_normals(cloud: PointCloud, at: Floats, *, width: float, area: Floats) -> Floats:
    r"""Sum of the normals around each position, each with its share of the surface.

    :math:`\vec V(s) = \sum_p a_p K(|s - p|) \vec N_p` with a Gaussian :math:`K` of integral 1 over
    a plane: the right side of the Poisson equation, without its solution.

    Parameters
    ----------
    cloud
        Points with outward unit normals, metres.
    at
        Where the field is wanted, shape (S, 3), metres.
    width
        Standard deviation of the smoothing, metres.
    area
        Surface that each point stands for, shape (N,), square metres.

    Returns
    -------
    field
        Shape (S, 3), about the unit normal over a fully measured surface, 0 in a hole.

    """
    from scipy.spatial import cKDTree

    pairs = cKDTree(at).sparse_distance_matrix(
        cKDTree(cloud.xyz), _REACH * width, output_type="ndarray"
    )
    row, point = pairs["i"], pairs["j"]
    weight = area[point] * np.exp(-0.5 * (pairs["v"] / width) ** 2) / (2.0 * np.pi * width**2)
    normals = normals_of(cloud)
    columns = [
        np.bincount(row, weight * normals[point, axis], minlength=len(at)) for axis in range(3)
    ]
    return np.column_stack(columns)


def poisson_gradient(
    cloud: PointCloud, at: Floats, *, width: float, area: Floats, block: int = 96
) -> Floats:
    r"""Gradient of the solution of the Poisson equation of the smoothed normals.

    In the Fourier domain :math:`\nabla^2 \chi = \nabla \cdot \vec V` is solved by
    :math:`\widehat{\nabla\chi} = k (k \cdot \hat V) / |k|^2`: the part of the field without curl.
    It is done in overlapping blocks, so that memory does not grow with the scene.

    Parameters
    ----------
    cloud, at, width, area
        As in :func:`smoothed_normals`.
    block
        Grid cells along a block, overlap included.

    Returns
    -------
    gradient
        Shape (S, 3), scaled as in :func:`smoothed_normals`.

    """
    cell = width / _CELLS_PER_WIDTH
    core = cell * block / 2
    column = np.floor((at - at.min(axis=0, initial=np.inf)) / core).astype(np.int64)
    blocks, member = np.unique(column, axis=0, return_inverse=True)
    member = member.reshape(-1)
    low = at.min(axis=0, initial=np.inf)
    gradient = np.zeros_like(at)
    for index, place in enumerate(blocks):  # few: a block holds thousands of samples
        corner = low + place * core - 0.25 * cell * block
        rows = np.flatnonzero(member == index)
        gradient[rows] = _block_gradient(
            cloud, at[rows], area, corner=corner, cell=cell, block=block, width=width
        )
    return gradient


def _block_gradient(
    cloud: PointCloud,
    at: Floats,
    area: Floats,
    *,
    corner: Floats,
    cell: float,
    block: int,
    width: float,
) -> Floats:
    from scipy.fft import fftfreq, irfftn, rfftfreq, rfftn
    from scipy.ndimage import map_coordinates

    position = (cloud.xyz - corner) / cell
    inside = ((position >= 0.0) & (position < block - 1)).all(axis=1)
    wave = [2.0 * np.pi * f for f in (fftfreq(block), fftfreq(block), rfftfreq(block))]
    kx, ky, kz = np.meshgrid(*wave, indexing="ij", sparse=True)
    squared = kx**2 + ky**2 + kz**2
    blur = np.exp(-0.5 * squared * (width / cell) ** 2)
    # a sheet smoothed in three dimensions peaks at 1 / (sqrt(2 pi) width)
    blur *= np.sqrt(2.0 * np.pi) * (width / cell) / cell**2
    squared[0, 0, 0] = 1.0
    normals = normals_of(cloud)[inside]
    dot = np.zeros(squared.shape, np.complex128)
    for axis, k in enumerate((kx, ky, kz)):
        dot += k * rfftn(_splat(position[inside], area[inside] * normals[:, axis], block))
    dot *= blur / squared
    wanted = ((at - corner) / cell).T
    return np.column_stack(
        [map_coordinates(irfftn(k * dot, s=(block,) * 3), wanted, order=1) for k in (kx, ky, kz)]
    )


def _splat(position: Floats, values: Floats, block: int) -> Floats:
    """Spread values over the eight grid nodes around each position, shape (block,) * 3."""
    base = np.floor(position).astype(np.int64)
    share = position - base
    total = np.zeros(block**3)
    for corner in np.ndindex(2, 2, 2):
        offset = np.array(corner)
        weight = np.where(offset, share, 1.0 - share).prod(axis=1)
        total += np.bincount(_flat(base + offset, block), weight * values, minlength=block**3)
    return total.reshape((block,) * 3)


def _flat(node: Ints, block: int) -> Ints:
    return np.asarray((node[:, 0] * block + node[:, 1]) * block + node[:, 2])
