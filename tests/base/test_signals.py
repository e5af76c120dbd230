"""Signals: the first finishes the generation, the second aborts."""

import os
import signal
import threading

import pytest

from tests.helpers import small_problem
from trajevo import optimise
from trajevo.base.signals import Stopping
from trajevo.formulation.objectives import Objective, summed_rms_jerk, total_time
from trajevo.solvers.gradient import normal_constraint as nnc
from trajevo.solvers.gradient.normal_constraint import solve_nnc

SMALL = {"generations": 7, "population": 12, "starts": "random", "progress": False}


def signalling(number, *calls_that_do):
    """A small problem whose objective sends this process a signal at certain calls."""
    calls = []

    def impatient(rollout):
        calls.append(1)
        if len(calls) in calls_that_do:
            os.kill(os.getpid(), number)
        return total_time(rollout)

    return small_problem(
        objectives=(Objective("time", "s", "t", impatient), Objective("jerk", "rad/s^3", "t", summed_rms_jerk))
    )


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_finishes_the_generation_and_keeps_what_was_found(number):
    before = signal.getsignal(number)
    front = optimise(signalling(number, 5), seed=1, **SMALL, polish=False)
    assert front.run.interrupted
    assert front.run.stopped_by == number.name
    assert front.run.generations == 5
    assert front.run.evaluations == 5 * SMALL["population"]
    assert len(front) > 0
    assert signal.getsignal(number) is before


def test_a_second_interrupt_aborts_and_gives_the_keyboard_back():
    before = signal.getsignal(signal.SIGINT)

    def twice(rollout):
        os.kill(os.getpid(), signal.SIGINT)
        os.kill(os.getpid(), signal.SIGINT)
        return total_time(rollout)

    objectives = (Objective("time", "s", "t", twice), Objective("jerk", "rad/s^3", "t", summed_rms_jerk))
    with pytest.raises(KeyboardInterrupt):
        optimise(small_problem(objectives=objectives), seed=1, **SMALL, polish=False)
    assert signal.getsignal(signal.SIGINT) is before


def test_a_signal_in_the_last_generation_interrupts_nothing():
    front = optimise(signalling(signal.SIGINT, SMALL["generations"]), seed=1, **SMALL, polish=False)
    assert not front.run.interrupted
    assert front.run.stopped_by == ""


def test_a_method_by_gradients_stops_after_the_point_it_is_at(monkeypatch):
    between, calls = nnc._Division.between, []

    def interrupted(self, *arguments):
        calls.append(1)
        if len(calls) == 4:
            os.kill(os.getpid(), signal.SIGINT)
        return between(self, *arguments)

    monkeypatch.setattr(nnc._Division, "between", interrupted)
    front = solve_nnc(small_problem())
    assert front.run.interrupted
    assert front.run.stopped_by == "SIGINT"
    assert len(front) == 6


def test_outside_of_the_main_thread_no_signal_is_taken():
    before, seen = signal.getsignal(signal.SIGINT), []

    def elsewhere():
        with Stopping() as stopping:
            seen.extend([signal.getsignal(signal.SIGINT), bool(stopping)])

    thread = threading.Thread(target=elsewhere)
    thread.start()
    thread.join()
    assert seen == [before, False]


def test_a_process_that_ignores_the_keyboard_goes_on_ignoring_it():
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with Stopping() as stopping:
            os.kill(os.getpid(), signal.SIGINT)
            assert not stopping
            os.kill(os.getpid(), signal.SIGTERM)
            assert stopping.asked_by == "SIGTERM"
    finally:
        signal.signal(signal.SIGINT, before)


def test_what_is_around_a_run_is_asked_to_stop_too():
    with Stopping() as around:
        optimise(signalling(signal.SIGINT, SMALL["generations"]), seed=1, **SMALL, polish=False)
        assert around.asked_by == "SIGINT"


def test_a_second_interrupt_aborts_what_is_around_a_run_too():
    before = signal.getsignal(signal.SIGINT)

    def asked_twice():
        with Stopping():
            optimise(signalling(signal.SIGINT, 2), seed=1, **SMALL, polish=False)
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        asked_twice()
    assert signal.getsignal(signal.SIGINT) is before
