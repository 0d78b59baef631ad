"""The layouts of the paper's Tables 2 and 3 and its Fig. 9, with our solvers beside its figures.

python docs/comparisons/tours.py [SECONDS [LARGEST [PICTURE]]]

The paper's viewpoints are not published: ours are seeded places in a square. So compare times,
and the methods with each other, but not our lengths with the paper's.
"""

import sys

from solvers import Stop
from solvers.compare import compare
from solvers.tour.instances import random_instance

# places -> (seconds, length in metres) of each method in the paper
TABLE_2 = {
    7: {"branch-and-bound": (0.316, 43.286), "ant-colony": (0.724, 43.286)},
    8: {"branch-and-bound": (1.362, 52.334), "ant-colony": (0.827, 52.334)},
    9: {"branch-and-bound": (4.647, 54.588), "ant-colony": (0.999, 54.588)},
    10: {"branch-and-bound": (18.75, 57.7), "ant-colony": (1.206, 57.7)},
    11: {"branch-and-bound": (59.213, 57.948), "ant-colony": (1.402, 57.948)},
    12: {"branch-and-bound": (463.364, 60.366), "ant-colony": (1.551, 60.366)},
}
TABLE_3 = {
    50: {"particle-swarm": (15.031, 230.999), "ant-colony": (36.337, 227.461)},
    100: {"particle-swarm": (25.52, 566.299), "ant-colony": (129.613, 566.912)},
    150: {"particle-swarm": (42.488, 979.863), "ant-colony": (310.765, 925.306)},
    200: {"particle-swarm": (54.199, 1329.885), "ant-colony": (519.66, 1280.699)},
    300: {"particle-swarm": (94.681, 2127.964), "ant-colony": (1208.345, 1966.103)},
    433: {"particle-swarm": (148.526, 3012.832), "ant-colony": (2396.544, 2812.758)},
}


def table(paper, largest, stop, extra=()):
    """Print one table; ``extra`` solvers have no figures in the paper."""
    print("| places | method | paper s | paper m | s | length | above bound % | status |")
    print("| ---: | --- | ---: | ---: | ---: | ---: | ---: | --- |")
    for size in (n for n in paper if n <= largest):
        solvers = (*paper[size], *extra)
        found = compare([random_instance(size, size)], solvers, seeds=range(3), stop=stop)
        bound = max(row.bound for row in found.rows)
        for row in found.rows:
            seconds, length = paper[size].get(row.solver, ("", ""))
            ours = (
                f"{row.seconds:.3f} | {row.cost:.1f} | {max(0.0, 100 * (row.cost / bound - 1)):.2f}"
            )
            print(f"| {size} | {row.solver} | {seconds} | {length} | {ours} | {row.status} |")
    print(f"\n{found.machine}\n")


def main(seconds=10.0, largest=433, picture="tours.png"):
    """Print Tables 2 and 3, and draw Fig. 9."""
    stop = Stop(seconds=float(seconds))
    table(TABLE_2, int(largest), Stop())
    if int(largest) >= 50:
        table(TABLE_3, int(largest), stop, extra=["auto"])
        swarm_and_ants = ["particle-swarm", "ant-colony"]
        compare([random_instance(50, 50)], swarm_and_ants, range(3), stop).plot(picture)


if __name__ == "__main__":
    main(*sys.argv[1:])
