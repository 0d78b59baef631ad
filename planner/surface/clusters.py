"""Clusters of the surface by position and normal (paper 3.2.2), equal in size."""

import numpy as np

from planner.geometry.arrays import Floats, Ints


def cluster_samples(
    xyz: Floats, normals: Floats, count: int, *, normal_weight: float = 0.5
) -> Ints:
    """Divide samples into clusters of equal size, compact in position and in normal.

    The samples are halved again and again along the principal axis of position and normal taken
    together. Unlike k-means this needs no chance, leaves no cluster empty, and gives each worker of
    a later stage the same load.

    Parameters
    ----------
    xyz
        Positions, shape (S, 3), metres.
    normals
        Unit normals, shape (S, 3).
    count
        Wanted number of clusters, at least 1; no more than S are made.
    normal_weight
        How far apart opposite walls are, as a share of the extent of the samples being divided.

    Returns
    -------
    cluster
        Cluster of each sample, shape (S,), 0-based; sizes differ by at most one for a ``count``
        that is a power of two, by a few otherwise.

    Raises
    ------
    ValueError
        If ``count`` is less than 1.

    """
    if count < 1:
        raise ValueError(f"count must be at least 1, got {count}.")
    cluster = np.zeros(len(xyz), np.int64)
    pending = [(np.arange(len(xyz)), 0, min(count, max(1, len(xyz))))]
    while pending:  # one turn a cluster
        rows, first, parts = pending.pop()
        if parts == 1:
            cluster[rows] = first
            continue
        half = parts // 2
        order = rows[np.argsort(_along(xyz[rows], normals[rows], normal_weight), kind="stable")]
        cut = round(len(rows) * half / parts)
        pending += [(order[:cut], first, half), (order[cut:], first + half, parts - half)]
    return cluster


def _along(xyz: Floats, normals: Floats, normal_weight: float) -> Floats:
    """Coordinate of each sample along the principal axis of position and normal, shape (n,)."""
    centred = xyz - xyz.mean(axis=0)
    extent = max(float(np.sqrt((centred**2).sum(axis=1).mean())), 1e-12)
    features = np.column_stack([centred / extent, normal_weight * (normals - normals.mean(axis=0))])
    _, axes = np.linalg.eigh(features.T @ features)
    axis = axes[:, -1]
    axis = axis * np.sign(axis[np.argmax(np.abs(axis))])  # eigenvectors come with either sign
    return np.asarray(features @ axis)
