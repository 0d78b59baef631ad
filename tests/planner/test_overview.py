"""What stands below the picture of a plan: no legend covers another or the picture."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from planner.report.hull_lines import HullDrawing
from planner.report.overview import REASON_MARKS, DrawnFlight, _legends, _marks


@pytest.mark.parametrize("sorties", [1, 5, 40])
@pytest.mark.parametrize("reasons", [0, 1, 4, 7])
def test_legends_stand_beside_each_other(sorties, reasons):
    line = np.zeros((2, 3))
    hull = HullDrawing((0.0, 9.0), ((line,),), (line,), (line,), line[0], 3.0, line)
    flight = DrawnFlight("sortie 10: 100 photos, 10.0 min", line, np.ones(2, dtype=bool))
    figure = Figure(figsize=(17.0, 9.0), dpi=110)
    FigureCanvasAgg(figure)
    panel = figure.subplots()
    for reason in list(REASON_MARKS)[:reasons]:
        panel.scatter([0.0], [0.0], label=f"{reason} (10000)")
    top = _legends(figure, panel, _marks([flight] * sorties, hull, 1000), reasons > 0)
    boxes = [legend.get_window_extent() for legend in figure.legends]
    assert len(boxes) == 1 + (reasons > 0)
    assert boxes[0].x0 >= 0.0
    assert max(box.y1 for box in boxes) <= top * figure.bbox.height <= 0.4 * figure.bbox.height
    assert all(box.x1 < boxes[0].x0 for box in boxes[1:])
