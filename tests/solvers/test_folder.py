"""Folders of runs that are damaged, foreign or taken."""

import os
import pickle
import subprocess
import sys

import numpy as np
import pytest

from tests.helpers import refused
from trajevo import Front, optimise
from trajevo.problems import PointingMechanism
from trajevo.solvers.run.folder import RunFolder
from trajevo.solvers.run.runs import read_run, resume

SMALL = {"generations": 12, "population": 20, "progress": False}


class _Payload:
    def __reduce__(self):
        return os.system, ("touch unpickled",)


def _damage(folder, what):
    manifest, checkpoint = folder / "manifest.json", folder / "checkpoint.npz"
    block = min((folder / "blocks").iterdir())
    if what == "nothing":
        return
    if what == "no manifest":
        manifest.unlink()
    elif what == "manifest of the future":
        manifest.write_text(manifest.read_text().replace('"version": 1,', '"version": 9,', 1))
    elif what == "manifest cut off":
        manifest.write_text(manifest.read_text()[:100])
    elif what == "checkpoint cut off":
        checkpoint.write_bytes(checkpoint.read_bytes()[:-100])
    elif what == "pickled checkpoint":
        checkpoint.write_bytes(pickle.dumps(_Payload()))
    elif what == "objects in a block":
        np.savez(block, X=np.array([_Payload()], dtype=object), allow_pickle=True)
    elif what == "no block":
        block.unlink()
    elif what == "another algorithm":
        manifest.write_text(manifest.read_text().replace('"name": "ArrayNSGA2"', '"name": "os.system"'))
    elif what == "wrong state":
        arrays = dict(np.load(checkpoint))
        np.savez(checkpoint, **arrays | {"solver.X": np.zeros((3, 1))})
    elif what == "no story":
        arrays = dict(np.load(checkpoint))
        arrays.pop("story")
        np.savez(checkpoint, **arrays)


@pytest.mark.parametrize(
    ("what", "says"),
    [
        ("no manifest", "holds no run: it has no manifest.json"),
        ("manifest of the future", "manifest.json: is no manifest of this version of trajevo: version: "),
        ("manifest cut off", "manifest.json: is no manifest of this version of trajevo: content: Invalid JSON"),
        ("checkpoint cut off", "checkpoint.npz: is damaged or no file of arrays"),
        ("pickled checkpoint", "checkpoint.npz: is damaged or no file of arrays"),
        ("objects in a block", "npz: is damaged or no file of arrays: the array 'X.npy' holds objects"),
        ("no block", "the blocks hold .* individuals, but the checkpoint counts"),
        ("another algorithm", "algorithm: expected one of AGEMOEA2, .* got 'os.system'"),
        ("wrong state", "the run cannot be resumed from its checkpoint: expected X of shape"),
        ("no story", "the checkpoint is damaged: KeyError"),
    ],
)
def test_a_damaged_folder_is_refused_and_none_of_its_content_runs(what, says, tmp_path, stopped_after, monkeypatch):
    monkeypatch.chdir(tmp_path)
    stopped_after(3)
    optimise(PointingMechanism(), seed=2, out=tmp_path / "run", **SMALL, polish=False)
    stopped_after(None)
    (tmp_path / "run" / "front.json").unlink()
    _damage(tmp_path / "run", what)
    refused(lambda: resume(tmp_path / "run", progress=False), says)
    assert not (tmp_path / "unpickled").exists()


def test_a_folder_that_holds_a_run_is_not_overwritten(tmp_path):
    optimise(PointingMechanism(), seed=2, out=tmp_path / "run", **SMALL, polish=False)
    refused(
        lambda: optimise(PointingMechanism(), seed=2, out=tmp_path / "run", **SMALL, polish=False),
        "already holds a run",
    )
    refused(lambda: resume(tmp_path), "holds no run")
    refused(lambda: read_run(tmp_path / "none"), "holds no run")
    front = Front.load(tmp_path / "run" / "front.json")
    front.save(tmp_path / "front.json")
    assert read_run(tmp_path) == front
    refused(lambda: resume(tmp_path), "holds the finished front of a run without checkpoints")


def test_two_processes_are_never_at_one_run(tmp_path):
    optimise(PointingMechanism(), seed=2, out=tmp_path / "run", **SMALL, polish=False)
    (tmp_path / "run" / "front.json").unlink()
    script = "import sys; from trajevo import resume; resume(sys.argv[1], progress=False)"
    with RunFolder(tmp_path / "run").alone():
        other = subprocess.run([sys.executable, "-c", script, tmp_path / "run"], capture_output=True, text=True)
        assert "run: another process is working on this run" in other.stderr
    resume(tmp_path / "run", progress=False)
    assert (tmp_path / "run" / "front.json").exists()
