"""Watching in a real notebook: trials are shown, and a robot is followed while a cell runs."""

import nbclient
import nbformat
import pytest

pytestmark = pytest.mark.slow

CELLS = {
    "trials": "import realitygap\nfrom tests.playback.trials import straight\nrealitygap.watch(straight())",
    "robot": "from realitygap.platforms import JyroRobot\nrobot = realitygap.watch(JyroRobot(), speed=4)\nrobot",
    "drive": "from realitygap.robots import Command\nrobot.reset()\nfor _ in range(30):\n"
    "    robot.observe()\n    robot.drive(Command(0.3, 0.2))\nrobot.stop()",
    "after": "print(robot.trial.n_steps, len(robot.widget.trials[0]['poses']), robot.widget.live)",
}


@pytest.fixture(scope="module")
def notebook(tmp_path_factory):
    """The cells as they were run, and the messages that each sent to the page."""
    book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(source) for source in CELLS.values()])
    client = nbclient.NotebookClient(book, timeout=120, kernel_name="python3")
    told = {name: [] for name in CELLS}
    handle = client.handle_comm_msg

    def noted(outputs, message, index):
        told[list(CELLS)[index]].append(message["content"].get("data", {}))
        return handle(outputs, message, index)

    client.handle_comm_msg = noted
    client.execute()
    return dict(zip(CELLS, book.cells, strict=True)), told


@pytest.mark.slow
def test_trials_and_robots_are_shown_below_their_cells(notebook):
    cells, _ = notebook
    for name in ("trials", "robot"):
        kinds = [kind for output in cells[name].outputs for kind in output.get("data", {})]
        assert "application/vnd.jupyter.widget-view+json" in kinds


def test_the_page_follows_the_robot_at_up_to_twenty_frames_a_second(notebook):
    cells, told = notebook
    frames = [data["content"] for data in told["drive"] if data.get("method") == "custom"]
    now = [frame for frame in frames if frame["kind"] == "now"]
    assert 6 <= len(now) <= 31, "15 in 0.75 s on a machine with nothing else to do"
    steps = [frame["step"] for frame in now]
    assert steps == sorted(steps)
    assert "".join(output.get("text", "") for output in cells["after"].outputs) == "30 31 False\n"
