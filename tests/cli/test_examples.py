from tests.helpers import UNDRAWN, trajevo
from trajevo.formulation.examples import list_examples


def test_examples_are_listed_and_copied(tmp_path):
    listed = trajevo("examples").stdout
    for name, example in list_examples().items():
        assert f"{name} " in listed
        assert example.summary[:20] in listed
    copied = trajevo("examples", "hybrid_manipulator", "mine", cwd=tmp_path)
    files = "mine/hybrid_manipulator.toml, mine/hybrid_points.csv"
    assert copied.stdout == f"written: {files}; next: trajevo solve mine/hybrid_manipulator.toml\n"
    notebook = trajevo("examples", "01_first_front", cwd=tmp_path)
    assert notebook.stdout == "written: 01_first_front.ipynb; next: jupyter lab 01_first_front.ipynb\n"
    again = trajevo("examples", "01_first_front", cwd=tmp_path)
    assert again.returncode == 2
    assert again.stderr == "error: 01_first_front.ipynb: exists already; choose another folder\n"


def test_a_worked_task_is_solved_by_its_name(tmp_path):
    small = ("--generations", 1, "--population", 4, "--no-polish", "--quiet")
    refused = trajevo("solve", "xarm7_obstacle", "--payload", 2.0, *small, cwd=tmp_path)
    assert "error: --payload: a task says this in its file" in refused.stderr
    assert not any(tmp_path.iterdir())
    solved = trajevo("solve", "ur5_pick_and_place", *small, *UNDRAWN, cwd=tmp_path)
    assert solved.returncode == 0, solved.stderr
    assert (tmp_path / "runs" / "ur5_pick_and_place" / "front.json").is_file()


def test_a_name_that_is_nearly_right_is_told(tmp_path):
    for command, meant in (
        (("solve", "ur5_pick_place"), "ur5_pick_and_place"),
        (("study", "run", "hybrid_payload"), "hybrid_payloads"),
        (("examples", "first_front"), "01_first_front"),
        (("check-robot", "puma_560"), "puma560"),
    ):
        told = trajevo(*command, cwd=tmp_path)
        assert told.returncode == 2
        assert told.stderr.endswith(f"; did you mean {meant!r}?\n"), told.stderr
    assert not any(tmp_path.iterdir())
