"""Plan the drone flight that a high-quality aerial 3D reconstruction needs."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from planner.config import Config, SceneSettings, ZoneSettings, load_config
    from planner.errors import MissingDependency, PlannerError
    from planner.missions.check import check_folder
    from planner.missions.written import WrittenPlan, load_plan
    from planner.planning import Plan, PlanStatus, plan
    from planner.scene.load import load_scene
    from planner.scene.scene import Scene
    from planner.scene.synthetic import synthetic_scene
    from planner.viewpoints.camera import Camera

__all__ = [
    "Camera",
    "Config",
    "MissingDependency",
    "Plan",
    "PlanStatus",
    "PlannerError",
    "Scene",
    "SceneSettings",
    "WrittenPlan",
    "ZoneSettings",
    "check_folder",
    "load_config",
    "load_plan",
    "load_scene",
    "plan",
    "synthetic_scene",
]

_ROOMS = {
    "Camera": "planner.viewpoints.camera",
    "MissingDependency": "planner.errors",
    "SceneSettings": "planner.config",
    "WrittenPlan": "planner.missions.written",
    "ZoneSettings": "planner.config",
    "load_plan": "planner.missions.written",
    "Config": "planner.config",
    "Plan": "planner.planning",
    "PlanStatus": "planner.planning",
    "PlannerError": "planner.errors",
    "Scene": "planner.scene.scene",
    "check_folder": "planner.missions.check",
    "load_config": "planner.config",
    "load_scene": "planner.scene.load",
    "plan": "planner.planning",
    "synthetic_scene": "planner.scene.synthetic",
}


def __getattr__(name: str) -> Any:
    """Load a public name when it is first asked for."""
    if name not in _ROOMS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(_ROOMS[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
