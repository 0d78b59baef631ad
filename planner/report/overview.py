"""One picture of a plan: from the top and from the side."""

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.geometry.arrays import Bools, Floats
from planner.report.hull_lines import HullDrawing
from planner.scene.cloud import PointCloud
from planner.viewpoints.viewpoints import Viewpoints

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

INK, PAPER = "#1b2733", "#ffffff"
REPAIRED_COLOUR, VIEW_COLOUR = "#d1007a", "#1b2733"
START_COLOUR = "#f0a202"
HULL_COLOUR, ZONE_COLOURS = "#8c4a1f", ("#c00018", "#2c7a3f")
SORTIE_COLOURS = ("#14558f", "#e07b00", "#0b8a6f", "#8f3fa8", "#a03020", "#5b6f00")
MATCHED_STYLE: dict[str, Any] = {"facecolors": "none", "edgecolors": "#5a3fc0", "linewidths": 1.2}
QUALITY_MAP = "RdYlGn"
PALE = 0.35  # share of white in the points, so that the path stands out
REASON_MARKS = {
    "too-few-views": ("o", "#7a2fb8"),
    "parallax": ("s", "#0097b2"),
    "gsd": ("D", "#7b4a12"),
    "occluded": ("X", "#1b2733"),
    "no-free-position": ("v", "#6b7680"),
    "gimbal": ("^", "#2f55d4"),
    "zone": ("P", "#c4178a"),
}
LIGHT = np.array([-0.45, -0.55, 0.70])
TOP = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
MOST_POINTS = 120_000
MOST_NAMED = 10  # sorties in the legend


def oblique(azimuth_deg: float = -60.0, elevation_deg: float = 32.0) -> Floats:
    """Orthographic view from a side: rows are right, up and towards the viewer, shape (3, 3)."""
    azimuth, elevation = np.radians([azimuth_deg, elevation_deg])
    towards = np.array(
        [
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
        ]
    )
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    return np.stack([right, np.cross(towards, right), towards])


@dataclass(frozen=True, slots=True, eq=False)
class DrawnFlight:
    """One flight, or one sortie.

    Parameters
    ----------
    label
        What the legend says.
    curve
        Dense points along the curve, shape (K, 3), from the ground if it takes off there.
    repaired
        Whether each point lies on a repaired leg, shape (K,).

    """

    label: str
    curve: Floats
    repaired: Bools


def draw_overview(
    path: Path,
    *,
    title: str,
    cloud: PointCloud,
    quality: Floats,
    radius: float,
    viewpoints: Viewpoints,
    flights: Sequence[DrawnFlight],
    hull: HullDrawing,
    uncovered: Mapping[str, Floats],
    matched: Floats,
    caption: str,
) -> None:
    """Draw the scene by quality, what is not covered and why, the hull, viewpoints and flights.

    Parameters
    ----------
    path
        PNG file to write.
    title
        Line above the picture.
    cloud, quality
        Points of the scene, with normals if known, and the quality of each in [0, 1], shape (N,).
    radius
        Size that a point stands for, metres.
    viewpoints
        Viewpoints in visiting order.
    flights
        What is flown: one flight, or the sorties in order.
    hull
        No-fly hull, zones, the place of the smallest clearance and photos that were lost.
    uncovered
        Samples that are not covered by the reason, each of shape (n, 3).
    matched
        Photos of the first flight that match with new ones, shape (m, 3).
    caption
        Line below the picture.

    """
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    if len(cloud) > MOST_POINTS:
        rows = np.linspace(0, len(cloud) - 1, MOST_POINTS).astype(np.int64)
        cloud, quality = cloud.take(rows), quality[rows]
    figure = Figure(figsize=(17.0, 9.0), dpi=110, facecolor=PAPER)
    FigureCanvasAgg(figure)
    panels = figure.subplots(1, 2, gridspec_kw={"width_ratios": (1.0, 1.15)})
    for axes, view, name in zip(panels, (TOP, oblique()), ("top", "oblique"), strict=True):
        _points(axes, view, cloud, quality, radius)
        _uncovered(axes, view, uncovered)
        _hull(axes, view, hull)
        _flights(axes, view, viewpoints, flights)
        _close_places(axes, view, hull)
        flat = matched @ view.T
        axes.scatter(flat[:, 0], flat[:, 1], s=42.0, marker="s", zorder=5.5, **MATCHED_STYLE)
        shown = [cloud.xyz, viewpoints.positions, *(flight.curve for flight in flights)]
        _frame(axes, np.vstack(shown) @ view.T)
        axes.set_title(f"{name} view", fontsize=11, color=INK)
    panels[0].set_xlabel("local x, metres")
    panels[0].set_ylabel("local y, metres")
    panels[1].set_xticks([])
    panels[1].set_yticks([])
    bottom = 0.075 + _legends(
        figure, panels[0], _marks(flights, hull, len(matched)), bool(uncovered)
    )
    figure.subplots_adjust(left=0.05, right=0.93, top=0.88, bottom=bottom, wspace=0.05)
    bar = figure.add_axes((0.945, bottom, 0.012, 0.83 - bottom))
    scale = mpl.cm.ScalarMappable(mpl.colors.Normalize(0.0, 1.0), QUALITY_MAP)
    figure.colorbar(scale, cax=bar, label="quality of the coarse model (0 unknown, 1 well known)")
    figure.suptitle(
        title, fontsize=15, color=INK, x=0.05, ha="left", fontweight="bold", parse_math=False
    )
    figure.text(0.05, 0.925, caption, fontsize=10, color=INK, parse_math=False)
    buffer = io.BytesIO()
    with mpl.rc_context({"savefig.facecolor": PAPER}):
        figure.savefig(buffer, format="png", metadata={"Software": None})
    path.write_bytes(buffer.getvalue())


def _points(axes: "Axes", view: Floats, cloud: PointCloud, quality: Floats, radius: float) -> None:
    """Draw the scene's points by quality, far ones first, shaded by how they face the light."""
    import matplotlib as mpl

    flat = cloud.xyz @ view.T
    order = np.argsort(flat[:, 2], kind="stable")
    span = float(np.ptp(flat[:, :2], axis=0).max()) if len(flat) else 1.0
    colours = mpl.colormaps[QUALITY_MAP](quality)[:, :3]
    facing = np.ones(len(flat)) if cloud.normals is None else np.abs(cloud.normals @ LIGHT)
    shade = (0.60 + 0.40 * facing)[:, None]
    axes.scatter(
        flat[order, 0],
        flat[order, 1],
        c=(shade * (PALE + (1.0 - PALE) * colours))[order],
        s=min(max((150.0 * radius / span) ** 2, 1.5), 40.0),
        linewidths=0.0,
        rasterized=True,
    )


def _uncovered(axes: "Axes", view: Floats, uncovered: Mapping[str, Floats]) -> None:
    """Mark the samples that are not covered, each reason in its own way."""
    for reason, xyz in uncovered.items():
        flat = xyz @ view.T
        marker, colour = REASON_MARKS[reason]
        axes.scatter(
            flat[:, 0],
            flat[:, 1],
            s=26.0,
            marker=marker,
            color=colour,
            edgecolor=PAPER,
            linewidths=0.5,
            zorder=2.5,
            label=f"{reason} ({len(xyz)})",
        )


def _hull(axes: "Axes", view: Floats, hull: HullDrawing) -> None:
    """Draw the level lines of the hull, darker with height, and the edges of zones."""
    for level, lines in enumerate(hull.lines):
        share = (level + 1) / len(hull.lines)
        for line in lines:
            flat = line @ view.T
            style: dict[str, Any] = {"linewidth": 0.8, "alpha": 0.35 + 0.55 * share, "zorder": 1.6}
            axes.plot(flat[:, 0], flat[:, 1], color=HULL_COLOUR, **style)
    for colour, outlines in zip(ZONE_COLOURS, (hull.keep_out, hull.keep_in), strict=True):
        for line in outlines:
            flat = line @ view.T
            axes.plot(flat[:, 0], flat[:, 1], color=colour, linewidth=1.1, ls="--", zorder=2.2)


def _close_places(axes: "Axes", view: Floats, hull: HullDrawing) -> None:
    """Ring the place of the smallest clearance, and cross the photos that no flight reaches."""
    if hull.closest is not None:
        x, y, _ = view @ hull.closest
        style: dict[str, Any] = {"marker": "o", "facecolors": "none", "linewidths": 1.8}
        axes.scatter([x], [y], s=150.0, edgecolors=ZONE_COLOURS[0], zorder=8, **style)
    flat = hull.lost @ view.T
    axes.scatter(flat[:, 0], flat[:, 1], s=36.0, marker="x", color=ZONE_COLOURS[0], zorder=8)


def _flights(
    axes: "Axes", view: Floats, viewpoints: Viewpoints, flights: Sequence[DrawnFlight]
) -> None:
    """Draw the flights, the repaired legs, and each viewpoint with its direction."""
    positions = viewpoints.positions @ view.T
    look = viewpoints.directions @ view.T
    line = np.vstack([np.zeros((0, 3)), *(flight.curve for flight in flights)]) @ view.T
    for flight, colour in zip(flights, _colours(flights), strict=True):
        own = flight.curve @ view.T
        axes.plot(own[:, 0], own[:, 1], color=PAPER, linewidth=2.6, alpha=0.6, zorder=2)
        axes.plot(own[:, 0], own[:, 1], color=colour, linewidth=1.2, zorder=3)
        mended = np.where(flight.repaired[:, None], own[:, :2], np.nan)
        axes.plot(mended[:, 0], mended[:, 1], color=REPAIRED_COLOUR, linewidth=2.2, zorder=4)
    span = float(np.ptp(line[:, :2], axis=0).max()) if len(line) else 1.0
    axes.quiver(
        positions[:, 0],
        positions[:, 1],
        look[:, 0],
        look[:, 1],
        angles="xy",
        scale_units="xy",
        scale=1.0 / max(0.022 * span, 1e-9),
        width=0.0016,
        color=VIEW_COLOUR,
        zorder=5,
    )
    axes.scatter(positions[:, 0], positions[:, 1], s=7.0, color=VIEW_COLOUR, zorder=6)
    start = np.vstack([np.zeros((0, 3)), *(flight.curve[:1] for flight in flights)]) @ view.T
    axes.scatter(
        start[:, 0], start[:, 1], s=70.0, marker="^", color=START_COLOUR, edgecolor=INK, zorder=7
    )


def _frame(axes: "Axes", everything: Floats) -> None:
    """Show all of it, with equal scales and a margin."""
    low, high = everything[:, :2].min(axis=0), everything[:, :2].max(axis=0)
    margin = 0.04 * float((high - low).max())
    axes.set_xlim(low[0] - margin, high[0] + margin)
    axes.set_ylim(low[1] - margin, high[1] + margin)
    axes.set_aspect("equal")
    axes.tick_params(labelsize=8, colors=INK)
    for spine in axes.spines.values():
        spine.set_color("#c5ccd3")


def _colours(flights: Sequence[DrawnFlight]) -> list[str]:
    """Colour of each flight; colours come again after six."""
    return [SORTIE_COLOURS[number % len(SORTIE_COLOURS)] for number in range(len(flights))]


def _legends(figure: "Figure", panel: "Axes", marks: "Sequence[Line2D]", uncovered: bool) -> float:
    """Explain the marks, and beside them why samples are not covered; height, share of the figure.

    Both get fewer columns until neither covers the other.
    """
    for marks_in, reasons_in in ((5, 4), (4, 4), (4, 3), (3, 3), (3, 2), (2, 2)):
        place: dict[str, Any] = {"loc": "lower right", "bbox_to_anchor": (0.935, 0.005)}
        legends = [figure.legend(handles=marks, ncols=marks_in, fontsize=9, **place)]
        if uncovered:
            place = {"loc": "lower left", "bbox_to_anchor": (0.045, 0.005)}
            title: dict[str, Any] = {"title": "not covered", "alignment": "left"}
            handles = panel.get_legend_handles_labels()[0]
            legends.append(
                figure.legend(handles=handles, ncols=reasons_in, fontsize=9, **place, **title)
            )
        boxes = [legend.get_window_extent() for legend in legends]
        if not uncovered or boxes[1].x1 < boxes[0].x0:
            break
        if (marks_in, reasons_in) != (2, 2):
            for legend in legends:
                legend.remove()
    return max(0.075, *(float(box.y1) / float(figure.bbox.height) for box in boxes))


def _marks(flights: Sequence[DrawnFlight], hull: HullDrawing, matched: int) -> "list[Line2D]":
    """One entry of the legend for each kind of mark."""
    from matplotlib.lines import Line2D

    def mark(label: str, **style: Any) -> Line2D:
        return Line2D([], [], label=label, **style)

    marks = [
        mark(flight.label, color=colour)
        for flight, colour in zip(flights, _colours(flights), strict=True)
    ][:MOST_NAMED]
    if len(flights) > MOST_NAMED:
        marks.append(mark(f"... {len(flights)} sorties in all", color="none"))
    if any(flight.repaired.any() for flight in flights):
        marks.append(mark("repaired leg", color=REPAIRED_COLOUR, linewidth=2.2))
    marks.append(mark("viewpoint and direction", color=VIEW_COLOUR, marker="o", markersize=3))
    start: dict[str, Any] = {"marker": "^", "markerfacecolor": START_COLOUR, "markeredgecolor": INK}
    marks.append(mark("start", color="none", markersize=8, **start))
    if matched:
        name = f"photo of the first flight that matches ({matched})"
        square: dict[str, Any] = {"marker": "s", "markerfacecolor": "none", "markersize": 6}
        marks.append(
            mark(name, color="none", markeredgecolor=MATCHED_STYLE["edgecolors"], **square)
        )
    if any(hull.lines):
        low, high = hull.levels[0], hull.levels[-1]
        label = f"no-fly hull at z = {low:.0f} to {high:.0f} m"
        marks.append(mark(label, color=HULL_COLOUR, linewidth=0.8))
    for name, colour, outlines in (
        ("keep-out zone", ZONE_COLOURS[0], hull.keep_out),
        ("keep-in zone", ZONE_COLOURS[1], hull.keep_in),
    ):
        if outlines:
            marks.append(mark(name, color=colour, linestyle="--"))
    ring: dict[str, Any] = {"color": "none", "markeredgecolor": ZONE_COLOURS[0]}
    if hull.closest is not None:
        label = f"smallest clearance found, {hull.clearance:.2f} m"
        marks.append(mark(label, marker="o", markerfacecolor="none", markersize=9, **ring))
    if len(hull.lost):
        marks.append(mark(f"photo that is not flown ({len(hull.lost)})", marker="x", **ring))
    return marks
