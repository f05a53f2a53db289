"""A robot that drives for twenty seconds and turns away from walls: sensors, decisions, timers."""

from myro import *

initialize("com5")

FAR = 1000  # what getObstacle tells of a wall that is not worth a turn


def isClear():
    left, center, right = getObstacle()
    return left < FAR and center < FAR and right < FAR


def main():
    turns = 0
    while timeRemaining(20):
        if isClear() and not getStall():
            forward(0.5)
        else:
            turns = turns + 1
            backward(0.4, 0.5)
            if flipCoin() == "heads":
                turnLeft(0.5, 0.7)
            else:
                turnRight(0.5, 0.7)
    stop()
    print("Turned", turns, "times")
    speak("I am done.")


main()
