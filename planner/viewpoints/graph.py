"""Which photos can be matched with which: the view graph."""

from dataclasses import dataclass, field

import numpy as np

from planner.geometry.arrays import Bools, Floats, Ints
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.anchors import Anchors
from planner.viewpoints.camera import Camera
from planner.viewpoints.likeness import Likeness, LinkRule, Shown
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.reconstructability import GRAZING
from planner.viewpoints.sight import SightRule
from planner.viewpoints.viewpoints import Viewpoints
from planner.viewpoints.visibility import Coverage, count_views

__all__ = ["LinkRule", "ViewGraph", "link", "view_graph"]


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
        Matchable photos of each viewpoint, those of the first flight included, shape (V,).
    ties
        Pairs of a viewpoint and a photo of the first flight that match, shape (T, 2).

    """

    edges: Ints
    component: Ints
    degree: Ints
    ties: Ints = field(default_factory=lambda: np.empty((0, 2), dtype=np.int64))

    @property
    def tied(self) -> int:
        """Number of photos of the first flight that are matched."""
        return len(np.unique(self.ties[:, 1]))

    @property
    def linked(self) -> Bools:
        """Which viewpoints match with which, shape (V, V), symmetric; none does with itself."""
        linked = np.zeros((len(self.component),) * 2, dtype=np.bool_)
        linked[self.edges[:, 0], self.edges[:, 1]] = True
        return linked | linked.T

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
    links: LinkRule = LinkRule(),  # noqa: B008 - an immutable value
    anchors: Anchors | None = None,
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
    anchors
        Photos of the first flight to match with.

    """
    rule = SightRule(d_min=0.0, d_max=reference, max_incidence=GRAZING)
    seen = count_views(viewpoints, samples, caster, camera, rule)
    graph = view_graph(viewpoints, seen, samples, links)
    if anchors is None:
        return graph
    mine = Shown.of(viewpoints, seen, samples, focal_px=camera.focal_px)
    ties = np.argwhere(Likeness.between(mine, anchors.shown).matching(links)).astype(np.int64)
    degree = graph.degree + np.bincount(ties[:, 0], minlength=len(viewpoints))
    return ViewGraph(graph.edges, graph.component, degree, ties)


def view_graph(
    viewpoints: Viewpoints,
    seen: Coverage,
    samples: SurfaceSamples,
    links: LinkRule = LinkRule(),  # noqa: B008 - an immutable value
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
    from scipy.sparse.csgraph import connected_components

    shown = Shown.of(viewpoints, seen, samples)
    linked = np.triu(Likeness.between(shown, shown).matching(links), k=1)
    edges = np.argwhere(linked)
    component = connected_components(linked, directed=False)[1]
    degree = np.bincount(edges.ravel(), minlength=len(viewpoints))
    return ViewGraph(edges, component.astype(np.int64), degree)


def fewest_links(linked: Bools, starts: Bools) -> tuple[Floats, Ints]:
    """Fewest links from any start to each photo, and the photo before it on the way.

    Parameters
    ----------
    linked
        Which photos match, shape (n, n).
    starts
        Where ways begin, shape (n,).

    Returns
    -------
    far, before
        Number of links, infinite where no way leads; and photo, negative where there is none; (n,).

    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import dijkstra

    far, before, _ = dijkstra(
        csr_array(linked.astype(np.float64)),
        indices=np.flatnonzero(starts),
        return_predecessors=True,
        unweighted=True,
        min_only=True,
    )
    return far, before.astype(np.int64)


def way_back(before: Ints, at: int, there: Bools) -> list[int]:
    """Photos from ``at`` on back to, but without, the first one that is ``there`` already."""
    way: list[int] = []
    while at >= 0 and not there[at]:
        way.append(at)
        at = int(before[at])
    return way
