"""Photos that match with those of the first flight, so that both make one model."""

from dataclasses import dataclass

import numpy as np

from planner.airspace.airspace import Airspace
from planner.config import FLIGHT_MARGIN
from planner.findings import Finding
from planner.geometry.angles import yaw_pitch
from planner.geometry.arrays import Bools, Floats, Ints
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.anchors import Anchors
from planner.viewpoints.camera import Camera
from planner.viewpoints.free_balls import free_balls
from planner.viewpoints.graph import LinkRule, ViewGraph, fewest_links, link, way_back
from planner.viewpoints.likeness import Likeness, Shown
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.reconstructability import GRAZING
from planner.viewpoints.sight import SightRule
from planner.viewpoints.viewpoints import Viewpoints
from planner.viewpoints.visibility import count_views

_ROUNDS = 8  # each adds the photos of one way to the first flight, or some that match it
_PAIRS = 12  # of a new photo and an image that are nearly alike, to lead one to the other
_STEPS = (0.0, 0.2, 0.4, 0.6, 0.8)  # on the way from the new photo
_NEAR = 2  # free positions looked at around each place on the way


@dataclass(frozen=True, slots=True, eq=False)
class Matching:
    """What decides which photos match.

    Parameters
    ----------
    samples, caster, camera
        What photos show, what may be in the way, and the field of view.
    anchors
        Photos of the first flight.
    reference
        Distance beyond which a new photo is worth nothing, metres.
    links
        What two photos must have in common.

    """

    samples: SurfaceSamples
    caster: RayCaster
    camera: Camera
    anchors: Anchors
    reference: float
    links: LinkRule

    def graph(self, viewpoints: Viewpoints) -> ViewGraph:
        """View graph of new photos, with their ties."""
        return link(
            *(viewpoints, self.samples, self.caster, self.camera),
            reference=self.reference,
            links=self.links,
            anchors=self.anchors,
        )

    def likeness(self, viewpoints: Viewpoints) -> Likeness:
        """What new photos have in common with those of the first flight."""
        rule = SightRule(d_min=0.0, d_max=self.reference, max_incidence=GRAZING)
        seen = count_views(viewpoints, self.samples, self.caster, self.camera, rule)
        mine = Shown.of(viewpoints, seen, self.samples, focal_px=self.camera.focal_px)
        return Likeness.between(mine, self.anchors.shown)


def tie(
    viewpoints: Viewpoints,
    positions: Floats,
    matching: Matching,
    *,
    airspace: Airspace | None,
    margin: float = FLIGHT_MARGIN,
) -> Viewpoints:
    """Add photos until enough photos of the first flight are matched by the rule of all links.

    Tried are poses between new photos and images that are nearly alike, and poses on the axes of
    these images, at free places on the way or beside it. First those are added that match
    most further images; where none matches both sides, the shortest chain from the new photos to
    an image is.

    Parameters
    ----------
    viewpoints
        The photos so far.
    positions
        Free positions, shape (V, 3), metres.
    matching
        Photos of the first flight, and what it takes to match them.
    airspace
        Where flight is safe, also farther away than photos are taken from; without it only
        the positions are known to be free.
    margin
        What the flight keeps beyond ``d_min``, and from zones, metres.

    Returns
    -------
    viewpoints
        The same with added ones of kind ``tie`` at the end; as good as it gets where the free
        space does not allow more.

    """
    anchors = matching.anchors
    for _ in range(_ROUNDS if len(viewpoints) else 0):
        graph = matching.graph(viewpoints)
        if graph.tied >= anchors.wanted:
            break
        pool = _pool(viewpoints, positions, matching, airspace, margin)
        if not len(pool):
            break
        chosen = _helpful(matching.graph(viewpoints.joined(pool)), viewpoints, pool, anchors)
        if not len(chosen):
            break
        viewpoints = viewpoints.joined(pool.take(chosen))
    return viewpoints


def untied(viewpoints: Viewpoints, graph: ViewGraph, matching: Matching) -> tuple[Finding, ...]:
    """Finding if too few photos of the first flight are matched, with what the next one lacks."""
    anchors, links, tied = matching.anchors, matching.links, graph.tied
    if tied >= anchors.wanted and anchors.wanted:
        return ()
    message = f"{tied} of {anchors.most} wanted photos of the first flight match with new ones"
    near = matching.likeness(viewpoints)
    cost = near.lack(links)
    cost[:, np.unique(graph.ties[:, 1])] = np.inf
    if np.isfinite(cost).any():
        view, image = (int(row) for row in np.unravel_index(np.argmin(cost), cost.shape))
        faults = ", ".join(near.faults(view, image, links))
        message += f"; the next would be {anchors.images.names[image]}: {faults}"
        if near.ratio[view, image] > links.max_scale:
            message += " (airspace.beyond makes room for photos in between)"
    else:
        message += "; the others show nothing that new ones show"
    return (Finding("viewpoints", "first-flight-untied", message, float(tied), partial=False),)


def _pool(
    viewpoints: Viewpoints,
    positions: Floats,
    matching: Matching,
    airspace: Airspace | None,
    margin: float,
) -> Viewpoints:
    """Poses on the way from new photos to images, at places that are free."""
    images, axes, looks = (
        matching.anchors.images,
        matching.anchors.shown.axes,
        viewpoints.directions,
    )
    near = matching.likeness(viewpoints)
    cost = np.where(near.matching(matching.links), np.inf, near.lack(matching.links))
    pairs = np.argsort(cost, axis=None, kind="stable")[:_PAIRS]
    pairs = pairs[np.isfinite(cost.ravel()[pairs])]
    view, image = np.unravel_index(pairs, cost.shape)
    wished, aims = [np.empty((0, 3))], [np.empty((0, 3))]
    for share in _STEPS:
        between = (1 - share) * viewpoints.positions[view] + share * images.positions[image]
        wished += [between, between]
        aims += [(1 - share) * looks[view] + share * axes[image], axes[image]]
    ahead = np.linalg.norm(viewpoints.positions[view] - images.positions[image], axis=1)
    for share in _STEPS[1:]:  # down the axis of the image
        wished.append(images.positions[image] + (share * ahead)[:, None] * axes[image])
        aims.append(axes[image])
    wish = np.concatenate(wished), np.concatenate(aims)
    places, look = _free(*wish, positions, airspace, margin)
    yaw, pitch = yaw_pitch(look)
    poses = np.unique(np.column_stack([places, yaw, pitch]), axis=0)
    count = len(poses)
    kind = ("tie",) * count
    return Viewpoints(poses[:, :3], poses[:, 3], poses[:, 4], kind, np.full(count, -1))


def _free(
    wished: Floats, aims: Floats, positions: Floats, airspace: Airspace | None, margin: float
) -> tuple[Floats, Floats]:
    """Places that are free themselves, and the free positions nearest to each, with their aims."""
    from scipy.spatial import cKDTree

    places, looks = [], []
    if airspace is not None and len(wished):
        free = free_balls(wished, airspace, margin=margin).radii > 0.0
        places.append(wished[free])
        looks.append(aims[free])
    near = min(_NEAR, len(positions))
    if near and len(wished):
        rows = np.asarray(cKDTree(positions).query(wished, k=near)[1]).reshape(-1, near)
        places.append(positions[rows.ravel()])
        looks.append(np.repeat(aims, near, axis=0))
    none = np.empty((0, 3))
    return np.concatenate([none, *places]), np.concatenate([none, *looks])


def _helpful(both: ViewGraph, viewpoints: Viewpoints, pool: Viewpoints, anchors: Anchors) -> Ints:
    """Rows of the pool to add: those that match most further images, else the shortest chain."""
    from scipy.spatial import cKDTree

    count, size = len(viewpoints), len(both.component)
    away = np.zeros(size)  # from the nearest photo there: of equals, the least flight
    away[count:] = cKDTree(viewpoints.positions).query(pool.positions)[0]
    linked = np.zeros((size, size), dtype=np.bool_)
    linked[both.edges[:, 0], both.edges[:, 1]] = True
    linked |= linked.T
    ties = np.zeros((size, len(anchors.images)), dtype=np.bool_)
    ties[both.ties[:, 0], both.ties[:, 1]] = True
    there = np.arange(size) < count
    chosen: list[int] = []
    while True:
        done = ties[there].any(axis=0)
        missing = anchors.wanted - int(done.sum())
        gain = np.minimum((ties & ~done).sum(axis=1), missing)
        gain[there | ~(linked & there).any(axis=1)] = 0
        if missing <= 0 or not gain.max():
            break
        best = int(np.lexsort((away, -gain))[0])
        there[best] = True
        chosen.append(best)
    if not chosen:
        chosen = _chain(linked, ties, there, away)
    return np.array(chosen, dtype=np.int64) - count


def _chain(linked: Bools, ties: Bools, there: Bools, away: Floats) -> list[int]:
    """Rows of the pool on the shortest way from the new photos to an image without a match."""
    far, before = fewest_links(linked, there)
    further = (ties & ~ties[there].any(axis=0)).sum(axis=1)
    ends = np.flatnonzero((further > 0) & ~there & np.isfinite(far))
    if not len(ends):
        return []
    at = int(ends[np.lexsort((away[ends], -further[ends], far[ends]))[0]])
    return way_back(before, at, there)
