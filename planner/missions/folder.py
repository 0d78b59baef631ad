"""A folder that appears whole or not at all."""

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from planner.errors import PlannerError

FILES = frozenset(
    {
        "airspace.npz",
        "config.toml",
        "hull.glb",
        "hull.obj",
        "hull.ply",
        "hull.stl",
        "overview.png",
        "path.csv",
        "path.json",
        "report.json",
        "samples.ply",
        "scene.json",
        "sorties.csv",
        "sorties.json",
        "viewpoints.csv",
    }
)
"""Every file that a plan folder may hold; a folder with any other is somebody else's."""


def refuse_folder(target: str | Path, *, overwrite: bool) -> None:
    """Refuse an output folder that could not be written in the end, before any work is done.

    Raises
    ------
    PlannerError
        If the folder exists and may not be replaced, is a file, or its parent is not writable.

    """
    target = Path(target)
    try:
        _refuse(target, overwrite=overwrite)
    except OSError as error:
        raise PlannerError(
            f"{target}: cannot be reached ({error.strerror}); choose a folder that you may write to"
        ) from None


def _refuse(target: Path, *, overwrite: bool) -> None:
    """Refuse, or let the system's own complaint through."""
    if target.is_symlink() or (target.exists() and not target.is_dir()):
        raise PlannerError(f"{target}: is not a folder; name a new folder with --out")
    if target.exists() and not overwrite:
        raise PlannerError(f"{target}: exists already; name another folder or pass --overwrite")
    if target.exists():
        strangers = sorted({entry.name for entry in target.iterdir()} - FILES)
        if strangers:
            raise PlannerError(
                f"{target}: holds {strangers[0]}, which no plan does, and is left alone; "
                "name another folder"
            )
    parent = target.absolute().parent
    while not parent.exists():
        parent = parent.parent
    try:
        Path(tempfile.mkdtemp(prefix=f".{target.name}-", dir=parent)).rmdir()
    except OSError as error:
        raise PlannerError(
            f"{target}: cannot be written under {parent} ({error.strerror}); "
            "choose a folder that you may write to"
        ) from None


@contextmanager
def whole_folder(target: str | Path, *, overwrite: bool = False) -> Iterator[Path]:
    """Yield an empty folder beside ``target`` that takes its place when the block succeeds.

    Parameters
    ----------
    target
        Folder to be made; its parents are made too.
    overwrite
        Whether an earlier plan of that name may be replaced.

    Yields
    ------
    folder
        Temporary folder to write into; removed if the block raises.

    Raises
    ------
    PlannerError
        As :func:`refuse_folder`, or if the place cannot be written to.

    """
    refuse_folder(target, overwrite=overwrite)
    target = Path(target)
    try:
        target.absolute().parent.mkdir(parents=True, exist_ok=True)
        draft = Path(tempfile.mkdtemp(prefix=f".{target.name}-", dir=target.absolute().parent))
    except OSError as error:
        raise PlannerError(
            f"{target}: cannot be written ({error.strerror}); choose another folder"
        ) from None
    try:
        draft.chmod(0o755)
        yield draft
        if target.exists():
            earlier = Path(tempfile.mkdtemp(prefix=f".{target.name}-", dir=draft.parent))
            target.replace(earlier / "plan")
            try:
                draft.replace(target)
            except OSError:
                (earlier / "plan").replace(target)
                raise
            finally:
                shutil.rmtree(earlier, ignore_errors=True)
        else:
            draft.replace(target)
    except OSError as error:
        raise PlannerError(
            f"{target}: cannot be written ({error}); free some space or choose another folder"
        ) from None
    finally:
        if draft.exists():
            shutil.rmtree(draft, ignore_errors=True)
