"""A robot whose link is lost while a study, a gap, or a calibration runs: the emulator is killed, and started again."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator

import pytest

from realitygap.records import read_observations, those_that_count

from .conftest import enter, open_advanced, open_fold
from .robot_study import CONNECT, ledger_of, make_study, pass_preflight, start_trial
from .test_calibrate_in_browser import begin as calibrate

pytestmark = pytest.mark.slow


class Killable:
    """An emulated robot in its own process, which can be killed and started again at the same addresses."""

    def __init__(self) -> None:
        self.port = self.witness = ""
        self._process: subprocess.Popen[str] | None = None

    def start(self, speed: float) -> None:
        tcp, witness = (address.rpartition(":")[2] or "0" for address in (self.port, self.witness))
        options = ["--tcp", tcp, "--witness", witness, "--speed", str(speed), "--quiet"]
        command = [sys.executable, "-m", "realitygap", "emulate", "scribbler", *options]
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert self._process.stdout is not None
        self.port, self.witness = (self._process.stdout.readline().split()[-1] for _ in range(2))

    def kill(self) -> None:
        assert self._process is not None
        self._process.kill()
        with self._process:
            pass


@pytest.fixture
def robot() -> Iterator[Killable]:
    robot = Killable()
    yield robot
    robot.kill()


def readings_of(trials) -> list[list[list[float]]]:
    return [trial.readings.tolist() for trial in trials]


def is_lost(page, robot) -> None:
    chip = f"Robot on {robot.port}: link lost. If it moves, switch it off."
    page.locator(".lab-robot-lost .lab-chip", has_text=chip).wait_for()


WATCH_SILENCE = """() => {
  window.silence = "";
  const look = () => {
    const said = [...document.querySelectorAll(".lab-problem")].find((it) => it.checkVisibility()
      && /^No answer for \\d+\\ss\\. The link is being opened again/.test(it.textContent));
    if (said && !window.silence) window.silence = said.textContent;
  };
  const all = { subtree: true, childList: true, characterData: true, attributes: true };
  new MutationObserver(look).observe(document.body, all);
}"""
"""Keep what the page states first of a silent robot: a test on a busy machine sees it later."""


def kill_and_see_silence(page, robot) -> None:
    """Kill the robot; the page states that it is silent, long before its link is given up."""
    page.evaluate(WATCH_SILENCE)
    robot.kill()
    page.wait_for_function("() => window.silence")
    page.locator(".lab-robot-silent .lab-chip", has_text="no readings").wait_for()


def test_robot_lost_in_a_trial_of_a_study_is_shown_and_the_study_resumes(lab, visit, robot):
    make_study(lab.root, steps=40)
    robot.start(speed=2)
    page = visit("study/by-robot/trials")
    page.get_by_label("Your name").fill("anna")
    enter(page, "Port", robot.port)
    open_advanced(page, page.get_by_label("Witness"))
    page.get_by_label("Witness").fill(robot.witness)
    page.get_by_role("button", name=CONNECT).click()
    start_trial(page, 1)
    page.get_by_text(re.compile(r"^Step ([3-9]|[12]\d) of 40")).wait_for()  # the page may skip some
    robot.kill()
    page.get_by_text(re.compile(r"No answer for \d+\ss\. The link is being opened again")).wait_for()
    page.locator(".lab-robot-silent .lab-chip", has_text="no readings").wait_for()
    message = re.compile(r"Link lost in trial 1 at step \d+ of 40: .* The trial is saved as interrupted\.")
    page.locator(".lab-problem", has_text=message).wait_for()
    is_lost(page, robot)
    with ledger_of(lab.root) as ledger:
        assert [trial.state for trial in ledger.trials()] == ["running", "planned"], "nobody has decided yet"
        assert len(ledger.record(1).commands) >= 3
    robot.start(speed=8)
    page.get_by_role("button", name="Reconnect").click()
    problem = page.locator(".lab-problem", has_text="The trial was interrupted")
    problem.wait_for()
    assert not problem.inner_text().endswith("?.")
    page.get_by_role("button", name="Void and repeat").click()
    pass_preflight(page, page.get_by_text("placed at its start automatically"))  # the witness is known
    start_trial(page, 3)
    for _ in range(600):
        with ledger_of(lab.root) as ledger:
            states = sorted(trial.state for trial in ledger.trials())
        if "driven" in states:
            break
        page.wait_for_timeout(100)
    assert states == ["driven", "planned", "void"]
    open_fold(page, "Robot")
    page.get_by_role("button", name="Disconnect").click()
    page.locator("[data-fold=Robot]").get_by_text("Connect a robot").wait_for()


def test_robot_lost_in_a_gap_keeps_its_trials_and_the_gap_resumes(lab, visit, robot):
    robot.start(speed=20)
    page = visit("gap")
    enter(page, "Target", f"scribbler:{robot.port}")
    for label in ("Controllers", "Trials per controller"):
        page.get_by_label(label, exact=True).fill("2")
    open_advanced(page, page.get_by_label("Witness"))
    page.get_by_label("Witness").fill(robot.witness)
    page.get_by_role("button", name="Measure the gap").click()
    page.get_by_text(re.compile(r"[1-3] of 4 trials")).first.wait_for()
    kill_and_see_silence(page, robot)
    problem = page.locator(".lab-problem", has_text="trials on the target. They are saved. Resume once")
    problem.wait_for()
    n_done = int(re.match(r"Link lost after (\d) of 4", problem.inner_text())[1])
    is_lost(page, robot)
    resume = page.get_by_role("button", name="Resume")
    assert resume.bounding_box()["y"] < page.get_by_label("Simulator").bounding_box()["y"]
    kept = lab.root / "gaps" / "sim-scribbler.sqlite"
    before = those_that_count(read_observations(kept).trials)
    assert len(before) == n_done
    resume.click()
    page.locator(".lab-problem", has_text="No witness at").wait_for()
    is_lost(page, robot)  # nothing has reached it since: it may still move
    robot.start(speed=60)
    resume.click()
    page.get_by_text("Complete.", exact=True).wait_for()
    after = those_that_count(read_observations(kept).trials)
    assert len(after) == 4
    assert readings_of(after[:n_done]) == readings_of(before)
    assert not page.locator(".lab-robot-lost").is_visible()


def test_robot_lost_in_a_calibration_keeps_its_trials_and_the_calibration_resumes(lab, visit, robot):
    robot.start(speed=10)
    page = visit("calibrate")
    page.get_by_role("button", name="Next", exact=True).click()
    open_advanced(page, page.get_by_label("Witness"))
    page.get_by_label("Witness").fill(robot.witness)
    page.get_by_role("button", name="Back").click()
    calibrate(page, "sensors", Robot=f"scribbler:{robot.port}")
    page.get_by_text(re.compile(r"^Trial [2-9] of 18")).wait_for()
    kill_and_see_silence(page, robot)
    problem = page.locator(
        ".lab-problem", has_text=re.compile(r"Link lost after \d+ of 18 trials\. They are")
    )
    problem.wait_for()
    n_done = int(re.search(r"after (\d+) of", problem.inner_text())[1])
    is_lost(page, robot)
    page.reload()
    resume = page.get_by_role("button", name="Resume")
    resume.wait_for()
    kept = lab.root / "my-robot.trials.sqlite"
    before = those_that_count(read_observations(kept).trials)
    assert len(before) == n_done
    robot.start(speed=100)
    resume.click()
    page.get_by_text("Complete. Saved as my-robot.toml.").wait_for()
    after = those_that_count(read_observations(kept).trials)
    assert len(after) == 18
    assert readings_of(after[:n_done]) == readings_of(before)
