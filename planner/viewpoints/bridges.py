"""Photos in between, so that all of them can be matched into one model."""

import numpy as np

from planner.geometry.angles import yaw_pitch
from planner.geometry.arrays import Bools, Floats, Ints
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.anchors import Anchors
from planner.viewpoints.camera import Camera
from planner.viewpoints.graph import LinkRule, ViewGraph, fewest_links, link, way_back
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.viewpoints import Viewpoints

_ROUNDS = 12  # each adds as many photos as help
_NEAR = 6  # free positions looked at around each photo that lacks links
_RIVALS = 4  # nearest photos of other components that a component is led to
_STEPS = (0.2, 0.4, 0.6, 0.8)  # on the way to them
_SAME_PLACE = 1e-3  # metres


def connect(
    viewpoints: Viewpoints,
    positions: Floats,
    samples: SurfaceSamples,
    caster: RayCaster,
    camera: Camera,
    *,
    reference: float,
    links: LinkRule = LinkRule(),  # noqa: B008 - an immutable value
    anchors: Anchors | None = None,
) -> Viewpoints:
    """Add photos until the view graph is one component with three links a photo.

    Poses beside photos that lack links, and poses on the way between the components, are tried
    with fresh rays; first those are added that join most components, then those that help
    most photos. Where no single one joins two components, the shortest chain does.

    Parameters
    ----------
    viewpoints
        The photos so far.
    positions
        Free positions, shape (V, 3), metres.
    samples, caster, camera
        What photos show, what may be in the way, and the field of view.
    reference
        Distance beyond which a photo is worth nothing, metres.
    links
        What two photos must have in common.
    anchors
        Photos of the first flight, whose links count too.

    Returns
    -------
    viewpoints
        The same with added ones of kind ``bridge`` at the end; as good as it gets where the
        positions do not allow more.

    """
    seen_by = samples, caster, camera
    for _ in range(_ROUNDS if len(viewpoints) > 1 else 0):
        graph = link(viewpoints, *seen_by, reference=reference, links=links, anchors=anchors)
        if graph.firm:
            break
        pool = _pool(viewpoints, graph, positions)
        if not len(pool):
            break
        tried = viewpoints.joined(pool)
        both = link(tried, *seen_by, reference=reference, links=links, anchors=anchors)
        chosen = _helpful(both, graph)
        if not len(chosen):
            break
        viewpoints = viewpoints.joined(pool.take(chosen))
    return viewpoints


def _pool(viewpoints: Viewpoints, graph: ViewGraph, positions: Floats) -> Viewpoints:
    """Poses that may help, at free positions without a photo."""
    from scipy.spatial import cKDTree

    away = np.asarray(cKDTree(viewpoints.positions).query(positions)[0])
    free = positions[away > _SAME_PLACE]
    looks = viewpoints.directions
    loose = np.flatnonzero(graph.degree < graph.wanted_degree)
    wished = [viewpoints.positions[loose]]
    aims = [looks[loose]]
    for first, second in _gaps(viewpoints, graph):
        for share in _STEPS:
            wished.append(
                (1 - share) * viewpoints.positions[first] + share * viewpoints.positions[second]
            )
            aims.append((1 - share) * looks[first] + share * looks[second])
    near = min(_NEAR, len(free))
    if near == 0 or not sum(map(len, wished)):
        return viewpoints.take(np.empty(0, dtype=np.int64))
    rows = np.asarray(cKDTree(free).query(np.concatenate(wished), k=near)[1]).reshape(-1, near)
    yaw, pitch = yaw_pitch(np.concatenate(aims))
    count = len(rows) * near
    poses = np.column_stack([free[rows.ravel()], np.repeat(yaw, near), np.repeat(pitch, near)])
    poses = np.unique(poses, axis=0) if count else poses
    return Viewpoints(
        poses[:, :3],
        poses[:, 3],
        poses[:, 4],
        ("bridge",) * len(poses),
        np.full(len(poses), -1),
    )


def _gaps(viewpoints: Viewpoints, graph: ViewGraph) -> list[tuple[Ints, Ints]]:
    """Photos of each smaller component, and the nearest and most alike ones outside of it."""
    sizes = np.bincount(graph.component)
    gaps = []
    for component in np.flatnonzero(np.arange(len(sizes)) != np.argmax(sizes)):  # few
        inside = np.flatnonzero(graph.component == component)
        outside = np.flatnonzero(graph.component != component)
        apart = viewpoints.positions[inside][:, None] - viewpoints.positions[outside][None]
        turned = viewpoints.directions[inside] @ viewpoints.directions[outside].T
        cost = np.linalg.norm(apart, axis=2) * (2.0 - turned)
        order = np.argsort(cost, axis=None, kind="stable")[:_RIVALS]
        first, second = np.unravel_index(order, cost.shape)
        gaps.append((inside[first], outside[second]))
    return gaps


def _helpful(both: ViewGraph, graph: ViewGraph) -> Ints:
    """Rows of the pool to add: joiners first, then what helps most, then a chain if needed."""
    count, size = len(graph.component), len(both.component)
    linked = both.linked
    part = np.concatenate([graph.component, np.full(size - count, -1)])
    degree = np.bincount(both.ties[:, 0], minlength=size)
    degree[:count] = graph.degree
    there = np.arange(size) < count
    chosen: list[int] = []
    while True:
        row = _best(linked, there, part, there & (degree < graph.wanted_degree))
        if row < 0:
            break
        _add(row, linked, there, part, degree)
        chosen.append(row)
    if len(np.unique(part[there])) > 1:
        chosen.extend(_chain(linked, there, part))
    return np.array(chosen, dtype=np.int64) - count


def _best(linked: Bools, there: Bools, part: Ints, lacking: Bools) -> int:
    """Row of the pool that joins most components, then helps most that lack links, or -1."""
    rows = np.flatnonzero(~there)
    friends = linked[np.ix_(rows, there)]
    names, group = np.unique(part[there], return_inverse=True)
    member = (group.reshape(-1, 1) == np.arange(len(names))).astype(np.float32)
    joins = np.count_nonzero(friends.astype(np.float32) @ member, axis=1).clip(1) - 1
    helped = np.count_nonzero(friends[:, lacking[there]], axis=1)
    first = np.lexsort((rows, -np.count_nonzero(friends, axis=1), -helped, -joins))[:1]
    useful = first[joins[first] + helped[first] > 0]
    return int(rows[useful[0]]) if len(useful) else -1


def _add(row: int, linked: Bools, there: Bools, part: Ints, degree: Ints) -> None:
    """Count a row of the pool as added."""
    friends = np.flatnonzero(linked[row] & there)
    groups = np.unique(part[friends])
    part[np.isin(part, groups) & there] = groups[0]
    part[row] = groups[0]
    degree[friends] += 1
    degree[row] += len(friends)
    there[row] = True


def _chain(linked: Bools, there: Bools, part: Ints) -> list[int]:
    """Rows of the pool on the shortest way from the smallest component to any other."""
    names, sizes = np.unique(part[there], return_counts=True)
    inside = there & (part == names[np.argmin(sizes)])
    outside = there & ~inside
    far, before = fewest_links(linked, inside)
    goal = np.flatnonzero(outside)[np.argmin(far[outside])]
    return way_back(before, int(before[goal]), there)
