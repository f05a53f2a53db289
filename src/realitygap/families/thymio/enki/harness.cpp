// SPDX-License-Identifier: GPL-2.0-or-later
// A Thymio II in Enki, driven by lines on the standard input. Enki's library is under the GPL, so this is a separate
// program. realitygap ships its source only and speaks to it through pipes. Units: cm, cm/s, s, rad.
//
//     world W H                  a room with walls, from (0, 0) to (W, H); a white floor
//     world W H COLUMNS ROWS g.. likewise, with a floor of gray values 0..255, the row of lowest y first
//     world                      no walls
//     box X Y L1 L2 ANGLE        an obstacle around (X, Y)
//     disc X Y R
//     polygon X Y N x y ..       convex, counter-clockwise corners around its center of mass (X, Y)
//     seed K                     for the noise of wheels and sensors
//     put X Y ANGLE              the robot, at rest
//     drive LEFT RIGHT N DT      speeds of the wheels for N steps of DT
//     sense                      the sensors again, with new noise
//
// put, drive and sense answer: x y angle, prox 0..6, ground 0..1, distance of the left and right wheel since put,
// and 1 if the robot touched anything since the last answer. Other lines answer `ok`. A wrong line answers `error`.

#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include <enki/PhysicalEngine.h>
#include <enki/Random.h>
#include <enki/robots/thymio2/Thymio2.h>

using namespace Enki;

const double HEIGHT = 10, INFRARED_SD = 2.87, INFRARED_MOST = 4505;

class Robot2 : public Thymio2 {
public:
    bool touched = false;

protected:
    void collisionEvent(PhysicalObject*) override { touched = true; }
};

// Enki 1.6.99 keeps the value of a ray that no longer meets anything. Its header says that such a ray counts 0.
double infrared(const IRSensor& sensor) {
    double value = 0;
    bool meets = false;
    for (unsigned ray = 0; ray < sensor.getRayCount(); ray++)
        if (sensor.getRayDist(ray) < sensor.getRange()) {
            value += sensor.getRayValue(ray);
            meets = true;
        }
    const double noisy = gaussianRand(value, INFRARED_SD);
    return meets ? std::max(0.0, std::min(INFRARED_MOST, noisy)) : 0.0;
}

void answer(Robot2& robot) {
    const IRSensor* sensors[] = {&robot.infraredSensor0, &robot.infraredSensor1, &robot.infraredSensor2,
                                 &robot.infraredSensor3, &robot.infraredSensor4, &robot.infraredSensor5,
                                 &robot.infraredSensor6};
    std::printf("%.17g %.17g %.17g", robot.pos.x, robot.pos.y, robot.angle);
    for (const auto* sensor : sensors) std::printf(" %.17g", infrared(*sensor));
    std::printf(" %.17g %.17g", robot.groundSensor0.getValue(), robot.groundSensor1.getValue());
    std::printf(" %.17g %.17g %d\n", robot.leftOdometry, robot.rightOdometry, robot.touched ? 1 : 0);
    robot.touched = false;
}

void rest(Robot2& robot, double x, double y, double angle) {
    robot.leftSpeed = robot.rightSpeed = robot.angSpeed = 0;
    robot.speed = Vector(0, 0);
    robot.pos = Point(x, y);
    robot.angle = angle;
    robot.resetEncoders();
}

std::unique_ptr<World> make_world(std::istringstream& line) {
    double width, height;
    unsigned columns, rows;
    if (!(line >> width >> height)) return std::make_unique<World>();
    if (!(line >> columns >> rows)) return std::make_unique<World>(width, height, Color::white);
    std::vector<uint32_t> pixels;
    for (unsigned gray; line >> gray;) pixels.push_back(0xff000000u | gray << 16 | gray << 8 | gray);
    if (pixels.size() != size_t(columns) * rows) return nullptr;
    return std::make_unique<World>(width, height, Color::white, World::GroundTexture(columns, rows, pixels.data()));
}

PhysicalObject* make_obstacle(const std::string& kind, std::istringstream& line) {
    double x, y, a, b, angle = 0;
    if (!(line >> x >> y >> a)) return nullptr;
    auto object = std::make_unique<PhysicalObject>();
    if (kind == "disc") {
        object->setCylindric(a, HEIGHT, -1);
    } else if (kind == "box") {
        if (!(line >> b >> angle)) return nullptr;
        object->setRectangular(a, b, HEIGHT, -1);
    } else {
        Polygon outline;
        for (double u, v; line >> u >> v;) outline.push_back(Point(u, v));
        if (outline.size() != size_t(a)) return nullptr;
        object->setCustomHull(PhysicalObject::Hull(PhysicalObject::Part(outline, HEIGHT)), -1);
    }
    object->pos = Point(x, y);
    object->angle = angle;
    return object.release();
}

int main() {
    std::unique_ptr<World> world;
    Robot2* robot = nullptr;
    for (std::string text; std::getline(std::cin, text); std::fflush(stdout)) {
        std::istringstream line(text);
        std::string word;
        line >> word;
        bool is_known = true;
        if (word == "world") {
            world = make_world(line);
            robot = nullptr;
            if (world) world->addObject(robot = new Robot2);
            is_known = bool(world);
        } else if (!world) {
            is_known = false;
        } else if (word == "box" || word == "disc" || word == "polygon") {
            auto* obstacle = make_obstacle(word, line);
            is_known = obstacle != nullptr;
            if (obstacle) world->addObject(obstacle);
        } else if (word == "seed") {
            unsigned long seed;
            is_known = bool(line >> seed);
            std::srand(unsigned(seed));
            world->setRandomSeed(seed);
        } else if (word == "put") {
            double x, y, angle;
            if (!(is_known = bool(line >> x >> y >> angle))) goto done;
            rest(*robot, x, y, angle);
            world->step(0.03);  // a command that was under way ends
            rest(*robot, x, y, angle);
            world->step(0.03);
            rest(*robot, x, y, angle);
            robot->touched = false;
            answer(*robot);
            continue;
        } else if (word == "drive") {
            double left, right, dt;
            int n;
            if (!(is_known = line >> left >> right >> n >> dt && n > 0 && dt > 0)) goto done;
            robot->leftSpeed = left;
            robot->rightSpeed = right;
            for (int step = 0; step < n; step++) world->step(dt, 3);
            answer(*robot);
            continue;
        } else if (word == "sense") {
            answer(*robot);
            continue;
        } else {
            is_known = false;
        }
    done:
        std::printf("%s\n", is_known ? "ok" : "error");
    }
}
