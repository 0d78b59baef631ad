"""Which photos can be matched with which: the view graph."""

import math
from dataclasses import dataclass

import numpy as np

from planner.config import ViewpointSettings
from planner.geometry.arrays import Floats, Ints
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.camera import Camera
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.reconstructability import GRAZING
from planner.viewpoints.sight import SightRule
from planner.viewpoints.viewpoints import Viewpoints
from planner.viewpoints.visibility import Coverage, count_views


@dataclass(frozen=True, slots=True)
class LinkRule:
    """What two photos must have in common to be matched.

    Parameters
    ----------
    shared_share
        Least share of the smaller view's samples that both see. On small plans, half of
        the smaller view stands in for ``shared_least`` where that is less.
    shared_least
        Least number of samples that both see.
    max_turn_deg
        Largest angle between the two view directions, degrees.
    max_scale
        Largest ratio between the median distances to what each sees.

    """

    shared_share: float = 0.3
    shared_least: int = 15
    max_turn_deg: float = 40.0
    max_scale: float = 2.0

    @classmethod
    def of(cls, settings: ViewpointSettings) -> "LinkRule":
        """Rule of the settings."""
        return cls(
            settings.link_share, settings.link_least, settings.link_turn_deg, settings.link_scale
        )


@dataclass(frozen=True, slots=True, eq=False)
class ViewGraph:
    """Photos that share enough to be matched.

    Parameters
    ----------
    edges
        Pairs of viewpoints, the lower row first, shape (E, 2).
    component
        Connected component of each viewpoint, shape (V,), 0-based.
    degree
        Matchable photos of each viewpoint, shape (V,).

    """

    edges: Ints
    component: Ints
    degree: Ints

    @property
    def components(self) -> int:
        """Number of connected components; a reconstruction falls into as many pieces."""
        return int(self.component.max(initial=-1)) + 1

    @property
    def wanted_degree(self) -> int:
        """Matchable photos that each should have: 3, or all the others if they are fewer."""
        return min(3, max(0, len(self.component) - 1))

    @property
    def firm(self) -> bool:
        """Whether it is in one piece and each photo has as many links as it should."""
        return self.components <= 1 and int(self.degree.min(initial=3)) >= self.wanted_degree


def link(
    viewpoints: Viewpoints,
    samples: SurfaceSamples,
    caster: RayCaster,
    camera: Camera,
    *,
    reference: float,
    links: LinkRule = LinkRule(),
) -> ViewGraph:
    """View graph by fresh rays: what photos show counts, whether or not it is sharp.

    Parameters
    ----------
    viewpoints, samples, caster, camera
        The photos, what they should show, what may be in the way, and the field of view.
    reference
        Distance beyond which a photo is worth nothing, metres.
    links
        What two photos must have in common.

    """
    rule = SightRule(d_min=0.0, d_max=reference, max_incidence=GRAZING)
    seen = count_views(viewpoints, samples, caster, camera, rule)
    return view_graph(viewpoints, seen, samples, links)


def view_graph(
    viewpoints: Viewpoints,
    seen: Coverage,
    samples: SurfaceSamples,
    links: LinkRule = LinkRule(),
) -> ViewGraph:
    """Link the photos that feature matching can link.

    Parameters
    ----------
    viewpoints, seen, samples
        The photos, and which samples each sees.
    links
        What two photos must have in common.

    Returns
    -------
    graph
        Edges, components and degrees.

    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    count = len(viewpoints)
    ones = np.ones(len(seen.sample), dtype=np.int64)  # bool @ bool would stay bool
    matrix = csr_array((ones, seen.sample, seen.indptr), shape=(count, len(samples)))
    shared = (matrix @ matrix.T).toarray()
    sizes = np.diff(seen.indptr)
    smaller = np.minimum(sizes[:, None], sizes[None, :])
    least = np.maximum(links.shared_share * smaller, np.minimum(links.shared_least, 0.5 * smaller))
    axes = viewpoints.directions
    alike = axes @ axes.T >= math.cos(math.radians(links.max_turn_deg))
    scale = _median_distances(viewpoints, seen, samples)
    near = np.maximum(scale[:, None], scale[None, :]) <= links.max_scale * np.minimum(
        scale[:, None], scale[None, :]
    )
    linked = np.triu((shared >= least) & (shared > 0) & alike & near, k=1)
    edges = np.argwhere(linked)
    component = connected_components(linked, directed=False)[1]
    return ViewGraph(edges, component.astype(np.int64), np.bincount(edges.ravel(), minlength=count))


def _median_distances(viewpoints: Viewpoints, seen: Coverage, samples: SurfaceSamples) -> Floats:
    """Median distance from each viewpoint to what it sees, metres; infinite if nothing."""
    medians = np.full(len(viewpoints), np.inf)
    for row, position in enumerate(viewpoints.positions):  # few: the photos of a plan
        rows = seen.sample[seen.indptr[row] : seen.indptr[row + 1]]
        if len(rows):
            medians[row] = np.median(np.linalg.norm(samples.xyz[rows] - position, axis=1))
    return medians
