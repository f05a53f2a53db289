"""A robot that drives a square, and draws it in a window: functions together, graphics, a robot of one's own."""

from myro import *

robot = Scribbler("com5")
win = GraphWin("Square", 120, 120)
here = Point(10, 110)
corners = [Point(10, 10), Point(110, 10), Point(110, 110), Point(10, 110)]


def side(number):
    global here
    robot.forward(0.6, 1)
    robot.turnRight(0.6, 1.3)
    there = corners[number - 1]
    line = Line(here, there)
    line.setFill("blue")
    line.draw(win)
    here = there
    return number


loop(side, 4)
spot = Circle(Point(60, 60), 5)
spot.setFill(color_rgb(255, 0, 0))
spot.draw(win)
doTogether(lambda: robot.beep(0.2, 440), lambda: len(corners))
print(len(win.items), "shapes")
