import json
import re
from dataclasses import replace
from pathlib import Path

import netCDF4
import numpy as np
import pytest
import xarray as xr

from tests.exporters.test_export import read
from tests.helpers import mostly_long, small_problem
from trajevo import Front, load_robot, optimise
from trajevo.capacity.payload_time import max_payload_problem
from trajevo.dynamics.inverse_dynamics import Dynamics
from trajevo.exporters import netcdf as module
from trajevo.exporters.export import export
from trajevo.exporters.netcdf import dataset
from trajevo.formulation.objectives import Objective, summed_rms_jerk, total_time
from trajevo.problems import HybridManipulator, PointingMechanism, TimeJerkReparameterisation, ViaPointProblem
from trajevo.trajectory.batch import DERIVATIVES

SMALL = {"seed": 1, "generations": 8, "population": 20, "progress": False}
JERK = Objective("jerk", "rad/s^3", "test", summed_rms_jerk)
LABELS = ("joint_name", "joint_unit", "constraint_name")

PROBLEMS = {
    "pointing": PointingMechanism,
    "hybrid": lambda: HybridManipulator(payload=10.0),
    "reparam": lambda: TimeJerkReparameterisation(path="s"),
    "ur5": lambda: ViaPointProblem(
        robot=load_robot("ur5", tool="tool0", limits={"acceleration": 12.0, "jerk": "inf"}),
        points=[[0.0, -1.0, 1.0, 0.0, 0.5, 0.0], [0.4, -1.2, 1.2, 0.2, 0.5, 0.1], [0.8, -1.0, 1.0, 0.0, 0.5, 0.3]],
        objectives=("time", "energy"),
    ),
}


@pytest.fixture(scope="module", params=mostly_long(PROBLEMS, "hybrid", "reparam"))
def front(request) -> Front:
    return optimise(PROBLEMS[request.param](), **SMALL, polish=False)


@pytest.fixture(scope="module")
def file(front, tmp_path_factory) -> Path:
    return export(front, tmp_path_factory.mktemp("netcdf") / "front.nc", format="netcdf")


@pytest.fixture(scope="module")
def pointing() -> Front:
    return optimise(PointingMechanism(), **SMALL, polish=False)


@pytest.fixture(scope="module")
def hybrid() -> Front:
    return optimise(HybridManipulator(payload=10.0), **SMALL, polish=False)


# --- what is inside


def test_the_file_holds_the_dataset(front, file):
    made = dataset(front)
    with xr.open_dataset(file, engine="netcdf4") as back:
        labels = [name for name in LABELS if name in back]
        for name in labels:
            back = back.set_xindex(name)
        xr.testing.assert_identical(back, made)
        assert {name: back[name].dtype for name in made if made[name].dtype.kind != "U"} == dict(made.dtypes)
        assert back.solution.dtype == made.solution.dtype == np.int32
    assert dict(made.sizes)["solution"] == len(front)
    assert dict(made.sizes)["time"] == 201
    assert dict(made.sizes)["joint"] == front.problem.robot.dof


def test_numbers_of_the_front_are_there_to_the_bit(front, file):
    with netCDF4.Dataset(file) as content:
        for kind, values in (("objective", front.F), ("decision", front.X)):
            names = [name for name in content.variables if name.startswith(f"{kind}_")]
            by_name = {getattr(content[name], kind.replace("decision", "variable")): name for name in names}
            entries = front.record.objectives if kind == "objective" else front.record.variables
            assert set(by_name) == {entry.name for entry in entries}
            for column, entry in enumerate(entries):
                variable = content[by_name[entry.name]]
                np.testing.assert_array_equal(variable[:].data, values[:, column])
                assert variable.units == entry.unit
                about = ("reference",) if kind == "objective" else ("lower_bound", "upper_bound")
                assert all(variable.getncattr(name) == getattr(entry, name.split("_")[0]) for name in about)
        np.testing.assert_array_equal(content["constraint_excess"][:].data, front.G)
        assert tuple(content["constraint_name"][:]) == front.record.constraints
        assert content["solution"][:].tolist() == list(range(len(front)))
        for solution in front.choices():
            assert content["solution"].getncattr(solution.rule) == solution.index
        assert json.loads(content.problem) == front.record.model_dump(mode="json")
        assert json.loads(content.run) == front.run.model_dump(mode="json")
        assert (content.seed, content.algorithm, content.title) == ("1", "NSGA2", front.record.title)


def test_motions_are_those_of_every_solution(front, file):
    with netCDF4.Dataset(file) as content:
        instant, share = content["instant"][:].data, content["time"][:].data
        assert (share[0], share[-1], np.ptp(np.diff(share)) < 1e-15) == (0.0, 1.0, True)
        for row in (0, len(front) // 2, len(front) - 1):
            solution = front.pick(row)
            trajectory = solution.trajectory
            np.testing.assert_allclose(instant[row], share * trajectory.duration[0], rtol=1e-14)
            assert content["duration"][row] == instant[row, -1]
            for order, name in enumerate(DERIVATIVES):
                expected = trajectory.evaluate(instant[row], order)[0]
                scale = np.abs(expected).max()
                np.testing.assert_allclose(content[name][row].data, expected, rtol=1e-11, atol=1e-11 * scale)


def test_effort_is_that_of_the_csv(front, tmp_path):
    solution = front.knee()
    step = float(solution.trajectory.duration[0]) / 50.0
    _, headers, table = read(export(solution, tmp_path / "knee.csv", format="csv", step=step))
    with netCDF4.Dataset(export(solution, tmp_path / "knee.nc", format="netcdf", step=step)) as content:
        np.testing.assert_allclose(content["instant"][0].data, table[:, 0], rtol=1e-13)
        columns = [k for k, header in enumerate(headers) if " effort [" in header]
        written = [header.partition("[")[2].rstrip("]") for header in headers if " effort [" in header]
        assert len(columns) == front.problem.robot.dof
        assert content["effort"].units in (", ".join(written), *(written if len(set(written)) == 1 else ()))
        expected, found = table[:, columns], content["effort"][0].data
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_limits_are_those_of_the_robot(front, file):
    limits = front.problem.robot.limits
    with netCDF4.Dataset(file) as content:
        for name, values in vars(limits).items():
            if values is None:  # a direction that agrees with the other one
                assert f"limit_{name}" not in content.variables
                continue
            found = content[f"limit_{ {'lower': 'position_lower', 'upper': 'position_upper'}.get(name, name) }"]
            np.testing.assert_array_equal(found[:].data, values)
            assert (
                found.units
                == content["effort" if name == "effort" else name if name in DERIVATIVES else "position"].units
            )


def test_the_run_is_there_by_generation(front, file):
    history = front.history
    with netCDF4.Dataset(file) as content:
        assert content["generation"][:].tolist() == list(range(1, front.run.generations + 1))
        for name in ("evaluations", "hypervolume", "front_size"):
            assert tuple(content[name][:].tolist()) == getattr(history, name)
        least = [None if np.isnan(value) else value for value in content["least_violation"][:].data.tolist()]
        assert tuple(least) == history.least_violation
        if history.reference_point is not None:
            np.testing.assert_array_equal(content["hypervolume"].reference_point, history.reference_point)


def test_a_generation_without_numbers_is_missing(pointing):
    history = pointing.history.model_copy(update={"least_violation": (None, *pointing.history.least_violation[1:])})
    found = dataset(replace(pointing, history=history), samples=2).least_violation.values
    assert np.isnan(found).tolist() == [True] + [False] * (len(found) - 1)


# --- that others can read it


def test_every_variable_says_what_it_is_in_types_that_all_read(file):
    with netCDF4.Dataset(file) as content:
        assert content.data_model == "NETCDF4_CLASSIC"
        assert not content.groups
        for name, variable in content.variables.items():
            assert re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name)
            assert variable.long_name
            assert str(variable.dtype) in ("float64", "int32", "|S1"), name
            if variable.dtype == "S1":
                assert variable.dimensions[1] == f"{name}_length"
            else:
                assert variable.units, name
            coordinate = name in (*content.dimensions, "instant")
            if variable.dtype == np.float64:
                assert ("_FillValue" in variable.ncattrs()) != coordinate, name
                assert coordinate or np.isnan(variable._FillValue)
        # NUG and CF: a variable named as a dimension is numeric and rises.
        for name in set(content.dimensions) & set(content.variables):
            assert content[name].dimensions == (name,)
            assert (np.diff(content[name][:]) > 0).all()
        assert not any(dimension.isunlimited() for dimension in content.dimensions.values())
        for name in (*DERIVATIVES, "effort"):
            assert content[name].dimensions == ("solution", "time", "joint")
            assert set(content[name].coordinates.split()) == {"instant", "joint_name", "joint_unit"}


def test_h5netcdf_reads_it(hybrid, tmp_path):
    pytest.importorskip("h5netcdf")
    pytest.importorskip("h5py", reason="h5netcdf reads nothing without h5py")
    file = export(hybrid, tmp_path / "front.nc", format="netcdf")
    with xr.open_dataset(file, engine="h5netcdf") as back, xr.open_dataset(file, engine="netcdf4") as same:
        xr.testing.assert_identical(back, same)


def test_units_of_mixed_joints_are_listed_one_by_one(hybrid):
    made = dataset(hybrid.knee(), samples=2)
    assert made.position.units == "m, m, m, rad, rad"
    assert made.jerk.units == "m/s^3, m/s^3, m/s^3, rad/s^3, rad/s^3"
    assert made.effort.units == made.limit_effort.units == "N, N, N, N*m, N*m"
    assert made.joint_unit.values.tolist() == ["m", "m", "m", "rad", "rad"]
    assert "Conventions" not in made.attrs  # a list of units is none that CF knows


def test_conventions_are_named_where_they_are_kept(pointing):
    made = dataset(pointing)
    assert made.Conventions == "CF-1.11"
    assert (made.position.units, made.effort.units) == ("rad", "N*m")
    time = Objective("time", "furlong", "test", total_time)
    odd = optimise(small_problem(objectives=(time, JERK)), **SMALL, polish=False)
    assert "Conventions" not in dataset(odd, samples=2).attrs


def test_names_become_ones_that_every_program_takes():
    names = ("Δ time (s)", "time", "Time", "time_2", "ΔΔ")
    objectives = [Objective(name, "s", f"equation {k}", total_time) for k, name in enumerate(names)]
    front = optimise(small_problem(objectives=(*objectives, JERK)), **SMALL, polish=False)
    made = dataset(front, samples=2)
    found = {name: made[name].objective for name in made if name.startswith("objective_")}
    assert found == {
        "objective_time_s": "Δ time (s)",
        "objective_time": "time",
        "objective_Time_2": "Time",
        "objective_time_2_2": "time_2",
        "objective_unnamed": "ΔΔ",
        "objective_jerk": "jerk",
    }
    assert made.solution.attrs["least_time_2_2"] == front.least("time_2").index


# --- one solution, other samples


def test_one_solution_keeps_its_dimension_and_its_row(pointing):
    knee = pointing.knee()
    made = dataset(knee)
    assert made.position.shape == (1, 201, 2)
    assert made.solution.values.tolist() == [knee.index]
    assert (made.solution.chosen_by, made.solution.reason) == ("knee", knee.reason)
    assert made.solution.knee == knee.index
    whole = dataset(pointing).sel(solution=[knee.index])
    for name in ("position", "effort", "objective_jerk", "decision_dt_1", "constraint_excess"):
        np.testing.assert_allclose(made[name], whole[name], rtol=1e-12, atol=1e-13)


def test_joints_are_found_by_name_and_unit(hybrid):
    made = dataset(hybrid, samples=5)
    assert made.position.sel(joint_unit="m").shape == (len(hybrid), 5, 3)
    np.testing.assert_array_equal(made.position.sel(joint_name="joint_4"), made.position[:, :, 3])


def test_groups_of_solutions_change_nothing(hybrid, monkeypatch):
    whole = dataset(hybrid, samples=11)
    monkeypatch.setattr(module, "_INSTANTS_AT_ONCE", 70)
    xr.testing.assert_allclose(dataset(hybrid, samples=11), whole, rtol=1e-12)


def test_a_step_bounds_the_intervals_of_the_longest_motion(pointing, tmp_path):
    with netCDF4.Dataset(export(pointing, tmp_path / "f.nc", format="netcdf", step=0.3)) as content:
        intervals = np.diff(content["instant"][:], axis=1)
        assert 0.3 - 0.3 / 50 < intervals.max() <= 0.3 * (1.0 + 1e-12)
    with netCDF4.Dataset(export(pointing, tmp_path / "f.nc", format="netcdf", step=1e6)) as content:
        assert content["time"][:].tolist() == [0.0, 1.0]


def test_the_payload_of_every_solution_is_its_own():
    front = optimise(max_payload_problem(HybridManipulator(), (0.0, 10.0)), **SMALL, polish=False)
    made = dataset(front, samples=7)
    assert made.decision_payload.units == "kg"
    assert np.ptp(made.decision_payload.values) > 0.1
    for row in (0, len(front) - 1):
        rollout = front.pick(row).rollout
        states = (rollout.trajectory.evaluate(made.instant.values[row], order) for order in range(3))
        expected = rollout.effort_in(*states)[0]
        np.testing.assert_allclose(made.effort[row], expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_a_robot_without_masses_has_no_effort():
    problem = small_problem()
    model = problem.robot.model.copy()
    for k in range(1, model.njoints):
        model.inertias[k] = model.inertias[0]
    problem.dynamics = Dynamics(replace(problem.robot, model=model))
    made = dataset(optimise(problem, **SMALL, polish=False), samples=3)
    assert "jerk" in made
    assert "effort" not in made


def test_no_constraints_leave_no_variable():
    front = optimise(small_problem(constraints=()), **SMALL, polish=False)
    made = dataset(front, samples=3)
    assert "constraint" not in made.sizes
    assert not [name for name in made.variables if "constraint" in name]


def test_what_is_handed_out_is_read_only(pointing):
    made = dataset(pointing, samples=3)
    for name in ("position", "effort", "objective_time", "limit_velocity", "hypervolume"):
        with pytest.raises(ValueError, match="read-only"):
            made[name].values[:] = 0.0
