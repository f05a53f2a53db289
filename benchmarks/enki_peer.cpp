// What `enki_peer.py` times of Enki: one robot of our outline with three IR sensors in the paper's arena.
// Prints robot-steps a second, a line for each of some repeats.

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include <enki/PhysicalEngine.h>
#include <enki/interactions/IRSensor.h>
#include <enki/robots/DifferentialWheeled.h>

using namespace Enki;

// Enki counts in cm. Wheel spacing, speed and motor noise are those of our benchmark's robot.
class Scribbler : public DifferentialWheeled {
public:
    IRSensor left, center, right;

    Scribbler()
        : DifferentialWheeled(15.3, 15.0, 0.05),
          left(this, Vector(8.9, 5.0), 2.0, 0.0, 20.0, 3731, 0.3, 0.7),
          center(this, Vector(8.9, 0.0), 2.0, 0.0, 20.0, 3731, 0.3, 0.7),
          right(this, Vector(8.9, -5.0), 2.0, 0.0, 20.0, 3731, 0.3, 0.7) {
        addLocalInteraction(&left);
        addLocalInteraction(&center);
        addLocalInteraction(&right);
        Polygon outline;
        const double corners[8][2] = {{8.9, -6}, {8.9, 6}, {7, 7.95}, {-7, 7.95}, {-8.9, 6}, {-8.9, -6}, {-7, -7.95}, {7, -7.95}};
        for (const auto& corner : corners) outline << Point(corner[0], corner[1]);
        Hull hull(PhysicalObject::Part(outline, 6.3));
        setCustomHull(hull, 900);
    }
};

int main(int, char** arguments) {
    const int steps = std::atoi(arguments[1]), repeats = std::atoi(arguments[2]);
    const bool pressed = std::atoi(arguments[3]) != 0;
    for (int repeat = 0; repeat < repeats; repeat++) {
        World world(106.68, 60.96);
        auto* robot = new Scribbler;
        robot->pos = Point(53, 30);
        world.addObject(robot);
        const auto since = std::chrono::steady_clock::now();
        for (int step = 0; step < steps; step++) {
            const double near = std::fmax(robot->left.getValue(), std::fmax(robot->center.getValue(), robot->right.getValue())) / 3731;
            const double ahead = pressed ? 1 : std::tanh(1 - 3 * near), turn = pressed ? 0 : std::tanh(2 * near);
            robot->leftSpeed = 15 * (ahead - turn);
            robot->rightSpeed = 15 * (ahead + turn);
            world.step(0.5);
        }
        const std::chrono::duration<double> took = std::chrono::steady_clock::now() - since;
        std::printf("%f\n", steps / took.count());
    }
}
