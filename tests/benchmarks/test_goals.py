"""Goals of the benchmarks: every stored figure that has one is held against it."""

from benchmarks.goals import GOALS_OF, all_goals
from benchmarks.report import cases
from benchmarks.results import measured

DISTURBED = ("stamps", "tremor", "thermal_loops", "noise_disturbed", "spin_disturbed", "disturbed")


def test_disturbed_benchmarks_have_goals():
    for name, content in measured(DISTURBED).items():
        goals = all_goals({name: content})
        assert goals, name
        assert all(goal.what and goal.wanted and goal.reached for goal in goals)
    assert set(DISTURBED) <= set(GOALS_OF)


def test_an_interval_that_does_not_hold_misses_its_goal():
    """The lag of 60 s beside a lens was within its interval in 29 %."""
    (content,) = measured(["thermal_loops"]).values()
    content["lags"][1]["coverage"] = 0.29
    missed = [goal.what for goal in all_goals({"thermal_loops": content}) if not goal.is_met]
    assert any("hold a lag" in what for what in missed)


def test_cases_are_printed_before_and_now():
    printed = "\n".join(cases(measured(["cases", "disturbed", "spin_disturbed"])))
    before_values = (
        "15 sigma",
        "± 110 %",
        "7.1 sigma",
        "8 sigma",
        "57 sigma",
        "25.4 ± 3.2 mm/s²",
        "19 % lost",
    )
    for before in before_values:
        assert f"| {before} |" in printed
