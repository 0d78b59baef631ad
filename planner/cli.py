"""The command ``scanwright``: each verb calls the library and prints."""

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from planner.errors import PlannerError

app = typer.Typer(
    name="scanwright",
    help="Plans drone flights for high-quality aerial 3D reconstruction.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
solvers_app = typer.Typer(help="The optimisation back ends.", no_args_is_help=True)
app.add_typer(solvers_app, name="solvers")

Out = Annotated[Path, typer.Option("--out", help="Folder to write the plan to.")]
Settings = Annotated[Path | None, typer.Option("--config", help="TOML file with settings.")]
Assignments = Annotated[
    list[str] | None, typer.Option("--set", help="One setting, such as route.solver=ortools.")
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace an earlier plan.")]
Workers = Annotated[int, typer.Option("--workers", min=1, help="Processes to spread work over.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the result as JSON on stdout.")]


@app.command("plan")
def plan_command(
    scene: Annotated[Path, typer.Argument(help="Point cloud, mesh or city model.")],
    out: Out,
    config: Settings = None,
    assign: Assignments = None,
    workers: Workers = 1,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Plan the flight that photographs SCENE well enough to reconstruct it.

    Exits with 0 if the plan is complete, 1 if it is partial (written and safe all the same), 2 if
    the scene, a setting or the folder must be changed first, 3 if a package is missing.
    """
    from planner.config import load_config
    from planner.missions.folder import refuse_folder

    refuse_folder(out, overwrite=overwrite)
    settings = load_config(config, assign or ())
    _plan_and_save(scene, settings, out, workers=workers, overwrite=overwrite, as_json=as_json)


@app.command()
def demo(
    out: Out,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Seed of the block.")] = 0,
    config: Settings = None,
    assign: Assignments = None,
    workers: Workers = 1,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Plan a seeded synthetic block: no data needed; exits as plan does."""
    from planner.config import load_config
    from planner.foresight import refuse_settings
    from planner.missions.folder import refuse_folder
    from planner.scene.synthetic import synthetic_scene

    refuse_folder(out, overwrite=overwrite)
    settings = refuse_settings(load_config(config, assign or ()))
    _say("scene", "building a synthetic block")
    block = synthetic_scene(seed)
    _plan_and_save(block, settings, out, workers=workers, overwrite=overwrite, as_json=as_json)


@app.command()
def check(
    folder: Annotated[Path, typer.Argument(help="Plan folder.")],
    scene: Annotated[
        Path | None, typer.Option("--scene", help="Also verify that this is the planned file.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Read a written plan back and prove that it keeps its distance.

    Exits with 0 if all is proven, 1 if something is unsafe or was changed, 2 if a file is missing
    or broken. The numbers of report.json itself, which holds the hashes, are not proven.
    """
    from planner.missions.check import check_folder

    result = check_folder(folder, scene=scene)
    for problem in result.problems:
        _print(f"unsafe: {problem}")
    if result.ok:
        _print(result.summary)
    if as_json:
        print(json.dumps(result.to_dict(), indent=1))  # noqa: T201
    raise typer.Exit(0 if result.ok else 1)


@app.command("settings")
def settings_command(
    toml: Annotated[
        bool, typer.Option("--toml", help="Print a settings file with all defaults instead.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Print every setting: what it takes, its default, its unit and what it does."""
    from planner.manual import page, records, template

    if toml and as_json:
        raise PlannerError("--toml and --json: are two forms of the same; choose one")
    text = json.dumps(records(), indent=1) if as_json else template() if toml else page()
    print(text.rstrip())  # noqa: T201


@solvers_app.command("list")
def list_solvers(as_json: AsJson = False) -> None:
    """List every solver that can be named, built in or plugged in."""
    from solvers.registry import catalogue

    rows = catalogue()
    if as_json:
        print(json.dumps(rows, indent=1))  # noqa: T201
        return
    for row in rows:
        origin = "" if row["source"] == "built in" else f"  [{row['source']}]"
        note = "" if row["available"] else f"  (missing: {row['missing']})"
        print(f"{row['family']:8}{row['name']:22}{row['summary']}{origin}{note}")  # noqa: T201


@solvers_app.command("compare")
def compare_solvers(
    family: Annotated[str, typer.Argument(help="cover, pairs, tour or motion.")],
    instances: Annotated[
        list[str] | None,
        typer.Argument(help="Files (TSPLIB, OR-Library), or random:SIZE:SEED, boxes:COUNT:SEED."),
    ] = None,
    solver: Annotated[
        list[str] | None, typer.Option(help='Name, or "two-opt neighbours=5"; all if left out.')
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, help="How many seeds, from 0 up.")] = 1,
    seconds: Annotated[float | None, typer.Option(help="Limit of each run.")] = None,
    iterations: Annotated[int | None, typer.Option(min=1, help="Limit of each run.")] = None,
    until_best: Annotated[
        bool, typer.Option("--until-best", help="End a run at the best cost known, too.")
    ] = False,
    csv: Annotated[Path | None, typer.Option(help="File for the rows.")] = None,
    markdown: Annotated[Path | None, typer.Option(help="File for the tables.")] = None,
    plot: Annotated[Path | None, typer.Option(help="File for the anytime curves.")] = None,
    workers: Workers = 1,
    as_json: AsJson = False,
) -> None:
    """Race solvers of FAMILY on INSTANCES and print a table: one row an instance and solver."""
    from solvers.cases import cases, entrants
    from solvers.compare import compare
    from solvers.curves import check_format

    for out in (csv, markdown, plot):
        if out is not None and not out.absolute().parent.is_dir():
            raise PlannerError(f"{out}: there is no such folder to write into; make it first")
    with _solver_errors(), _executor(workers) as spread:
        if plot is not None:
            check_format(plot)
        stop = _stop(seconds, iterations)
        racing = cases(family, instances or ()), entrants(family, solver or ())
        table = compare(
            *racing, range(seeds), stop, until_best=until_best, map=spread, listener=_say_trial
        )
        for path, text in ((csv, table.csv()), (markdown, table.markdown())):
            if path is not None:
                path.write_text(text, encoding="utf-8")
        if plot is not None:
            table.plot(plot)
    print(table.json() if as_json else table.markdown())  # noqa: T201
    raise typer.Exit(1 if table.interrupted or any(row.reason for row in table.rows) else 0)


def _stop(seconds: float | None, iterations: int | None) -> Any:
    from solvers import Stop

    try:
        return Stop(seconds=seconds, iterations=iterations)
    except ValueError as error:
        raise PlannerError(f"--seconds or --iterations: {error}") from error


def _say_trial(trial: Any) -> None:
    """Show how one run of a comparison ended."""
    if trial.result is None:
        outcome = trial.reason
    else:
        outcome = f"{trial.result.status}, {trial.result.cost:.7g}, {trial.result.seconds:.2f} s"
    _print(f"{trial.instance}  {trial.solver}  seed {trial.seed}: {outcome}")


@contextmanager
def _solver_errors() -> Iterator[None]:
    """Turn what a comparison finds wrong with its words or files into a line of this command."""
    from solvers import SolverError

    try:
        yield
    except (SolverError, OSError) as error:
        raise PlannerError(str(error)) from error


@contextmanager
def _executor(workers: int) -> Iterator[Any]:
    """``map``, or that of spawned processes whose death is noticed."""
    if workers == 1:
        yield map
        return
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        yield pool.map


def _plan_and_save(
    source: Any, settings: Any, out: Path, *, workers: int, overwrite: bool, as_json: bool
) -> None:
    """Plan, write, say what came out, and exit with 0 (complete) or 1 (partial)."""
    from planner.planning import PlanStatus, plan
    from planner.report.numbers import summary

    with _executor(workers) as spread:
        result = plan(source, settings, map=spread, listener=_say)
    _say("write", f"writing {out} and proving it")
    result.save(out, overwrite=overwrite)
    numbers = summary(result)
    for finding in result.findings:
        _print(f"{finding.stage}: {finding.message}")
    _print(f"{_outcome(result)}: {out}")
    if as_json:
        print(json.dumps({**numbers, "timing": result.timing}, indent=1))  # noqa: T201
    raise typer.Exit(0 if result.status is PlanStatus.COMPLETE else 1)


def _outcome(result: Any) -> str:
    """What a plan comes to, in one line."""
    from planner.report.numbers import (
        in_sorties,
        length_and_seconds,
        proven_clearance,
        rounded_down,
        summary,
    )

    (length, seconds), clearance = length_and_seconds(result), proven_clearance(result)
    count = len(result.viewpoints)
    return (
        f"{result.status}: {count} viewpoint{'' if count == 1 else 's'}, "
        f"{length:.0f} m, {seconds:.0f} s{in_sorties(summary(result)['sorties'])}"
    ) + (
        ""
        if clearance is None
        else f", certified clearance {rounded_down(clearance)} m "
        f"(d_min {rounded_down(result.scale.d_min)} m)"
    )


def _say(stage: str, sentence: str) -> None:
    """Show one line of progress."""
    _print(f"{stage:>10}  {sentence}".rstrip(), style="dim" if sentence else "bold")


def _print(line: str, *, style: str | None = None) -> None:
    """Print text for people, on stderr, as it is."""
    from rich.console import Console

    console = Console(stderr=True, highlight=False, markup=False, emoji=False, soft_wrap=True)
    console.print(line, style=style)


def main() -> None:
    """Run the command and turn what the user can mend into one line and an exit code."""
    try:
        app()
    except PlannerError as error:
        print(f"scanwright: {error}", file=sys.stderr)  # noqa: T201
        sys.exit(error.exit_code)
    except KeyboardInterrupt:
        print("scanwright: interrupted; nothing was written", file=sys.stderr)  # noqa: T201
        sys.exit(130)
