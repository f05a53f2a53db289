"""A robot that dances, as in the first weeks of a course: functions of one's own, loops, waiting."""

from myro import *

init("com5")


def yoyo(speed, waitTime):
    forward(speed)
    wait(waitTime)
    backward(speed)
    wait(waitTime)
    stop()


def wiggle(speed, waitTime):
    rotate(-speed)
    wait(waitTime)
    rotate(speed)
    wait(waitTime)
    stop()


def dance():
    setName("Rosa")
    print("This dance is by", getName())
    for i in range(2):
        yoyo(0.5, 0.5)
        wiggle(0.5, 1)
        setLED("all", odd(i))
    turnLeft(1, 0.5)
    turnRight(1, 0.5)
    translate(0.3)
    rotate(0.2)
    wait(1)
    beep(0.5, 880)
    stop()


dance()
