"""What the photos of the first flight show, to match new photos with them."""

from dataclasses import dataclass, replace

import numpy as np

from planner.geometry.angles import direction
from planner.geometry.arrays import Ints
from planner.scene.images import Images
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.camera import Camera
from planner.viewpoints.likeness import Shown
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.reconstructability import GRAZING
from planner.viewpoints.sight import SightRule
from planner.viewpoints.viewpoints import Viewpoints
from planner.viewpoints.visibility import count_views

_EVERYTHING = SightRule(d_min=0.0, d_max=np.inf, max_incidence=GRAZING)


@dataclass(frozen=True, slots=True, eq=False)
class Anchors:
    """Photos that exist already, as nodes of the view graph that cost nothing.

    Parameters
    ----------
    images
        The photos, M of them.
    shown
        What each shows, by rays, at the scale of its pixels.
    most
        How many of them new photos should match with.

    """

    images: Images
    shown: Shown
    most: int

    @property
    def wanted(self) -> int:
        """How many of them should be matched: not more than there are that show anything."""
        return min(self.most, int(np.count_nonzero(self.shown.sizes)))

    @classmethod
    def of(
        cls,
        images: Images | None,
        samples: SurfaceSamples,
        caster: RayCaster,
        camera: Camera,
        *,
        ties: int,
    ) -> "Anchors | None":
        """Cast rays from all photos, each with its own optics where these are known.

        Parameters
        ----------
        images
            Photos that exist already, or ``None``.
        samples, caster
            What they may show, and what may be in the way.
        camera
            Optics of photos that say nothing of theirs.
        ties
            How many of them new photos should match with; without any there are no anchors.

        """
        if images is None or ties == 0:
            return None
        from scipy.sparse import csr_array

        own = (float(camera.width_px), float(camera.height_px), camera.focal_px)
        optics = np.where(np.isfinite(images.optics), images.optics, own)
        kinds, kind = np.unique(optics, axis=0, return_inverse=True)
        photo, seen = [np.empty(0, dtype=np.int64)], [np.empty(0, dtype=np.int64)]
        for number, (width, height, focal) in enumerate(kinds):  # few: cameras
            rows = np.flatnonzero(kind.reshape(-1) == number)
            lens = replace(
                camera,
                width_px=round(width),
                height_px=round(height),
                focal_px=float(focal),
                principal_px=camera.principal_px if (width, height, focal) == own else None,
            )
            shown = count_views(_views(images, rows), samples, caster, lens, _EVERYTHING)
            photo.append(np.repeat(rows, np.diff(shown.indptr)))
            seen.append(shown.sample.astype(np.int64))
        rows, columns = np.concatenate(photo), np.concatenate(seen)
        ones = np.ones(len(rows), dtype=np.int64)
        shows = csr_array((ones, (rows, columns)), shape=(len(images), len(samples)))
        gsd = np.full(len(images), np.inf)
        for row in range(len(images)):
            xyz = samples.xyz[shows.indices[shows.indptr[row] : shows.indptr[row + 1]]]
            if len(xyz):
                away = np.linalg.norm(xyz - images.positions[row], axis=1)
                gsd[row] = np.median(away) / optics[row, 2]
        axes = direction(images.yaw_deg, images.pitch_deg)
        return cls(images, Shown(shows, axes, gsd), ties)


def _views(images: Images, rows: Ints) -> Viewpoints:
    """Some of the photos as viewpoints."""
    count = len(rows)
    poses = images.positions[rows], images.yaw_deg[rows], images.pitch_deg[rows]
    return Viewpoints(*poses, ("first",) * count, np.full(count, -1))
