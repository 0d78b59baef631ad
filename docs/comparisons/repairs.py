"""Ways round boxes: motion planners on seeded fields whose shortest path is known exactly.

python docs/comparisons/repairs.py [FIELDS [BOXES [SOLVER ...]]]
"""

import sys
from itertools import pairwise

import numpy as np

from solvers.compare import compare
from solvers.motion.instances import random_instances
from solvers.registry import names


def main(fields: int = 500, boxes: int = 10, *solvers: str) -> None:
    """Print a line for each solver: lengths in shortest paths, and edges that enter a box."""
    instances = {field.name: field for field in random_instances(int(fields), boxes=int(boxes))}
    table = compare(instances.values(), solvers or names("motion"))
    print("| solver | solved | mean | 95 % | worst | edges inside | checks | milliseconds |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    for solver in table.solvers:
        rows = [row for row in table.rows if row.solver == solver]
        ratios = np.array([1.0 + row.gap_to_best for row in rows if row.solved] or [np.nan])
        solved = sum(row.solved for row in rows)
        inside = sum(
            instances[trial.instance].boxes.meets(a, b)
            for trial in table.trials
            if trial.solver == solver and trial.result is not None and trial.result.trace
            for a, b in pairwise(trial.result.solution)
        )
        lengths = f"{ratios.mean():.4f} | {np.percentile(ratios, 95):.3f} | {ratios.max():.3f}"
        checks = np.mean([row.iterations for row in rows])
        milliseconds = 1e3 * np.median([row.seconds for row in rows])
        print(f"| {solver} | {solved}/{len(rows)} | {lengths} | {inside} | {checks:.0f} ", end="")
        print(f"| {milliseconds:.0f} |", flush=True)
    print(f"\n{table.machine}")


if __name__ == "__main__":
    main(*sys.argv[1:])
