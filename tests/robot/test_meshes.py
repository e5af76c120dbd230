"""Collision geometry of strangers: damaged meshes and sizes cost a sentence, not the process."""

import os
import struct

import numpy as np
import pytest

from tests.fuzz.kinds import _COLLISION, LIMITS, PLAIN, URDF, _dae, _obj, _stl, _stl_text
from tests.helpers import mostly_long, refused
from trajevo import TrajevoError, load_robot
from trajevo.formulation.constraints.collision import Collision
from trajevo.formulation.constraints.scene import Scene, Sphere
from trajevo.robot.examine import examine
from trajevo.robot.locate import list_example_robots, robot_source
from trajevo.robot.shapes.meshes import check_mesh, check_solids
from trajevo.robot.urdf.file import read_urdf
from trajevo.robot.urdf.problems import MOST_LINKS

MADE = {"stl": _stl(), "text.stl": _stl_text(), "obj": _obj(), "dae": _dae()}


def distances(folder, geometry):
    (folder / "two.urdf").write_text(URDF % (_COLLISION % geometry))
    robot = load_robot(folder / "two.urdf", limits=LIMITS)
    scene = Scene((Sphere(position=(1.0, 1.0, 1.0), radius=0.1),))
    return Collision(robot, scene).distances(np.zeros((1, 2)))


@pytest.mark.parametrize("ending", MADE)
def test_whole_meshes_are_used(ending, tmp_path):
    (tmp_path / f"m.{ending}").write_bytes(MADE[ending])
    (found,) = distances(tmp_path, f'<mesh filename="{tmp_path}/m.{ending}"/>')
    expected = distances(tmp_path, '<box size="0.000001 0.000001 0.000001"/>')
    assert 0.0 < expected[0, 0] - found[0] < 0.2


@pytest.mark.parametrize(
    ("ending", "old", "new", "says"),
    [
        (
            "stl",
            struct.pack("<f", 0.1),
            struct.pack("<f", np.nan),
            r"vertices, row 1: expected finite .*nan",
        ),
        (
            "stl",
            struct.pack("<f", 0.1),
            struct.pack("<f", np.inf),
            r"vertices, row 1: expected finite .*inf",
        ),
        (
            "stl",
            struct.pack("<f", 0.1),
            struct.pack("<f", 1e30),
            r"vertices, row 1: expected finite .*below 1e\+07",
        ),
        ("stl", struct.pack("<I", 4), struct.pack("<I", 5), "expected an STL of whole triangles, got 284 bytes"),
        ("text.stl", b"vertex 0.1", b"vertex nan", "vertices, row 2: expected finite coordinates"),
        ("text.stl", b"vertex 0.1", b"vertex x", "expected numbers as vertices"),
        ("text.stl", b"vertex 0.1", b"vertx 0.1", "expected an STL of whole triangles"),
        ("obj", b"v 0.1 0 0", b"v nan 0 0", "vertices, row 1: expected finite coordinates"),
        ("obj", b"v 0.1 0 0", b"v 0.1 0", "expected three coordinates of every vertex"),
        ("obj", b"f 1/1/1", b"f 9/1/1", "line 9: expected a face of known vertices, got '9/1/1 3/1/1 2/1/1'"),
        ("obj", b"f 1/1/1", b"f -9/1/1", "line 9: expected a face of known vertices"),
        ("obj", b"f ", b"g ", "expected faces of a mesh, got none"),
        ("dae", b"0 0 0 0.1", b"0 0 0 nan", "numbers, row 3: expected finite coordinates"),
        ("dae", b"<p>0", b"<p>1e9", "<p>: expected whole numbers"),
        ("dae", b'<?xml version="1.0"?>', b'<!DOCTYPE a [<!ENTITY b "c">]>', "expected XML without <!DOCTYPE>"),
    ],
)
def test_damaged_meshes_are_refused_before_any_library_reads_them(ending, old, new, says, tmp_path):
    assert old in MADE[ending]
    file = tmp_path / f"m.{ending}"
    file.write_bytes(MADE[ending].replace(old, new))
    mesh = f'<mesh filename="package://{tmp_path.name}/m.{ending}"/>'
    refused(lambda: distances(tmp_path, mesh), f"m.{ending}: {says}")


FLAT = "expected a solid, got 4 vertices in one plane"


def test_flat_meshes_are_refused(tmp_path):
    square = np.array([[0, 0, 0], [0, 1, 0], [0, 0, 1], [0, 1, 0], [0, 1, 1], [0, 0, 1]], dtype="<f4")
    facets = b"".join(struct.pack("<3f", 1, 0, 0) + part.tobytes() + b"\0\0" for part in (square[:3], square[3:]))
    (tmp_path / "m.stl").write_bytes(bytes(80) + struct.pack("<I", 2) + facets)
    refused(
        lambda: distances(tmp_path, f'<mesh filename="{tmp_path}/m.stl"/>'), "expected a solid, got 4 vertices in one"
    )
    (tmp_path / "m.dae").write_bytes(_dae().replace(b"<matrix>1", b"<matrix>0"))
    refused(
        lambda: distances(tmp_path, f'<mesh filename="{tmp_path}/m.dae"/>'), "expected a solid, got 4 vertices in one"
    )


@pytest.mark.parametrize(
    ("geometry", "says"),
    [
        ('<box size="nan 1 1"/>', "<box>: expected 3 finite numbers as size, got 'nan 1 1'"),
        ('<box size="1 1"/>', "<box>: expected 3 finite numbers as size, got '1 1'"),
        ('<sphere radius="-1"/>', "<sphere>: expected 1 positive numbers .* as radius, got '-1'"),
        ('<cylinder radius="1e300" length="1"/>', "<cylinder>: expected 1 positive numbers .* as radius"),
        ('<mesh filename="MADE.stl" scale="1 0 1"/>', "<mesh>: expected 3 numbers other than 0 .* as scale"),
        ('<mesh filename="MADE.blend"/>', "expected a mesh as .stl, .obj, .dae, got the ending '.blend'"),
        ('<mesh filename="/dev/zero"/>', "expected a mesh as .stl, .obj, .dae, got the ending ''"),
        ('<mesh filename="PIPE.stl"/>', "PIPE.stl: expected a regular file, got a pipe"),
    ],
)
def test_sizes_and_kinds_of_files_are_checked(geometry, says, tmp_path):
    for ending in ("stl", "blend"):
        (tmp_path / f"MADE.{ending}").write_bytes(MADE["stl"])
    os.mkfifo(tmp_path / "PIPE.stl")
    made = geometry.replace("MADE", f"{tmp_path}/MADE").replace("PIPE", f"{tmp_path}/PIPE")
    refused(lambda: distances(tmp_path, made), says)


@pytest.mark.parametrize("old", ["<box", 'size="0.2', 'xyz="0.1 0 0"', "<geometry>"])
def test_collision_geometry_that_would_be_left_out_is_refused(old, tmp_path, capfd):
    assert old in PLAIN.decode()
    (tmp_path / "two.urdf").write_text(
        PLAIN.decode().replace(old, old[:-1] + "\N{RIGHT-TO-LEFT OVERRIDE}" + old[-1], 1)
    )
    with pytest.raises(TrajevoError, match="two.urdf: (link 'l1': collision: |cannot be read as XML)"):
        load_robot(tmp_path / "two.urdf", limits=LIMITS)
    assert capfd.readouterr() == ("", "")


def test_mistakes_in_what_is_not_read_are_not_printed(tmp_path, capfd):
    wrong = '<visual><origin xyz="\N{RIGHT-TO-LEFT OVERRIDE}"/><geometry><cone/></geometry></visual>'
    (tmp_path / "two.urdf").write_text(URDF % wrong)
    assert load_robot(tmp_path / "two.urdf", limits=LIMITS).dof == 2
    assert capfd.readouterr() == ("", "")


def test_the_colours_that_a_mesh_names_are_no_pipe(tmp_path):
    (tmp_path / "m.obj").write_bytes(b"mtllib pipe.mtl\n" + _obj())
    check_mesh(tmp_path / "m.obj")
    os.mkfifo(tmp_path / "pipe.mtl")
    refused(lambda: check_mesh(tmp_path / "m.obj"), "pipe.mtl: expected a regular file, got a pipe")


@pytest.mark.parametrize("name", ["ur5", "panda", "xarm7", "iiwa14", "talos_arm"])
def test_meshes_of_known_robots_pass(name):
    if name not in list_example_robots():
        pytest.skip("not in this version of example-robot-data")
    source = robot_source(name)
    check_solids(read_urdf(source.urdf), source.urdf, source.packages)


def chain(count, kind="revolute"):
    links = "".join(f'<link name="l{i}"/>' for i in range(count))
    joints = "".join(
        f'<joint name="j{i}" type="{kind if i else "revolute"}"><parent link="l{i}"/><child link="l{i + 1}"/>'
        f'<axis xyz="0 0 1"/><limit lower="-1" upper="1" velocity="1" effort="1"/></joint>'
        for i in range(count - 1)
    )
    return f'<robot name="chain">{links}{joints}</robot>'


@pytest.mark.parametrize(
    ("kind", "count"),
    mostly_long([("revolute", 200), ("revolute", 400), ("fixed", 400)], ("revolute", 200), several=True),
)
def test_checks_of_a_long_chain_take_steps_in_proportion_to_it(kind, count, tmp_path):
    """Counted, not timed: function calls of a chain twice as long are twice as many."""
    import cProfile
    import pstats

    calls = []
    for joints in (count, 2 * count):
        (tmp_path / "chain.urdf").write_text(chain(joints, kind))
        profile = cProfile.Profile()
        found = profile.runcall(examine, tmp_path / "chain.urdf")
        assert found.errors == ()
        calls.append(pstats.Stats(profile).total_calls)
    assert calls[1] < 2.3 * calls[0]


def test_robots_of_more_links_than_any_are_refused(tmp_path):
    (tmp_path / "chain.urdf").write_text(chain(MOST_LINKS + 1))
    refused(
        lambda: load_robot(tmp_path / "chain.urdf", limits=LIMITS), f"expected at most {MOST_LINKS} links, got 2001"
    )
    assert examine(tmp_path / "chain.urdf").errors == (
        f"{tmp_path / 'chain.urdf'}: expected at most {MOST_LINKS} links, got 2001",
    )


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"<robot>" + b"<a>" * 3000 + b"</a>" * 3000 + b"</robot>", "expected XML elements at most 100 deep"),
        (
            b'<!DOCTYPE r [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;">]>' + PLAIN[22:],
            "expected XML without <!DOCTYPE>",
        ),
        (b"<robot", "cannot be read as XML"),
        (bytes(2**24 + 1), "expected a file of at most 16 MiB"),
    ],
)
def test_xml_that_could_unpack_to_any_size_is_refused(content, says, tmp_path):
    (tmp_path / "two.urdf").write_bytes(content)
    refused(lambda: load_robot(tmp_path / "two.urdf", limits=LIMITS), says)
    refused(lambda: examine(tmp_path / "two.urdf"), says)
