"""Surface samples, and the same with their quality."""

from dataclasses import dataclass

import numpy as np

from planner.geometry.arrays import Floats, Ints, read_only
from planner.scene.cloud import Mesh, PointCloud

THINNING = 0.25  # share of R between the points that the surface is made from


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceSamples:
    """Directed samples of the surface, no two closer than ``radius``.

    Parameters
    ----------
    xyz
        Positions, shape (S, 3), metres, local frame.
    normals
        Unit outward normals, shape (S, 3).
    cluster
        Cluster of each sample, shape (S,), 0-based.
    radius
        Poisson-disk radius R, metres.

    """

    xyz: Floats
    normals: Floats
    cluster: Ints
    radius: float

    def __post_init__(self) -> None:
        count = len(self.xyz)
        set_ = object.__setattr__
        set_(self, "xyz", read_only(self.xyz, (None, 3), name="xyz"))
        set_(self, "normals", read_only(self.normals, (count, 3), name="normals"))
        cluster = read_only(self.cluster, (count,), name="cluster", dtype=np.int64)
        set_(self, "cluster", cluster)

    def __len__(self) -> int:
        return len(self.xyz)

    def places(self, rows: Ints) -> "SurfaceSamples":
        """Some of the samples, without scores."""
        return SurfaceSamples(self.xyz[rows], self.normals[rows], self.cluster[rows], self.radius)


@dataclass(frozen=True, slots=True, eq=False)
class ScoredSamples(SurfaceSamples):
    """Surface samples with the quality of the prior around each.

    Parameters
    ----------
    completeness
        Eq. 1, shape (S,), as computed (not normalised).
    smoothness
        Eq. 2, shape (S,), as computed.
    quality
        Eqs. 4 and 5, shape (S,), in [0, 1]; 0 is worst.

    """

    completeness: Floats
    smoothness: Floats
    quality: Floats

    def __post_init__(self) -> None:
        SurfaceSamples.__post_init__(self)
        for name in ("completeness", "smoothness", "quality"):
            values = read_only(getattr(self, name), (len(self.xyz),), name=name)
            object.__setattr__(self, name, values)


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """The watertight-ish surface that samples lie on and that rays are cast against.

    Parameters
    ----------
    mesh
        Triangles, oriented outward where that is known, local frame.
    samples
        Poisson-disk samples of that mesh, snapped to the prior where it is near.
    thinned
        The thinned cloud with normals that the surface was made from.

    """

    mesh: Mesh
    samples: SurfaceSamples
    thinned: PointCloud
