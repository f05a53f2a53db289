"""A lesson in a real notebook: the robot is shown live while a cell runs, mistakes are plain, errors stop the robot."""

import nbclient
import nbformat
import pytest

pytestmark = pytest.mark.slow

CELLS = {
    "open": "from realitygap.classroom.myro import *\ninitialize('sim', speed=5, start='center')",
    "drive": "forward(0.3, 5)",
    "mistake": "forward('x')",
    "error": "forward(0.3)\n1 / 0",
    "after error": "wait(1); print(robot.simulation.witness.motors() == (0, 0))",
    "show": "show(makePicture(5, 5, red)); repaint(makePicture(5, 5, blue))",
    "picture": "makePicture(5, 5, red)",
    "joystick": "joystick()",
    "window": "win = GraphWin('A', 50, 50); Circle(Point(20, 20), 5).draw(win)",
}


@pytest.fixture(scope="module")
def notebook(tmp_path_factory):
    """The cells as they were run, and how often each cell moved the picture of the robot."""
    cells = [nbformat.v4.new_code_cell(source) for source in CELLS.values()]
    book = nbformat.v4.new_notebook(cells=cells)
    folder = {"metadata": {"path": str(tmp_path_factory.mktemp("notebook"))}}
    client = nbclient.NotebookClient(
        book, timeout=120, allow_errors=True, kernel_name="python3", resources=folder
    )
    updates = dict.fromkeys(CELLS, 0)
    handle = client.handle_comm_msg

    def counted(outputs, message, index):
        if message["content"].get("data", {}).get("method") == "update":
            updates[list(CELLS)[index]] += 1
        return handle(outputs, message, index)

    client.handle_comm_msg = counted
    client.execute()
    return dict(zip(CELLS, book.cells, strict=True)), updates


def text(cell):
    return "".join(output.get("text", "") for output in cell.outputs)


def test_the_robot_is_shown_below_the_cell(notebook):
    cells, _ = notebook
    assert any(
        "application/vnd.jupyter.widget-view+json" in output.get("data", {})
        for output in cells["open"].outputs
    )
    assert "Hello, I'm Scribby!" in text(cells["open"])


def test_it_moves_on_the_screen_while_a_cell_runs(notebook):
    _, updates = notebook
    assert updates["drive"] >= 3  # 10 in a second on a machine with nothing else to do
    assert updates["picture"] == 0  # it stands


def test_a_mistake_is_one_message(notebook):
    cells, _ = notebook
    assert text(cells["mistake"]) == (
        "Line 1 of this cell: forward('x')\nMyroError: forward: the speed is 'x', expected a number.\n"
    )


def test_a_cell_that_ends_with_an_error_stops_the_robot(notebook):
    cells, _ = notebook
    assert cells["error"].outputs[-1]["ename"] == "ZeroDivisionError"
    assert text(cells["after error"]) == "True\n"


def test_a_joystick_appears_below_its_cell(notebook):
    cells, _ = notebook
    assert any(
        "application/vnd.jupyter.widget-view+json" in output.get("data", {})
        for output in cells["joystick"].outputs
    )


def test_pictures_and_windows_appear_below_the_cell(notebook):
    cells, _ = notebook
    assert len(cells["show"].outputs) == 1
    assert "<img" in cells["show"].outputs[0]["data"]["text/html"]
    assert "image/png" in cells["picture"].outputs[0]["data"]
    assert "<ellipse" in cells["window"].outputs[0]["data"]["text/html"]
