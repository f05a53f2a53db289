"""A vehicle after Braitenberg that turns to the light: normalized sensors straight to the motors."""

from myro import *

robot = makeRobot("Scribbler", "com5")
robot.setForwardness("scribbler-forward")

Ambient = sum(getLight()) / 3.0


def normalize(v):
    if v > Ambient:
        v = Ambient
    return 1.0 - v / Ambient


def main():
    brightest = Ambient
    for seconds in timer(10):
        L = getLight("left")
        R = getLight("right")
        brightest = min(brightest, L, R)
        # the brighter side's wheel turns less, so the robot turns to it
        robot.motors(0.3 + normalize(R) / 2, 0.3 + normalize(L) / 2)
    robot.stop()
    print("Ambient", round(Ambient), "brightest", round(brightest))


main()
