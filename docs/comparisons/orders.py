"""Orders of the same photos by the paper's switching cost and by seconds, flown and timed.

python docs/comparisons/orders.py FOLDER [SCENE ...]
"""

import sys
import time
from pathlib import Path

from planner.config import Config, RouteSettings
from planner.flight.fly import plan_flight
from planner.flight.limits import Limits
from planner.flight.timing import fly_in_time
from planner.planning import Plan, plan
from planner.route.cost import Pace
from planner.route.order import order_viewpoints
from planner.route.ways import FreeWays

SCENES = (
    "planner_scenes/sip_BigBen.stl",
    "pointclouds/city3d_building_001.ply",
    "meshes/lyon_church_vaulx.ply",
    "meshes/delft_block_crop.ply",
    "meshes/3dbag_thehague_block.ply",
)
ORDERS = (
    ("Eqs. 9 to 11 over chords", {"cost": "paper", "detours": False}),
    ("Eqs. 9 to 11 over free ways", {"cost": "paper"}),
    ("seconds over chords", {"cost": "seconds", "detours": False}),
    ("seconds over free ways", {"cost": "seconds"}),
)
HEAD = (
    "| scene | order | photos | legs blocked | path, m | yaw, deg | in the air, s | less | rounds |"
)


SETTINGS = {"route": {"cost": "seconds"}, "viewpoints": {"objective": "hits"}}
"""Of the plans whose photos are ordered: a set cover has more photos than the default."""


def main(folder: str, *scenes: str) -> None:
    """Print a line for each scene and order."""
    print(HEAD)
    print("| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    for scene in scenes or SCENES:
        planned = plan(Path(folder) / scene, Config.model_validate(SETTINGS))
        compare(planned, Path(scene).stem)


def compare(planned: Plan, name: str) -> None:
    """Order, fly and time the photos of a plan in each way."""
    first = None
    for title, settings in ORDERS:
        start = time.perf_counter()
        views = planned.selection.viewpoints.rounded()
        config, airspace = planned.config, planned.airspace
        ways = FreeWays(airspace, margin=config.flight.margin)
        route = order_viewpoints(
            views,
            settings=RouteSettings(solver="auto", **settings),
            box=planned.scene.box,
            seed=config.seed,
            pace=Pace.of(config.flight),
            ways=ways,
        )
        flight = plan_flight(views.take(route.order), airspace, settings=config.flight, ways=ways)
        limits = Limits.of(config.flight, gsd=planned.scale.gsd)
        seconds = fly_in_time(flight.path, flight.viewpoints, limits).duration
        first = seconds if first is None else first
        print(
            f"| {name} | {title} | {len(flight.kept)} of {len(views)} | {len(flight.repaired)} "
            f"| {flight.path.length:.0f} | {route.yaw_change_deg:.1f} | {seconds:.0f} "
            f"| {100 * (1 - seconds / first):.1f} % | {route.rounds} |",
            flush=True,
        )
        print(f"{name}, {title}: {time.perf_counter() - start:.1f} s", file=sys.stderr)


if __name__ == "__main__":
    main(*sys.argv[1:])
