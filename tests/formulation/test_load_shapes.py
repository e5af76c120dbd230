"""Shapes of loads: they keep the clearance of a scene where they are carried, and nowhere else."""

import json

import numpy as np
import pytest

from tests.helpers import assert_exact_gradients, refused
from trajevo import Load, Passing, Payload, ViaPointProblem, certify, check, load_problem, load_robot, optimise
from trajevo.base.files import opening_robots_only
from trajevo.formulation.constraints.clearance import ProvenClearance
from trajevo.formulation.constraints.scene import Box, Scene, Sphere
from trajevo.solvers.task import load_task

ARM = {"name": "xarm7", "limits": {"acceleration": 14.0, "jerk": 140.0}}
POINTS = np.radians(
    [
        [-40.0, 20.0, 0.0, 60.0, 0.0, 40.0, 0.0],
        [-30.0, 35.0, 0.0, 70.0, 0.0, 35.0, 0.0],
        [0.0, 20.0, 0.0, 60.0, 0.0, 40.0, 0.0],
        [30.0, 35.0, 0.0, 70.0, 0.0, 35.0, 0.0],
        [40.0, 20.0, 0.0, 60.0, 0.0, 40.0, 0.0],
    ]
)
BALL = {"shape": "sphere", "radius": 0.04, "position": [0.01, -0.02, 0.12]}


def made(load, obstacles, **given):
    usual = {"robot": ARM, "points": POINTS, "passing": [Passing(1, dwell=0.2), Passing(3, dwell=0.2)]}
    scene = {"obstacles": obstacles, "clearance": 0.02} | given.pop("more", {})
    limits = {"objectives": ("time", "jerk"), "constraints": ("velocity", "acceleration", "jerk")}
    return ViaPointProblem(payload=[load], scene=scene, **(usual | limits | {"duration_bounds": (0.4, 3.0)} | given))


def vectors(problem, count, seed=0):
    return np.random.default_rng(seed).uniform(problem.xl, problem.xu, (count, problem.n_var))


def tool_at(point):
    position, rotation = load_robot(**ARM).tool_poses(POINTS[point : point + 1])
    return position[0], rotation[0]


def load_below(point, distance):
    """A ball at a distance below the load's ball at a point, both surfaces apart."""
    position, rotation = tool_at(point)
    centre = position + rotation @ np.array(BALL["position"]) - [0.0, 0.0, 0.04 + 0.03 + distance]
    return {"name": "stand", "shape": "sphere", "radius": 0.03, "position": centre.tolist()}


@pytest.fixture(scope="module")
def problem():
    return made({"mass": 1.0, "from": 1, "to": 3, "shape": BALL}, [load_below(2, 0.05)])


def of_loads(problem):
    """The clearances of loads, and their columns of G."""
    first, found = 0, []
    for constraint in problem.constraints:
        columns = slice(first, first + len(constraint.names))
        first = columns.stop
        if isinstance(constraint.function, ProvenClearance) and constraint.function.part is not None:
            found.append((constraint.function, columns))
    return found


def distances(problem, x, segments, count=800):
    """Distances of the ball from the obstacle in closed form, densely on some segments, shape (B,) [m]."""
    trajectory, obstacle = problem.decode(x), problem.settings["scene"]["obstacles"][0]
    q = trajectory.at_shares(np.linspace(0.0, 1.0, count), 0).reshape(len(x), -1, count, 7)[:, segments]
    found = []
    for row in q:
        position, rotation = problem.robot.tool_poses(row.reshape(-1, 7))
        centre = position + rotation @ np.array(BALL["position"])
        found.append(np.linalg.norm(centre - obstacle["position"], axis=1).min() - 0.04 - obstacle["radius"])
    return np.array(found)


def test_a_load_keeps_its_clearance_where_it_is_carried_proven_against_the_closed_form(problem):
    assert [name for name in problem.constraint_names if "payload" in name] == ["clearance of payload 0 to obstacles"]
    ((clearance, columns),) = of_loads(problem)
    assert clearance.part == (2, 3)
    x = vectors(problem, 8)
    closed, G = distances(problem, x, [2, 3]), problem.evaluate(x, return_values_of=["G"])[:, columns][:, 0]
    found = 0.02 - 0.02 * G
    kept = G <= 0.0
    assert kept.any()
    assert (found[kept] <= closed[kept] + 1e-5).all()
    assert (found[kept] >= 0.02).all()
    assert (closed[~kept] < 0.02 + 1.1e-3).all()
    closest = clearance.closest(problem.decode(x))[0]
    np.testing.assert_allclose(closest.sampled, closed, atol=1e-3)
    assert (closest.proven <= closed + 1e-9).all()


def test_what_is_not_carried_yet_may_be_where_it_likes():
    obstacle = load_below(0, -0.02)
    early = made({"mass": 1.0, "to": 1, "shape": BALL}, [obstacle])
    late = made({"mass": 1.0, "from": 1, "to": 3, "shape": BALL}, [obstacle])
    for task, broken in ((early, True), (late, False)):
        ((_, columns),) = of_loads(task)
        G = task.evaluate(vectors(task, 4), return_values_of=["G"])[:, columns]
        assert (G > 0.0).all() == broken
        told = [finding for finding in check(task).findings if "payload 0 and stand" in finding.sentence]
        assert [finding.point for finding in told] == ([0] if broken else [])


def test_the_instant_of_the_closest_approach_is_that_of_the_whole_motion(problem):
    ((clearance, _),) = of_loads(problem)
    x = vectors(problem, 5)
    trajectory = problem.decode(x)
    closest = clearance.closest(trajectory)[0]
    for row, t in enumerate(closest.instant):
        q = trajectory[row].evaluate(np.array([t]))[0]
        position, rotation = problem.robot.tool_poses(q)
        centre = position[0] + rotation[0] @ np.array(BALL["position"])
        obstacle = problem.settings["scene"]["obstacles"][0]
        away = np.linalg.norm(centre - obstacle["position"]) - 0.04 - obstacle["radius"]
        assert away == pytest.approx(closest.sampled[row], abs=1e-5)


def test_robots_and_loads_of_the_same_motion_are_judged_apart(problem):
    alone = ViaPointProblem(**(problem.settings | {"payload": 1.0}))
    x = vectors(problem, 6)
    G, without = problem.evaluate(x, return_values_of=["G"]), alone.evaluate(x, return_values_of=["G"])
    assert problem.constraint_names[: alone.n_ieq_constr] == alone.constraint_names
    assert (G[:, : alone.n_ieq_constr] == without).all()


def test_a_motion_has_the_same_digits_alone_and_among_others(problem):
    x = vectors(problem, 5)
    G = problem.evaluate(x, return_values_of=["G"])
    assert (problem.evaluate(x[3:4], return_values_of=["G"])[0] == G[3]).all()


def test_gradients_are_exact():
    task = made({"mass": 1.0, "from": 1, "to": 3, "shape": BALL}, [load_below(2, -0.01)])
    assert_exact_gradients(task, vectors(task, 3))
    assert_exact_gradients(task.in_terms(), vectors(task, 2))


def test_a_search_takes_the_load_around_what_the_robot_alone_would_miss():
    obstacle = load_below(2, -0.03)
    moving = [{"point": 2, "joints": np.radians([0.0, 25.0, 0.0, 25.0, 0.0, 25.0, 0.0]).tolist()}]
    settings = {"population": 16, "generations": 6, "polish": False, "progress": False}
    task = made({"mass": 1.0, "from": 1, "to": 3, "shape": BALL}, [obstacle], moving=moving)
    front = optimise(task, seed=1, **settings)
    best = front.pick("0")
    assert distances(task, best.x[None], [2, 3])[0] >= 0.02
    certificate = certify(best)
    assert certificate.proven
    row = next(row for row in certificate.rows if row.quantity == "clearance of payload 0 to obstacles")
    assert row.between == ("payload 0", "stand")
    assert row.bound >= 0.02


def test_a_load_stays_away_from_the_robot_and_may_touch_what_it_stands_on():
    table = {"name": "table", "shape": "box", "size": [0.1, 0.1, 0.02]}
    place = np.array(load_below(1, 0.0)["position"]) + np.array([0.0, 0.0, 0.03 - 0.01])
    table |= {"position": place.tolist()}
    load = {"mass": 1.0, "from": 1, "to": 3, "shape": BALL}
    standing = made(load, [table])
    assert any("payload 0 and table" in finding.sentence for finding in check(standing).impossible)
    free = made(load | {"touches": ["table"]}, [table, load_below(2, 0.05)], more={"self_clearance": 0.005})
    assert not [finding for finding in check(free).impossible if "payload 0" in finding.sentence]
    ((clearance, _),) = of_loads(free)
    pairs = {(pair.first, pair.second) for pair in clearance.collision.pairs if not pair.itself}
    assert pairs == {("payload 0", "stand")}
    G = free.evaluate(vectors(free, 3), return_values_of=["G"])
    assert np.isfinite(G).all()
    itself = [pair for pair in clearance.collision.pairs if pair.itself]
    assert itself
    assert {pair.first for pair in itself} == {"payload 0"}
    assert "clearance of payload 0 to the robot" in free.constraint_names


def test_settings_survive_json(problem):
    again = ViaPointProblem(**json.loads(json.dumps(problem.settings)))
    assert again.settings == problem.settings
    x = vectors(problem, 2)
    assert (again.evaluate(x, return_values_of=["G"]) == problem.evaluate(x, return_values_of=["G"])).all()


def test_shapes_are_in_their_centres_of_mass_unless_they_say_where():
    ball = {"shape": "sphere", "radius": 0.03}
    task = made({"mass": 1.0, "com": [0.0, 0.01, 0.1], "shape": ball}, [load_below(2, 0.1)])
    assert task.settings["payload"][0]["shape"]["position"] == [0.0, 0.01, 0.1]
    solid = Load(Payload(1.0), 1, 3, shape=Sphere(radius=0.03, position=(0.0, 0.0, 0.1), name="part"))
    assert "clearance of part to obstacles" in made(solid, [load_below(2, 0.1)]).constraint_names


def stl_of_box(file, size, scale=1.0):
    """A box as an STL in text, with its middle in the origin."""
    corners = 0.5 / scale * np.array(size) * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    lines = ["solid box"]
    for a, b, c, d in sides:
        for triangle in ((a, b, c), (a, c, d)):
            vertices = [f"vertex {' '.join(map(repr, corners[k].tolist()))}" for k in triangle]
            lines += ["facet normal 0 0 0", "outer loop", *vertices, "endloop", "endfacet"]
    file.write_text("\n".join([*lines, "endsolid box"]), encoding="utf-8")
    return file


def test_a_mesh_of_a_box_is_that_box_as_a_load_and_as_an_obstacle(tmp_path):
    size = [0.1, 0.06, 0.08]
    mesh = {"shape": "mesh", "file": str(stl_of_box(tmp_path / "box.stl", size, 0.001)), "scale": 0.001}
    box = {"shape": "box", "size": size}
    place = {"position": [0.0, 0.02, 0.1], "rpy": [0.3, 0.0, 0.1]}
    away = load_below(2, 0.02)["position"]
    G, apart = [], []
    for shape in (box, mesh):
        task = made(
            {"mass": 1.0, "from": 1, "to": 3, "shape": shape | place},
            [{"name": "block", "position": away, "rpy": [0.1, 0.4, 0.0]} | shape],
        )
        x = vectors(task, 5)
        columns = [k for k, name in enumerate(task.constraint_names) if name.startswith("clearance")]
        assert len(columns) == 2
        G.append(task.evaluate(x, return_values_of=["G"])[:, columns])
        apart.append(of_loads(task)[0][0].collision.distances(task.decode(x).at_shares(np.linspace(0.0, 1.0, 9), 0)[0]))
    np.testing.assert_allclose(apart[1], apart[0], atol=2e-6)
    assert (G[0] <= 0.0).any()
    np.testing.assert_allclose(G[1], G[0], atol=0.06)  # a millimetre of the clearance of 20, as bounds are that near
    found = [of_loads(task)[0][0].closest(task.decode(x))[0].sampled]
    assert_exact_gradients(task, x)
    again = ViaPointProblem(**json.loads(json.dumps(task.settings)))
    np.testing.assert_array_equal(of_loads(again)[0][0].closest(again.decode(x))[0].sampled, found[0])


def test_meshes_that_cannot_be_used_are_refused_with_their_file(tmp_path):
    flat = tmp_path / "flat.obj"
    flat.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 4 3\n", encoding="utf-8")
    large = stl_of_box(tmp_path / "large.stl", [200.0, 100.0, 100.0])
    load = {"mass": 1.0, "from": 1, "to": 3}
    for shape, sentence in (
        ({"shape": "mesh"}, "payload.0.shape: file: expected the path of a mesh, got none"),
        ({"shape": "mesh", "file": 3}, "payload.0.shape: file: expected the path of a mesh, got 3"),
        ({"shape": "mesh", "file": str(tmp_path / "none.stl")}, "payload.0.shape: file: .*none.stl: cannot be read"),
        (
            {"shape": "mesh", "file": "part.step"},
            "payload.0.shape: file: part.step: expected a mesh as .stl, .obj, .dae",
        ),
        ({"shape": "mesh", "file": str(large)}, "payload.0.shape: scale: .*looks as if its file were in mm"),
        ({"shape": "mesh", "file": str(large), "scale": 0.0}, "payload.0.shape: scale: expected a number above 0"),
        ({"shape": "mesh", "file": str(flat)}, "flat.obj: expected a solid, got 4 corners in one plane"),
    ):
        refused(lambda shape=shape: made(load | {"shape": shape}, [load_below(2, 0.1)]), sentence)


def test_files_of_meshes_are_beside_the_task(tmp_path):
    (tmp_path / "parts").mkdir()
    stl_of_box(tmp_path / "parts" / "box.stl", [0.1, 0.08, 0.06])
    mesh = 'shape = "mesh"\nfile = "parts/box.stl"'
    text = TASK.replace('shape = "box"\nsize = [0.1, 0.08, 0.06]', mesh)
    text = text.replace('shape = "box", size = [0.1, 0.1, 0.1]', 'shape = "mesh", file = "parts/box.stl"')
    assert text.count("parts/box.stl") == 2
    (tmp_path / "task.toml").write_text(text, encoding="utf-8")
    problem = load_task(tmp_path / "task.toml").problem
    (tmp_path / "parts" / "box.stl").unlink()
    settings = json.loads(json.dumps(problem.settings))
    for solid in (settings["scene"]["obstacles"][0], settings["payload"][0]["shape"]):
        assert solid["shape"] == "hull", "runs need no file"
        np.testing.assert_allclose(np.ptp(solid["points"], axis=0), [0.1, 0.08, 0.06], atol=1e-7)
        assert len(solid["points"]) == 8
    again, x = load_problem("via-points", **settings), 0.5 * (problem.xl + problem.xu)[None]
    np.testing.assert_array_equal(again.evaluate(x)[1], problem.evaluate(x)[1])
    mesh = {"shape": "mesh", "file": "box.stl", "position": [0.5, 0.0, 0.0]}
    with opening_robots_only("the data"):
        refused(
            lambda: Scene.of({"obstacles": [mesh]}), "file: the data names a file to read, 'box.stl'; the data of a run"
        )


def test_a_shape_without_a_scene_is_told_to_be_of_no_effect(problem):
    blind = ViaPointProblem(**(problem.settings | {"scene": None}))
    said = "payload.0.shape: of no effect, as there is no scene whose clearance it could keep"
    assert said in blind.notes
    assert said not in problem.notes


TASK = """
duration_bounds = [0.4, 3.0]
points = [
  [-0.7, 0.35, 0.0, 1.0, 0.0, 0.7, 0.0],
  [-0.5, 0.6, 0.0, 1.2, 0.0, 0.6, 0.0],
  [0.5, 0.6, 0.0, 1.2, 0.0, 0.6, 0.0],
]
robot = "xarm7"

[limits]
acceleration = 14.0
jerk = 140.0

[constraints]
limits = ["velocity"]

[scene]
clearance = 0.02
obstacles = [{ name = "table", shape = "box", size = [0.1, 0.1, 0.1], position = [0.5, 0.0, 0.05] }]

[[payload]]
mass = 1.0
from = 1
touches = ["table"]

[payload.shape]
shape = "box"
size = [0.1, 0.08, 0.06]
position = [0.0, 0.0, 0.1]

[[payload]]
mass = 0.5
shape = { shape = "cylinder", radius = 0.02, length = 0.1, position = [0.0, 0.0, 0.05] }
"""


def test_tasks_give_loads_a_shape(tmp_path):
    file = tmp_path / "task.toml"
    file.write_text(TASK, encoding="utf-8")
    problem = load_task(file).problem
    box = problem.dynamics.schedule.loads[0]
    assert box.shape == Box(size=(0.1, 0.08, 0.06), position=(0.0, 0.0, 0.1), name="payload 0")
    assert box.touches == ("table",)
    assert [name for name in problem.constraint_names if "payload" in name] == ["clearance of payload 1 to obstacles"]


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("radius = 0.02, ", "", "payload.1.shape: radius: expected a value"),
        ("radius = 0.02", "radius = -0.02", "payload.1.shape: radius: expected a number above 0"),
        ('shape = "cylinder"', 'shape = "cone"', "cone.*known: box, capsule, cylinder, hull, mesh, plane, sphere"),
        ("radius = 0.02", "radius = 20.0", "payload.1.shape: expected a solid within 5 m of the tool's origin"),
        ("radius = 0.02", "radios = 0.02", "payload.1.shape: radios: unknown key"),
        ('touches = ["table"]', 'touches = ["tabel"]', "payload.0.touches: unknown obstacle 'tabel'; known: table"),
        ('touches = ["table"]', 'touches = "table"', "payload.0.touches: expected a list"),
        ("[payload.shape]", "[payload.shapes]", "payload.0.shapes: unknown key"),
    ],
)
def test_mistakes_in_shapes_are_told_with_their_key(tmp_path, old, new, sentence):
    file = tmp_path / "task.toml"
    assert old in TASK
    file.write_text(TASK.replace(old, new), encoding="utf-8")
    refused(lambda: load_task(file), sentence)
