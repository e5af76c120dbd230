"""A page that is served: to this machine alone, with what its run has at the moment, and buttons that go on with it."""

import http.client
import json
import time
from urllib.parse import urlsplit

import netCDF4
import numpy as np
import pytest

from tests.helpers import refused
from trajevo import Front, certify, dlcc, export, load_problem, minimise_weighted, optimise, read_run
from trajevo.errors import TrajevoError
from trajevo.formulation.problem import Weights
from trajevo.page.server import RunPage, Served
from trajevo.solvers.gradient.weighing import solve_weighted


@pytest.fixture
def run(tmp_path):
    front = optimise(
        load_problem("pointing"),
        population=12,
        generations=5,
        seed=1,
        polish=False,
        progress=False,
        out=tmp_path / "run",
    )
    assert len(front)
    return tmp_path / "run"


@pytest.fixture
def served(run):
    with Served(run) as one:
        yield one


def asked(served, what="", *, method="GET", body=None, token=None, host=None, kind="application/json"):
    address = urlsplit(served.address)
    connection = http.client.HTTPConnection(address.hostname, address.port, timeout=60)
    path = address.path if token is None else f"/{token}/"
    headers = {"Host": host or address.netloc} | ({"Content-Type": kind} if method == "POST" else {})
    connection.request(method, path + what, body=json.dumps(body) if body is not None else None, headers=headers)
    answer = connection.getresponse()
    found = answer.status, answer.read().decode()
    connection.close()
    return found


def ended(served):
    end = time.monotonic() + 120.0
    while (job := served.page.job) is not None and job.running:
        assert time.monotonic() < end
        time.sleep(0.1)
    return served.page.job


def test_the_page_is_that_of_the_run_and_is_made_once(served, run):
    code, text = asked(served)
    assert code == 200
    front = read_run(run)
    assert f"<h1>{front.record.title}</h1>" in text
    assert '"live": {"stamp"' in text
    assert asked(served)[1] == text
    told = json.loads(asked(served, "standing")[1])
    assert (told["generation"], told["generations"], told["going"], told["job"]) == (5, 5, False, None)


def test_nobody_else_gets_an_answer(served):
    assert urlsplit(served.address).hostname == "127.0.0.1"
    assert asked(served, token="guessed")[0] == 404
    assert asked(served, host="example.org:80")[0] == 404
    assert asked(served, "front.json")[0] == 404
    assert asked(served, "polish", method="POST", body={}, token="guessed")[0] == 404
    assert asked(served, "polish", method="POST", body={}, kind="text/plain")[0] == 404  # as a form of another page
    assert served.page.job is None


def test_more_generations_land_in_the_run_and_the_page_says_so(served, run):
    before = json.loads(asked(served, "standing")[1])["stamp"]
    code, said = asked(served, "more", method="POST", body={})
    assert code == 202
    assert json.loads(said)["job"]["name"] == "more"
    assert asked(served, "polish", method="POST", body={}) == (409, "more is still running")
    assert not ended(served).failed
    assert read_run(run).run.generations == 55
    told = json.loads(asked(served, "standing")[1])
    assert told["stamp"] != before
    assert told["generations"] == 55


@pytest.mark.long
def test_weights_land_as_a_member_that_minimises_their_sum(served, run):
    front = read_run(run)
    weights = [0.2, 0.5, 0.3]
    assert asked(served, "weigh", method="POST", body={"weights": weights})[0] == 202
    job = ended(served)
    assert not job.failed, job.said
    found = Front.load(run / "front.json")
    span = np.ptp(front.F, axis=0)
    least = minimise_weighted(front.problem, Weights(tuple(weights), tuple(span)), seed=7, starts=12).cost
    assert (found.F @ (weights / span)).min() == pytest.approx(least, rel=1e-4)
    assert (front.F @ (weights / span)).min() > least * 1.001
    assert found.run.settings["weighed"] == [weights]
    assert Front.load(run / "evolved.json") == front


def test_what_cannot_be_begun_gets_a_sentence(served):
    assert asked(served, "dance", method="POST", body={}) == (
        409,
        "expected polish, more or weigh with weights, got 'dance'",
    )
    assert asked(served, "weigh", method="POST", body={"weights": ["x"]})[0] == 409
    assert asked(served, "weigh", method="POST", body=[1])[0] == 409
    asked(served, "weigh", method="POST", body={"weights": [1.0]})
    job = ended(served)
    assert job.failed
    assert "expected" in job.said
    assert asked(served, "standing")[0] == 200


def test_a_port_that_is_taken_gets_a_sentence(served, run):
    refused(lambda: Served(run, port=urlsplit(served.address).port), "port: .* of 127.0.0.1 cannot be used")


def test_a_member_that_is_as_good_already_leaves_the_front_as_it_is(run):
    front, first = solve_weighted(read_run(run), [1.0, 1.0, 1.0])
    again, second = solve_weighted(front, [1.0, 1.0, 1.0])
    assert second.cost == pytest.approx(first.cost, rel=1e-6)
    assert len(again) <= len(front) + 1
    refused(lambda: solve_weighted(front, [1.0]), "weights: expected")
    refused(lambda: solve_weighted(front, [0.0, 0.0, 0.0]), "weights")


def test_a_run_without_a_generation_is_told(tmp_path):
    (tmp_path / "run").mkdir()
    with Served(tmp_path / "run") as one:
        code, text = asked(one)
    assert code == 503
    assert "load again later" in text
    assert RunPage(tmp_path / "run").told()["job"] is None


def test_every_solution_has_its_certificate_payload_and_files_from_the_server(served, run, tmp_path):
    asked(served)
    stamp, front = served.page.stamp, read_run(run)
    choices = {choice.index: choice for choice in front.choices()}
    row = next(k for k in range(len(front)) if k not in choices)
    some, every = ("csv", "gcode"), ("csv", "json", "ros2", "mujoco", "feed", "gcode")
    for solution, formats in ((front.pick(row), some), (choices[front.knee().index], every)):
        where = f"row={solution.index}&stamp={stamp}"
        assert asked(served, f"certificate?{where}") == (200, str(certify(solution)))
        for format in formats:
            code, text = asked(served, f"file?{where}&format={format}")
            assert (code == 200, text) == written(solution, tmp_path / "file", format), format
        export(solution, tmp_path / "file", format="netcdf")
        given = {"row": str(solution.index), "stamp": stamp, "format": "netcdf"}
        assert_same_variables(served.page.answer("file", given), (tmp_path / "file").read_bytes())
        assert asked(served, f"payload?{where}") == (200, str(dlcc(solution)))


def assert_same_variables(first, second):
    """That two netCDF files hold the same; their bytes have the time at which they were made."""
    one, other = (netCDF4.Dataset("held", memory=content) for content in (first, second))
    assert list(one.variables) == list(other.variables)
    for name in one.variables:
        np.testing.assert_array_equal(one[name][:], other[name][:])
    assert one.__dict__ == other.__dict__


def written(solution, file, format):
    """Whether a file was written, and its text, or why not."""
    try:
        export(solution, file, format=format)
    except TrajevoError as error:
        return False, str(error)
    return True, file.read_text()


def test_what_cannot_be_answered_gets_a_sentence(served):
    newer = "the run has something new; load the page again"
    assert asked(served, "certificate?row=0&stamp=0") == (409, newer)
    asked(served)
    stamp = served.page.stamp
    assert asked(served, "certificate?row=0&stamp=0") == (409, newer)
    assert asked(served, f"certificate?row=-1&stamp={stamp}") == (409, "row: expected a whole number, got '-1'")
    assert asked(served, f"certificate?stamp={stamp}") == (409, "row: expected a whole number, got ''")
    code, said = asked(served, f"file?row=99999&stamp={stamp}&format=csv")
    assert (code, said.partition(",")[0]) == (409, f"row: expected one from 0 to {len(read_run(served.page.run)) - 1}")
    code, said = asked(served, f"file?row=0&stamp={stamp}&format=xls")
    assert code == 409
    assert said.startswith("unknown export format 'xls'")
    assert asked(served, f"certificate?row=0&stamp={stamp}", token="guessed")[0] == 404
