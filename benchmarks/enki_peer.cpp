// What `enki_peer.py` times of Enki: one robot of our outline with three IR sensors in the paper's arena.
// Prints robot-steps for each second of processor time, a line for each of some repeats.

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>

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

// The second box of `paper-boxes` is turned by 30 degrees. A mass below 0 means that an object cannot be moved.
void addBox(World& world, double x, double y, double length, double width, double angle) {
    auto* box = new PhysicalObject;
    box->setRectangular(length, width, 10, -1);
    box->pos = Point(x, y);
    box->angle = angle;
    world.addObject(box);
}

int main(int, char** arguments) {
    const int steps = std::atoi(arguments[1]), repeats = std::atoi(arguments[2]);
    const bool pressed = !std::strcmp(arguments[3], "pressed"), boxes = !std::strcmp(arguments[3], "boxes");
    for (int repeat = 0; repeat < repeats; repeat++) {
        World world(106.68, 60.96);
        if (boxes) {
            addBox(world, 41.91, 39.37, 10.16, 10.16, 0);
            addBox(world, 74.93, 22.86, 15.24, 7.62, M_PI / 6);
        }
        auto* robot = new Scribbler;
        world.addObject(robot);
        const std::clock_t since = std::clock();
        for (int step = 0; step < steps; step++) {
            if (step % 100 == 0) {  // a trial of ours, from the arena's start with another heading
                robot->pos = Point(19.05, 19.05);
                robot->angle = std::fmod(2.399963 * (step / 100), 2 * M_PI);
                robot->speed = Vector(0, 0);
                robot->angSpeed = 0;
            }
            const double near = std::fmax(robot->left.getValue(), std::fmax(robot->center.getValue(), robot->right.getValue())) / 3731;
            const double ahead = pressed ? 1 : std::tanh(1 - 3 * near), turn = pressed ? 0 : std::tanh(2 * near);
            robot->leftSpeed = 15 * (ahead - turn);
            robot->rightSpeed = 15 * (ahead + turn);
            world.step(0.5);
        }
        std::printf("%f\n", steps * double(CLOCKS_PER_SEC) / double(std::clock() - since));
    }
}
