"""What the first page shows runs when it is pasted."""

import re
from pathlib import Path

BLOCKS = re.findall(
    r"```python\n(.*?)```",
    (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8"),
    re.DOTALL,
)


def test_the_block_on_solvers_runs_alone(capsys):
    (block,) = (block for block in BLOCKS if "TourProblem" in block)
    exec(block, {})  # noqa: S102
    cost, bound, gap = capsys.readouterr().out.split()
    assert (float(cost), float(bound), float(gap)) == (14.0, 14.0, 0.0)


def test_the_other_blocks_compile():
    assert len(BLOCKS) > 1
    for block in BLOCKS:
        compile(block, "README.md", "exec")
