"""Tables and comparisons of made-up runs: medians, who is behind, what breaks limits, what has changed."""

import csv
import io

import numpy as np
import pytest

from trajevo.errors import InvalidInputError
from trajevo.study.bench import record
from trajevo.study.bench.compare import compared, pace, unlike
from trajevo.study.bench.record import BenchResults, BenchRun, Machine
from trajevo.study.bench.table import Quartiles, cells_of, comma_separated, markdown, rows_of, write_table

HERE = Machine(processor="a processor", cores=2, system="Linux")


def run(rival, seed, to_95, to_99, share=1.0, **more):
    """A made-up run."""
    given = {
        "problem": "arm",
        "budget": 10.0,
        "end": "scored",
        "versions": {"python": "3.12"},
        "machine": HERE,
        "objectives": ("time",),
        "units": ("s",),
        "times": {"0.95": to_95, "0.99": to_99},
        "share": share,
        "violation": -0.1,
        "checked": 1,
        "instants": 50_000,
        "X": ((1.0,),),
        "F": ((2.0,),),
    }
    return BenchRun(rival=rival, seed=seed, **given | more)


def results(*runs):
    return BenchResults.of(runs)


OURS = [run("trajevo", seed, 0.1 * seed, 1.0 * seed) for seed in range(1, 6)]
QUICK = [run("quick", seed, 0.01 * seed, 0.1 * seed) for seed in range(1, 6)]
SLOW = [run("slow", seed, 1.0 * seed, None, share=0.98) for seed in range(1, 6)]


def row_of(rival, *runs):
    return next(row for row in rows_of(results(*runs)) if row.rival == rival)


@pytest.mark.parametrize("seed", range(5))
def test_medians_are_between_quartiles_which_are_runs(seed):
    rng = np.random.default_rng(seed)
    values = rng.uniform(size=rng.integers(1, 12))
    found = Quartiles.of(values)
    assert found.low <= found.median <= found.high
    assert set(found) <= set(values.tolist())
    assert np.mean(values <= found.median) >= 0.5
    assert np.mean(values >= found.median) >= 0.5


def test_what_most_runs_never_reach_is_never_reached():
    assert Quartiles.of([1.0, np.inf, np.inf]).told() == "never (1 to never)"
    assert Quartiles.of([np.inf]).told() == "never"
    assert Quartiles.of([2.0, 2.0]).told() == "2"


def test_trajevo_comes_first_and_is_told_to_be_behind_where_it_is():
    rows = rows_of(results(*SLOW, *QUICK, *OURS))
    assert [row.rival for row in rows] == ["trajevo", "quick", "slow"]
    assert rows[0].said == "behind quick"
    assert row_of("trajevo", *SLOW, *OURS).said == "ahead"
    assert row_of("trajevo", *OURS).said == ""
    assert "behind quick" in markdown(results(*QUICK, *OURS))


def test_times_are_told_over_those_of_trajevo_to_what_both_reach():
    assert row_of("quick", *QUICK, *OURS).over == pytest.approx(0.1)
    assert row_of("slow", *SLOW, *OURS).over == pytest.approx(10.0), "to 95 %, as it never reaches 99 %"
    assert row_of("trajevo", *QUICK, *OURS).over is None


def test_nobody_is_behind_what_breaks_limits():
    broken = [run("quick", seed, 0.01, 0.1, violation=0.02) for seed in range(1, 6)]
    assert row_of("trajevo", *broken, *OURS).said == ""
    assert row_of("trajevo", *broken, *SLOW, *OURS).said == "ahead"
    told = row_of("quick", *broken, *OURS)
    assert told.said == "breaks limits between its samples"
    assert cells_of(told)[6] == "2"


def test_trajevo_is_not_ahead_where_its_own_motions_break_limits():
    broken = [one.model_copy(update={"violation": 0.02}) for one in OURS]
    assert row_of("trajevo", *broken, *SLOW).said == "breaks limits between its samples"


def test_one_member_that_breaks_a_limit_is_enough():
    runs = [run("quick", seed, 0.01, 0.1, violation=0.002 if seed == 3 else -0.1) for seed in range(1, 6)]
    assert row_of("quick", *runs).violation == 0.002
    assert not row_of("quick", *runs).sound


def test_rivals_without_a_score_say_why():
    bare = {"X": (), "F": (), "objectives": (), "units": (), "times": {}, "share": 0.0, "violation": None}
    absent = run("absent", 1, None, None, **bare | {"end": "not installed", "said": "not installed: pip install it"})
    unfit = run("unfit", 1, None, None, **bare | {"end": "not stated", "said": "the problem is no fixed path"})
    barren = run("barren", 1, None, None, share=0.0, violation=None, X=(), F=())
    text = markdown(results(*OURS, absent, unfit, barren))
    assert "| arm | absent | 0 |  |  |  |  |  | not installed: pip install it |" in text
    assert "unfit: no row for arm: the problem is no fixed path" in text
    assert "found nothing that keeps the limits" in text
    assert row_of("trajevo", *OURS, absent, unfit, barren).said == ""


def test_the_csv_has_the_numbers_of_the_rows(tmp_path):
    found = results(*OURS, *SLOW)
    read = list(csv.DictReader(io.StringIO(comma_separated(found))))
    assert [line["rival"] for line in read] == ["trajevo", "slow"]
    assert float(read[0]["time to 99 % [s] median"]) == 3.0
    assert read[1]["time to 99 % [s] median"] == ""
    assert float(read[1]["share of the best known [%] median"]) == 98.0
    files = write_table(found, tmp_path / "new")
    assert files[0].read_bytes().decode() == comma_separated(found)
    assert files[1].read_text() == markdown(found)


def test_the_same_results_differ_in_nothing():
    found = results(*OURS, *QUICK)
    assert {one.verdict for one in compared(found, found)} == {"within the quartiles"}
    assert {one.ratio for one in compared(found, found)} == {1.0}
    assert unlike(found, found) == ()


def test_what_differs_by_more_than_its_runs_is_told():
    faster = [run("trajevo", seed, 0.01 * seed, None, share=0.98) for seed in range(1, 6)]
    changes = {one.measure: one for one in compared(results(*OURS), results(*faster))}
    assert changes["time to 95 % [s]"].verdict == "faster"
    assert changes["time to 95 % [s]"].ratio == pytest.approx(0.1)
    assert changes["time to 99 % [s]"].verdict == "slower"
    assert changes["time to 99 % [s]"].ratio is None
    assert changes["share"].verdict == "worse"
    back = {one.measure: one.verdict for one in compared(results(*faster), results(*OURS))}
    assert back == {"time to 95 % [s]": "slower", "time to 99 % [s]": "faster", "share": "better"}


def test_other_machines_and_budgets_are_told():
    elsewhere = Machine(processor="another", cores=8, system="Linux")
    other = results(*(one.model_copy(update={"machine": elsewhere, "budget": 20.0}) for one in OURS))
    first, second = unlike(results(*OURS), other)
    assert first == "measured on a processor and on another: times do not compare"
    assert second == "runs had 10 s of CPU time and 20 s: shares at the end do not compare"


def test_results_without_anything_in_common_are_refused():
    with pytest.raises(InvalidInputError, match="the two files have no rival on a problem in common"):
        compared(results(*OURS), results(*QUICK))


def test_another_machine_is_compared_by_its_yardstick():
    slow = Machine(processor="another", cores=4, system="Linux")
    here = [run("trajevo", seed, 0.1 * seed, 1.0 * seed, yardstick=0.01) for seed in range(1, 6)]
    there = [run("trajevo", seed, 0.3 * seed, 3.0 * seed, yardstick=0.03, machine=slow) for seed in range(1, 6)]
    assert pace(results(*here), results(*there)) == pytest.approx([1.0 / 3.0] * 3)
    assert {one.verdict for one in compared(results(*here), results(*there))} == {"within the quartiles"}
    for one in compared(results(*here), results(*there)):
        np.testing.assert_allclose(one.after, one.before)
    (told,) = unlike(results(*here), results(*there))
    assert told == "by the yardstick, times after are multiplied by 0.333 to be those of the machine before"
    # Without a yardstick nothing is taken out.
    unknown = results(*(run("trajevo", seed, 0.3 * seed, 3.0 * seed) for seed in range(1, 6)))
    assert pace(results(*here), unknown) is None
    assert {one.ratio for one in compared(results(*here), unknown)} >= {3.0}


def test_times_are_known_no_better_than_the_pace_of_the_machine():
    def runs(factor, sticks):
        made = [run("trajevo", k, factor, 2.0 * factor, yardstick=sticks[k - 1]) for k in range(1, 6)]
        return results(*made)

    def verdicts(factor, sticks):
        changes = compared(runs(1.0, sticks), runs(factor, sticks))
        return {one.verdict for one in changes if one.measure != "share"}

    steady, unsteady = [0.01] * 5, [0.0096, 0.0098, 0.01, 0.0104, 0.012]
    assert pace(runs(1.0, unsteady), runs(1.0, unsteady)) == pytest.approx([0.0098 / 0.0104, 1.0, 0.0104 / 0.0098])
    assert verdicts(1.05, steady) == {"slower"}
    assert verdicts(1.05, unsteady) == {"within the quartiles"}
    assert verdicts(1.1, unsteady) == {"slower"}
    assert verdicts(0.95, steady) == {"faster"}
    assert verdicts(0.95, unsteady) == {"within the quartiles"}
    (told,) = unlike(runs(1.0, unsteady), runs(1.0, unsteady))
    assert "times after are multiplied by 1 (0.942 to 1.06)" in told


def test_what_is_published_tells_the_same_table_in_less():
    bare = {"X": (), "F": (), "objectives": (), "units": (), "times": {}, "share": 0.0, "violation": None}
    unfit = [run("unfit", k, None, None, **bare | {"end": "not stated", "said": "no path"}) for k in range(1, 6)]
    whole = results(*OURS, *SLOW, *unfit)
    short = whole.brief_ones()
    assert rows_of(short) == rows_of(whole)
    assert [run.seed for run in short.runs if run.rival == "unfit"] == [1]
    assert len(short.model_dump_json()) < len(whole.model_dump_json())


def test_what_is_published_has_a_name(tmp_path, monkeypatch):
    monkeypatch.setattr(record, "bench_folder", lambda: tmp_path)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InvalidInputError, match=r"published\.json: no such file"):
        BenchResults.load("published")
    whole = results(*OURS)
    whole.save(tmp_path / "published.json")
    assert BenchResults.load("published") == whole
