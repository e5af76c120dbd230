"""The built wheel holds what a user needs, data files and entry points included."""

import subprocess
import sys
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_a_wheel_solves_a_problem_away_from_the_checkout(tmp_path):
    build = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(tmp_path), str(ROOT)]
    subprocess.run(build, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    site = tmp_path / "site"
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        archive.extractall(site)
    for expected in (
        "trajevo/py.typed",
        "trajevo/report.html",
        "trajevo/motion.schema.json",
        "trajevo/task.toml",
        "problems/tasks/xarm7_obstacle.toml",
        "problems/py.typed",
        "robots/pointing_mechanism/pointing_mechanism.urdf",
        "robots/pointing_mechanism/robot.toml",
        "robots/pointing_mechanism/SOURCE.md",
        "robots/feed_drive/robot.toml",
        "problems/geminism.dat",
    ):
        assert expected in names
    assert not any(name.startswith("tests/") for name in names)
    script = (
        "import trajevo, problems; from trajevo import load_problem, optimise;"
        "front = optimise(load_problem('pointing'), seed=1, generations=2, population=20, progress=False);"
        "print(trajevo.__file__, trajevo.problems.__file__, len(front.F))"
    )
    result = subprocess.run(
        [sys.executable, "-c", script],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
        env={"PYTHONPATH": str(site)},
    )
    assert result.stdout.count(str(site)) == 2
