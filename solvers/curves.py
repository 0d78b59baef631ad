"""Anytime curves: how good the best answer is, as time and iterations go by."""

from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from solvers.arrays import Floats
from solvers.comparison import excess
from solvers.errors import InvalidProblem

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from solvers.comparison import Comparison

Axis = Literal["seconds", "iterations"]


def anytime(comparison: "Comparison", solver: str, axis: Axis) -> tuple[Floats, Floats]:
    """Mean excess of a solver's incumbents over the best cost, as it falls.

    Parameters
    ----------
    comparison
        What was run.
    solver
        Its label.
    axis
        What goes by.

    Returns
    -------
    at, gap
        Where the mean changes, and the share by which it then is above the best, shape (k,)
        each. The curve begins where every run has an answer and stays level from the last
        place on, which is the longest run; runs without any answer are left out.

    """
    steps = []
    for trial in comparison.trials:
        if trial.solver != solver or trial.result is None or not trial.result.trace:
            continue
        best, trace = comparison.best(trial.instance), trial.result.trace
        at = [p.seconds if axis == "seconds" else float(p.iteration) for p in trace]
        steps.append((np.array(at), np.array([excess(point.cost, best) for point in trace])))
    if not steps:
        return np.empty(0), np.empty(0)
    first = max(at[0] for at, _ in steps)
    last = max(
        float(getattr(trial.result, axis))
        for trial in comparison.trials
        if trial.solver == solver and trial.result is not None
    )
    places = np.unique(np.concatenate([at for at, _ in steps] + [[max(first, last)]]))
    places = places[places >= first]
    gaps = [gap[np.searchsorted(at, places, side="right") - 1] for at, gap in steps]
    return places, np.mean(gaps, axis=0)


def check_format(path: Path) -> None:
    """Refuse a file whose suffix is no format of a picture.

    Raises
    ------
    InvalidProblem
        Naming the file and the suffixes there are.

    """
    from matplotlib.backend_bases import FigureCanvasBase

    known = FigureCanvasBase.get_supported_filetypes()
    if path.suffix.removeprefix(".").lower() not in known:
        raise InvalidProblem(f"{path}: no picture has that suffix; take one of {', '.join(known)}.")


def draw(comparison: "Comparison", path: Path) -> None:
    """Draw the anytime curves of every solver, over seconds and over iterations, to a file.

    Raises
    ------
    InvalidProblem
        If the suffix is no format of a picture.

    """
    from matplotlib.figure import Figure

    check_format(path)
    figure = Figure(figsize=(10.0, 4.2), layout="constrained")
    sides: tuple[Axis, ...] = ("seconds", "iterations")
    for axes, axis in zip(figure.subplots(1, 2, sharey=True), sides, strict=True):
        for solver in comparison.solvers:
            _draw_one(axes, *anytime(comparison, solver, axis), solver)
        axes.set_xscale("symlog" if axis == "iterations" else "log")
        axes.set_xlabel(axis)
        axes.grid(visible=True, alpha=0.3)
    many = "mean " if len(comparison.trials) > len(comparison.solvers) else ""
    figure.axes[0].set_ylabel(f"{many}excess over the best cost, %")
    handles, labels = figure.axes[0].get_legend_handles_labels()
    if handles:
        figure.axes[1].legend(handles, labels, fontsize="small")
    figure.savefig(path, dpi=150)


def _draw_one(axes: "Axes", at: Floats, gap: Floats, label: str) -> None:
    finite = np.isfinite(gap)
    if finite.any():
        axes.step(at[finite], 100.0 * gap[finite], where="post", label=label)
