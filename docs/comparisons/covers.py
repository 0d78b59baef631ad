"""Set covers: published problems, the same wanting every element twice, and discs in a square.

python docs/comparisons/covers.py [SECONDS [SEEDS [SETS [FOLDER]]]]

FOLDER holds problems of the OR-Library with a best_known.json beside them; without it, planted
problems stand in. Heuristics get SECONDS a run and three times as much on the discs; exact solvers
get 6 times SECONDS, and 60 times where every element is wanted twice.
"""

import json
import sys
from pathlib import Path

from solvers import Stop
from solvers.compare import compare
from solvers.cover.bounds import lp_bound
from solvers.cover.instances import Instance, disc_instance, planted_instance, read_orlib

PROVABLE = ("scp4", "scp5", "scp6", "scpa", "scpb", "scpc", "scpd", "scpe", "planted")
"""How the names of those begin that are small or easy enough for a proof."""


def published(folder, *, demand, key):
    """Problems of a folder with the best cost that is listed under a key."""
    listed = json.loads((Path(folder) / "best_known.json").read_text())["instances"]
    for name, facts in sorted(listed.items()):
        if key in facts:
            problem = read_orlib(Path(folder) / f"{name}.txt", demand=demand).problem
            yield Instance(name if demand == 1 else f"{name} twice", problem, facts[key])


def table(title, instances, entrants, seeds, stop):
    """Print one table; bounds also as a share of the one by linear programming."""
    found = compare(instances, entrants, seeds, stop)
    relaxed = {instance.name: lp_bound(instance.problem) for instance in instances}
    print(f"\n## {title}\n\n{found.markdown()}\n| instance | LP bound |", end="")
    print(*(f" {solver} bound / LP |" for solver in found.solvers), sep="")
    print("| --- | ---: |", "---: |" * len(found.solvers))
    for name, bound in relaxed.items():
        shares = [f" {row.bound / bound:.4f} |" for row in found.rows if row.instance == name]
        print(f"| {name} | {bound:.2f} |", *shares, sep="", flush=True)


def main(seconds=10.0, seeds=3, sets=10_000, folder=None):
    """Print all tables."""
    seconds, seeds, sets = float(seconds), range(int(seeds)), int(sets)
    once = [planted_instance(80, 60, seed, parts=6) for seed in (0, 1)]
    twice = [Instance(f"discs {seed}", disc_instance(60, 80, seed).problem) for seed in (0, 1)]
    if folder is not None:
        once = list(published(folder, demand=1, key="best_known"))
        twice = list(published(folder, demand=2, key="multicover_b2_value"))
    easy = [instance for instance in once if instance.name.startswith(PROVABLE)]
    quick, exact = ["greedy", "lagrangian"], Stop(seconds=6 * seconds)
    table("Heuristics", once, quick, seeds, Stop(seconds=seconds))
    table("Proofs", easy, ["cvxpy", "cp-sat"], [0], exact)
    table("Every element twice", twice, quick, seeds, Stop(seconds=seconds))
    table("Every element twice: proofs", twice, ["cvxpy"], [0], Stop(seconds=60 * seconds))
    discs = [disc_instance(sets, sets * 13 // 10, 0, spread=spread) for spread in (0.0, 0.7)]
    table("Discs", discs, [*quick, "local-search", "cp-sat"], seeds, Stop(seconds=3 * seconds))


if __name__ == "__main__":
    main(*sys.argv[1:])
