"""Shortest routes in a graph whose nodes are places."""

import numpy as np

from solvers.arrays import Floats, Ints


def shortest_route(places: Floats, edges: Ints, start: int, goal: int) -> list[int]:
    """Nodes of the shortest route, or none if the two are not connected.

    Parameters
    ----------
    places
        Shape (n, d); the length of an edge is the distance of its places.
    edges
        Pairs of nodes, shape (m, 2), each given once or in both directions.
    start, goal
        First and last node.

    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import dijkstra

    ends = np.unique(np.concatenate([edges, edges[:, ::-1]]), axis=0)
    # A zero would be no edge; so places that coincide are joined by next to nothing.
    lengths = np.linalg.norm(places[ends[:, 0]] - places[ends[:, 1]], axis=1) + 1e-300
    shape = (len(places), len(places))
    graph = csr_array((lengths, (ends[:, 0], ends[:, 1])), shape=shape)
    reach, before = dijkstra(graph, indices=[start], return_predecessors=True)
    if not np.isfinite(reach[0, goal]):
        return []
    route = [goal]
    while route[-1] != start:
        route.append(int(before[0, route[-1]]))
    return route[::-1]
