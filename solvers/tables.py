"""A comparison as Markdown, CSV and JSON."""

import csv
import io
import json
import math
from collections.abc import Iterable
from dataclasses import asdict, fields
from typing import Any

from solvers.comparison import Comparison, Row, Standing, Trial


def markdown(comparison: Comparison) -> str:
    """Table of the rows, table of the solvers over all instances, what failed, the machine."""
    heads = "instance | solver | status | cost | spread | bound | gap | gap to best | seconds"
    heads += " | ended by"
    parts = [_table(heads, (_cells(row) for row in comparison.rows))]
    if len(comparison.instances) > 1:
        heads = "solver | solved | proven | gap | gap to best | worst | seconds"
        parts.append(_table(heads, (_standing_cells(line) for line in comparison.standings)))
    failed = (row for row in comparison.rows if row.reason)
    notes = dict.fromkeys(
        f"- {row.solver} on {row.instance}: {' '.join(row.reason.split())}" for row in failed
    )
    if notes:
        parts.append("\n".join(notes))
    return "\n\n".join([*parts, f"Machine: {comparison.machine}."]) + "\n"


def comma_separated(comparison: Comparison) -> str:
    """Rows with a header; empty where there is no number."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(f.name for f in fields(Row))
    writer.writerows([_plain(v) for v in asdict(row).values()] for row in comparison.rows)
    return text.getvalue()


def as_json(comparison: Comparison) -> str:
    """Rows, standings and every trial with its trace; null where there is no number."""
    content = {
        "machine": comparison.machine,
        "interrupted": comparison.interrupted,
        "rows": [asdict(row) for row in comparison.rows],
        "solvers": [asdict(line) for line in comparison.standings],
        "trials": [_facts(trial) for trial in comparison.trials],
    }
    return json.dumps(_plain(content), indent=1, allow_nan=False)


def _facts(trial: Trial) -> dict[str, Any]:
    facts: dict[str, Any] = {
        "instance": trial.instance,
        "solver": trial.solver,
        "seed": trial.seed,
        "reason": trial.reason,
    }
    if trial.result is not None:
        names = ("cost", "bound", "gap", "iterations", "seconds", "refused")
        facts |= {name: getattr(trial.result, name) for name in names}
        facts |= {"status": trial.result.status, "stop_reason": trial.result.stop_reason}
        facts["trace"] = [asdict(point) for point in trial.result.trace]
    return facts


def _plain(value: Any) -> Any:
    """The same without numbers that JSON and CSV cannot say."""
    if isinstance(value, dict):
        return {key: _plain(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [_plain(inner) for inner in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _cells(row: Row) -> list[str]:
    status = (
        row.status if row.solved in (0, row.runs) else f"{row.status} ({row.solved}/{row.runs})"
    )
    return [
        row.instance,
        row.solver,
        status,
        _number(row.cost),
        _number(row.spread),
        _number(row.bound),
        _percent(row.gap),
        _percent(row.gap_to_best),
        _seconds(row.seconds),
        row.stop_reason or "error, see below",
    ]


def _standing_cells(line: Standing) -> list[str]:
    return [
        line.solver,
        f"{line.solved}/{line.instances}",
        str(line.proven),
        _percent(line.gap),
        _percent(line.gap_to_best),
        _percent(line.worst_gap_to_best),
        _seconds(line.seconds),
    ]


def _table(heads: str, rows: Iterable[list[str]]) -> str:
    names = heads.split(" | ")
    words = {"instance", "solver", "status", "ended by"}
    rules = ["---" if name in words else "---:" for name in names]
    lines = [names, rules, *([cell.replace("|", "\\|") for cell in row] for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _number(value: float) -> str:
    return f"{value:.7g}" if math.isfinite(value) else ""


def _percent(value: float) -> str:
    return f"{100.0 * value:.2f} %" if math.isfinite(value) else ""


def _seconds(value: float) -> str:
    return f"{value:.3f}" if math.isfinite(value) else ""
