"""The best photos for minutes of flight, or for a number of photos with those that link them."""

import json
from types import SimpleNamespace

import pytest

from planner import PlannerError, load_config, plan, synthetic_scene
from planner.attempts import solver_words
from planner.bracket import Trial
from planner.budget import _search
from planner.clock import Clock
from planner.errors import Unattainable
from planner.report.numbers import summary
from solvers import SolverError

SETTINGS = ["scale.radius_share=0.045", "seed=4", "viewpoints.iterations=60"]
HOME = ["sorties.stations=[[-30.0,-25.0]]", "sorties.endurance_seconds=250.0"]


@pytest.fixture(scope="module")
def scene():
    return synthetic_scene(3, size=(45.0, 40.0), buildings=3, spacing=0.8)


def planned(scene, *settings):
    return plan(scene, load_config(None, [*SETTINGS, *settings]))


@pytest.fixture(scope="module")
def whole(scene):
    return planned(scene)


@pytest.fixture(scope="module")
def half(scene, whole):
    return planned(scene, f"viewpoints.minutes={0.5 * whole.timeline.duration / 60.0!r}")


def test_a_flight_within_the_minutes_is_the_one_without_a_limit(scene, whole):
    free = planned(scene, f"viewpoints.minutes={whole.timeline.duration / 60.0 + 1e-3!r}")
    assert free.viewpoints.positions.tolist() == whole.viewpoints.positions.tolist()
    assert free.limit.trials == 0
    assert free.limit.used == free.limit.whole_minutes == whole.timeline.duration / 60.0
    assert free.limit.share == free.limit.whole_share == whole.selection.fulfilled
    assert free.findings == whole.findings


def test_half_the_minutes_are_kept_and_used(half, whole):
    asked = 30.0 * whole.timeline.duration / 60.0
    assert half.rows[-1, 0] <= asked
    assert half.rows[-1, 0] >= 0.8 * asked
    assert half.selection.graph.firm
    assert half.status == whole.status == "complete"  # the share is what the time gives
    (finding,) = (finding for finding in half.findings if finding.code == "minutes-limit")
    assert finding.number == half.selection.fulfilled < whole.selection.fulfilled
    assert half.limit.whole_photos == len(whole.viewpoints) > len(half.viewpoints)
    assert half.limit.whole_share == whole.selection.fulfilled
    numbers = json.loads(json.dumps(summary(half)))["viewpoints"]["time_limit"]
    assert numbers["used"] <= numbers["minutes"] < numbers["whole_minutes"]
    assert f"{numbers['whole_photos']} photos" in finding.message
    assert half.config.viewpoints.minutes == numbers["minutes"]
    assert half.config.viewpoints.budget is None


@pytest.mark.slow
def test_too_few_minutes_are_refused_with_those_that_are_missing(scene):
    with pytest.raises(PlannerError, match=r"minutes = 0\.02: .* 2 photos, takes") as caught:
        planned(scene, "viewpoints.minutes=0.02")
    enough = float(str(caught.value).rsplit("minutes to ", 1)[1].split()[0])
    assert planned(scene, f"viewpoints.minutes={enough}").rows[-1, 0] <= 60.0 * enough


@pytest.mark.slow
def test_more_minutes_show_no_less(scene, half, whole):
    limit = 0.75 * whole.timeline.duration
    more = planned(scene, f"viewpoints.minutes={limit / 60.0!r}")
    assert more.rows[-1, 0] <= limit
    shares = [found.selection.fulfilled for found in (half, more, whole)]
    assert shares == sorted(set(shares))


@pytest.mark.slow
def test_the_time_of_sorties_counts_with_their_climbs(scene, tmp_path):
    found = planned(scene, *HOME, "viewpoints.minutes=2.5")
    seconds = sum(sortie.duration for sortie in found.sorties.flown)
    assert found.timeline.duration < seconds <= 150.0
    assert found.limit.used == pytest.approx(seconds / 60.0, abs=1e-12)
    found.save(tmp_path / "plan")
    report = json.loads((tmp_path / "plan" / "report.json").read_text())
    assert sum(flown["duration"] for flown in report["sorties"]["flown"]) <= 150.0
    again = plan(scene, load_config(tmp_path / "plan" / "config.toml"))
    assert again.viewpoints.positions.tolist() == found.viewpoints.positions.tolist()


@pytest.mark.parametrize("budget", [3, 14])
def test_a_number_of_photos_holds_for_those_that_link_them_too(scene, budget):
    found = planned(scene, f"viewpoints.budget={budget}")
    assert 0.7 * budget <= len(found.viewpoints) <= budget
    assert found.selection.graph.firm
    assert found.limit is None


@pytest.mark.parametrize(
    ("settings", "complaint"),
    [
        (["viewpoints.minutes=0"], "a number above 0"),
        (["viewpoints.minutes=5", "viewpoints.budget=5"], "leave one of them out"),
        (["viewpoints.minutes=5", "viewpoints.preset=paper"], "needs preset"),
        (["viewpoints.minutes=5", "viewpoints.objective=hits"], "needs preset"),
        (["viewpoints.budget=5", "viewpoints.preset=paper"], "budget needs preset"),
        (["viewpoints.budget=5", "viewpoints.preset=smith"], "budget needs preset"),
        (["viewpoints.budget=5", "viewpoints.objective=hits"], "budget needs preset"),
    ],
)
def test_limits_that_would_not_be_kept_are_refused(settings, complaint):
    with pytest.raises(PlannerError, match=complaint) as caught:
        load_config(None, settings)
    assert "\n" not in str(caught.value)


def searched(plan_of):
    """Trials of fewer photos than nine, of which each costs one, within four."""
    whole = Trial(9, 9.0, None)
    return _search(whole, plan_of, lambda outing: outing.photos, 4.5, least=1, clock=Clock(None))


def test_a_number_without_room_or_time_is_beyond_the_limit():
    def plan_of(number):
        if number > 2:
            raise Unattainable("no room")
        return SimpleNamespace(photos=number, seconds=0.0)

    tried = searched(plan_of)
    assert max(trial.asked for trial in tried if trial.cost <= 4.5) == 2
    assert all((trial.answer is None) == (trial.asked > 2) for trial in tried)


def test_a_solver_that_fails_ends_the_search_with_its_own_words():
    def plan_of(number):
        with solver_words():
            raise SolverError("out of memory")

    with pytest.raises(PlannerError, match="a solver gave up") as caught:
        searched(plan_of)
    assert not isinstance(caught.value, Unattainable)
