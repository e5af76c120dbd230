"""`trajevo choose-robot` as a user meets it: tables, files, exit codes, and what is said of mistakes."""

import json

from tests.helpers import trajevo

SMALL = ("--generations", 3, "--population", 12, "--no-polish", "--no-payload", "--quiet")


def test_who_can_do_it_is_told_without_a_search(tmp_path):
    told = trajevo("choose-robot", "which_robot", "--only-check", cwd=tmp_path)
    assert told.returncode == 0, told.stderr
    for name in ("ur5", "ur10", "panda", "xarm7", "z1"):
        assert f"\n{name} " in told.stdout
    assert "misses point 0 by 78.5 mm" in told.stdout
    assert not any(tmp_path.iterdir())
    none = trajevo("choose-robot", "which_robot", "--robots", "z1", "--only-check", cwd=tmp_path)
    assert none.returncode == 3


def test_a_choice_is_printed_and_written(tmp_path):
    told = trajevo("choose-robot", "which_robot", "--robots", "ur5, z1", *SMALL, cwd=tmp_path)
    assert told.returncode == 0, told.stderr
    assert "z1 cannot do it: misses point 0 by" in told.stdout
    assert "least price: ur5, 24000 EUR" in told.stdout
    folder = tmp_path / "runs" / "which_robot"
    written = json.loads((folder / "choice.json").read_text(encoding="utf-8"))
    assert [one["state"] for one in written["robots"]] == ["best", "impossible"]
    *_, last = told.stdout.splitlines()
    assert last == "next: trajevo show runs/which_robot/cells/robot=ur5,repeat=01"
    shown = trajevo("show", "runs/which_robot/cells/robot=ur5,repeat=01", cwd=tmp_path)
    assert shown.returncode == 0, shown.stderr


def test_nobody_can_do_it(tmp_path):
    told = trajevo("choose-robot", "which_robot", "--robots", "z1", *SMALL, cwd=tmp_path)
    assert told.returncode == 3
    assert "no robot can do the task" in told.stdout
    assert {file.name for file in (tmp_path / "runs" / "which_robot").iterdir()} == {
        "robots.csv",
        "front.csv",
        "choice.json",
    }


def test_a_catalogue_is_given_by_its_folder(tmp_path):
    (tmp_path / "arms").mkdir()
    (tmp_path / "arms" / "catalogue.toml").write_text('[[robot]]\nname = "short"\npath = "z1"\n', encoding="utf-8")
    told = trajevo("choose-robot", "ur5_pick_and_place", "--robots", "arms", "--only-check", cwd=tmp_path)
    assert (told.returncode, told.stderr) == (3, "")
    assert "short  cannot do it  reach" in told.stdout


def test_mistakes(tmp_path):
    for arguments, says in (
        (("--robots", "ur6"), "error: robots: ur6: unknown robot 'ur6'; did you mean 'ur5'"),
        (("--robots", ","), "error: --robots: expected names and files of robots with commas between them"),
        (
            ("--robots", "arms/"),
            "error: robots: expected a list of robots, or a folder with catalogue.toml, got arms/: no ",
        ),
        (("--within", "-1"), "error: within: expected a positive time [s], got -1.0"),
        (("--dask", "--start-method", "fork"), "error: --start-method: Dask starts its workers itself"),
        (("--population", "1"), "error: --population"),
    ):
        told = trajevo("choose-robot", "which_robot", *arguments, cwd=tmp_path)
        assert told.returncode == 2, arguments
        assert told.stderr.startswith(says), told.stderr
    solved = trajevo("solve", "which_robot", cwd=tmp_path)
    assert solved.returncode == 2
    assert "robots: expected one robot to plan for, got a choice; trajevo choose-robot" in solved.stderr
    copied = trajevo("examples", "which_robot", "mine", cwd=tmp_path)
    assert copied.stdout.endswith("next: trajevo choose-robot mine/which_robot.toml\n")
