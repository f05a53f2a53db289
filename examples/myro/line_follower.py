"""A robot that drives until its line sensors see tape, and tells what it saw: lists, strings, booleans."""

from myro import *

initialize("com5")
setForwardness("scribbler-forward")

seen = []
for t in timer(6):
    line = getLine()
    if line == [0, 0]:
        forward(0.4)
    elif line == [1, 0]:
        turnLeft(0.3, 0.1)
    elif line == [0, 1]:
        turnRight(0.3, 0.1)
    else:
        stop()
        break
    if line not in seen:
        seen.append(line)
stop()
print("Lines seen:", seen)
