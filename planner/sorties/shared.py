"""Photos that a sortie takes as well, so that its own hang together."""

from typing import TYPE_CHECKING

import numpy as np

from planner.geometry.arrays import Floats, Ints

if TYPE_CHECKING:
    import networkx as nx

DETOUR = 1e-3
"""Weight of a second of detour, against one more photo."""


def linked(photos: Ints, edges: Ints, seconds: Floats) -> Ints:
    """Photos of a sortie with as few more as link them, in flying order.

    Photos are matched along the edges of the view graph. Where those of a sortie fall into
    parts that photos of other sorties link, the shortest chain of these between two parts is
    added, each at the place where it costs the least detour, until no chain is left.

    Parameters
    ----------
    photos
        In flying order, shape (n,).
    edges
        Pairs of photos that match, shape (E, 2).
    seconds
        From photo to photo, shape (V, V).

    Returns
    -------
    photos
        With those that were added, shape (n + m,); the others keep their order.

    """
    import networkx as nx

    graph = nx.Graph()
    graph.add_nodes_from(range(len(seconds)))
    graph.add_edges_from(edges.tolist())
    order = photos.tolist()
    while True:
        parts = sorted(nx.connected_components(graph.subgraph(order)), key=min)
        chain = _shortest_chain(graph, parts, order, seconds)
        if chain is None:
            return np.array(order, dtype=np.int64)
        for photo in chain:
            order.insert(_cheapest_place(photo, order, seconds)[0], photo)


def _shortest_chain(
    graph: "nx.Graph[int]", parts: list[set[int]], order: list[int], seconds: Floats
) -> list[int] | None:
    """Photos between the first part that can be linked and its nearest other part."""
    from networkx import multi_source_dijkstra

    inside = set(order)
    prices = 1.0 + DETOUR * _least_detours(order, seconds)
    prices[order] = 0.0

    def price(_: int, photo: int, __: object) -> float:
        return float(prices[photo])

    for part in parts[:-1]:
        far, ways = multi_source_dijkstra(graph, sorted(part), weight=price)
        others = sorted(photo for photo in inside - part if photo in far)
        if others:
            goal = min(others, key=lambda photo: (far[photo], photo))
            return [photo for photo in ways[goal] if photo not in inside]
    return None


def _least_detours(order: list[int], seconds: Floats) -> Floats:
    """Seconds that it costs at least to insert each photo, shape (V,)."""
    rows = np.array(order)
    into, out = seconds[rows], seconds[:, rows].T
    between = into[:-1] + out[1:] - seconds[rows[:-1], rows[1:]][:, None]
    return np.asarray(np.min(np.concatenate([out[:1], between, into[-1:]]), axis=0))


def _cheapest_place(photo: int, order: list[int], seconds: Floats) -> tuple[int, float]:
    """Where to insert a photo, and the seconds that it costs."""
    rows = np.array(order)
    into, out = seconds[rows, photo], seconds[photo, rows]
    added = np.r_[out[0], into[:-1] + out[1:] - seconds[rows[:-1], rows[1:]], into[-1]]
    place = int(np.argmin(added))
    return place, float(added[place])
