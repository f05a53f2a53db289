// SPDX-License-Identifier: GPL-2.0-or-later
// A robot with two wheels that speaks ROS 2's protocol through Fast DDS and moves in Enki, in real time.
// Options are words NAME=VALUE,VALUE.. and commands are lines on the standard input; `fast_dds.py` describes both.
// Enki's library is under the GPL, so this is a separate program. Units: m, s, rad; Enki has cm.

#include <atomic>
#include <chrono>
#include <cmath>
#include <deque>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <random>
#include <set>
#include <sstream>
#include <stdexcept>
#include <thread>

#include <enki/PhysicalEngine.h>
#include <enki/robots/DifferentialWheeled.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>

#include "messages.h"

namespace fast = eprosima::fastdds::dds;
using eprosima::fastrtps::rtps::IPLocator;
using eprosima::fastrtps::rtps::Locator_t;

const double CM = 100, HEIGHT_CM = 10, WALL_CM = 0.2, MASS = 1000, PATH_S = 0.01;
const int CONE_RAYS = 5;
const uint32_t PEERS = 32;  // processes of the domain on this machine that are asked for their participants

// ---- options

class Options {
    std::map<std::string, std::string> values{
        {"domain", "0"}, {"namespace", ""}, {"twist_topic", "cmd_vel"}, {"stamped_topic", ""},
        {"reliable", "cmd_vel,odom,bumper,pose"}, {"byte_order", "little"}, {"renamed", ""},
        {"rate_odom", "50"}, {"rate_scan", "10"}, {"rate_range", "20"}, {"rate_bumper", "20"}, {"rate_pose", "0"},
        {"step", "0.001"}, {"seed", "0"}, {"start", "0,0,0"}, {"axle", "0.1"}, {"radius", "0.05"}, {"max_wheel", "0.3"},
        {"timeout", "0.5"}, {"delay", "0"}, {"lag", "0"}, {"gains", "1,1"}, {"wheel_noise", "0"}, {"max_age", "0"},
        {"odometry_scale", "1,1"}, {"odometry_noise", "0"}, {"odometry_restarts", "0"}, {"clock_shift", "0"},
        {"range_limits", "0.005,1"}, {"cone", "0.1"}, {"range_noise", "0"}, {"variance", "0"}, {"nothing", "inf"},
        {"scan_rays", "360"}, {"scan_angles", "-3.14159265,3.12413936"}, {"scan_limits", "0.05,3.5"}, {"scan_noise", "0"}};
    std::map<std::string, std::vector<double>> parsed;

    static std::vector<double> numbers(const std::string& text) {
        std::vector<double> found;
        std::istringstream parts(text);
        for (std::string part; std::getline(parts, part, ',');) {
            char* end = nullptr;
            found.push_back(std::strtod(part.c_str(), &end));
            if (*end) return {};
        }
        return found;
    }

public:
    std::vector<std::vector<double>> walls, ranges;

    Options(int n, char** words) {
        for (int k = 1; k < n; k++) {
            const std::string word = words[k], name = word.substr(0, word.find('='));
            const std::string value = word.substr(std::min(word.size(), name.size() + 1));
            if (name == "wall" || name == "range") {
                (name == "wall" ? walls : ranges).push_back(numbers(value));
                if (numbers(value).size() != (name == "wall" ? 4 : 3)) throw std::invalid_argument("wrong " + word);
                continue;
            }
            if (!values.count(name)) throw std::invalid_argument("There is no option '" + name + "'.");
            if (numbers(value).size() != numbers(values[name]).size())
                throw std::invalid_argument("Expected '" + name + "' like " + values[name] + ", got '" + value + "'.");
            values[name] = value;
        }
        for (const auto& [name, value] : values) parsed[name] = numbers(value);
    }
    const std::string& text(const std::string& name) const { return values.at(name); }
    const std::vector<double>& all(const std::string& name) const { return parsed.at(name); }
    double number(const std::string& name) const { return parsed.at(name).at(0); }
    bool lists(const std::string& name, const std::string& word) const {
        return ("," + text(name) + ",").find("," + word + ",") != std::string::npos;
    }
};

// ---- the robot in its arena

struct Command {
    double due, linear, angular;
};

class Body : public Enki::DifferentialWheeled {
public:
    bool has_touched = false;
    Body(double axle, double radius) : DifferentialWheeled(axle * CM, 1e9, 0) { setCylindric(radius * CM, HEIGHT_CM, MASS); }

protected:
    void collisionEvent(PhysicalObject*) override { has_touched = true; }
};

class Robot {
    const Options& options;
    Enki::World world;
    Body* body;
    const double dt, axle, max_wheel, timeout, lag, wheel_noise, odometry_noise;
    const std::vector<double> gains, scales;
    std::mt19937_64 of_wheels, of_sensors;  // so that noise of the wheels is the same with any sensors
    Command last{-1e9, 0, 0};
    double speeds[2] = {0, 0};

    static double normal(std::mt19937_64& random) { return std::normal_distribution<double>()(random); }
    double noise(double sd, double distance) {
        return sd > 0 && distance != 0 ? sd * std::sqrt(std::abs(distance)) * normal(of_wheels) : 0;
    }

public:
    uint64_t n_steps = 0;
    std::deque<Command> commands;
    std::vector<std::array<double, 4>> path;
    double odometry[3] = {0, 0, 0}, distance = 0, turned = 0;  // the last two since somebody set them to 0

    explicit Robot(const Options& o)
        : options(o), dt(o.number("step")), axle(o.number("axle")), max_wheel(o.number("max_wheel")),
          timeout(o.number("timeout")), lag(o.number("lag")), wheel_noise(o.number("wheel_noise")),
          odometry_noise(o.number("odometry_noise")), gains(o.all("gains")), scales(o.all("odometry_scale")) {
        if (!(dt > 0 && axle > 0)) throw std::invalid_argument("step and axle must be above 0.");
        for (const auto& w : o.walls) {
            auto* wall = new Enki::PhysicalObject;
            wall->setRectangular(std::hypot(w[2] - w[0], w[3] - w[1]) * CM, WALL_CM, HEIGHT_CM, -1);
            wall->pos = Enki::Point((w[0] + w[2]) / 2 * CM, (w[1] + w[3]) / 2 * CM);
            wall->angle = std::atan2(w[3] - w[1], w[2] - w[0]);
            world.addObject(wall);
        }
        world.addObject(body = new Body(axle, o.number("radius")));
        const auto start = o.all("start");
        place(start[0], start[1], start[2], uint64_t(o.number("seed")));
    }
    double now() const { return double(n_steps) * dt; }
    double x() const { return body->pos.x / CM; }
    double y() const { return body->pos.y / CM; }
    double heading() const { return body->angle; }
    const double* wheels() const { return speeds; }
    bool take_touch() { return std::exchange(body->has_touched, false); }
    double with_noise(double value, double sd) { return sd > 0 ? std::max(0.0, value + sd * normal(of_sensors)) : value; }

    void place(double x, double y, double heading, uint64_t seed) {
        of_wheels.seed(seed);
        of_sensors.seed(seed);
        commands.clear();
        last = {-1e9, 0, 0};
        speeds[0] = speeds[1] = body->leftSpeed = body->rightSpeed = body->angSpeed = 0;
        body->speed = Enki::Vector(0, 0);
        body->pos = Enki::Point(x * CM, y * CM);
        body->angle = heading;
        world.step(dt);  // the speeds that Enki holds end
        body->pos = Enki::Point(x * CM, y * CM);
        body->angle = heading;
        body->has_touched = false;
        if (options.number("odometry_restarts")) odometry[0] = odometry[1] = odometry[2] = 0;
        path = {{now(), x, y, heading}};
    }

    void step() {
        while (!commands.empty() && commands.front().due <= now()) {
            last = {now(), commands.front().linear, commands.front().angular};
            commands.pop_front();
        }
        const bool is_late = timeout > 0 && now() - last.due > timeout - dt / 2;
        double wheel[2], seen[2];
        for (int k = 0; k < 2; k++) {
            const double asked = is_late ? 0 : last.linear + (k ? 1 : -1) * last.angular * axle / 2;
            const double target = std::max(-max_wheel, std::min(max_wheel, asked)) * gains[k];
            speeds[k] += (target - speeds[k]) * (lag > 0 ? 1 - std::exp(-dt / lag) : 1);
            wheel[k] = speeds[k] * dt + noise(wheel_noise, speeds[k] * dt);
            seen[k] = wheel[k] * scales[k] + noise(odometry_noise, wheel[k]);
        }
        body->leftSpeed = wheel[0] / dt * CM;
        body->rightSpeed = wheel[1] / dt * CM;
        world.step(dt);
        n_steps++;
        const double ahead = (seen[0] + seen[1]) / 2, turn = (seen[1] - seen[0]) / axle;
        odometry[0] += ahead * std::cos(odometry[2] + turn / 2);
        odometry[1] += ahead * std::sin(odometry[2] + turn / 2);
        odometry[2] += turn;
        distance += ahead;
        turned += turn;
        const auto& point = path.back();
        const bool is_due = now() - point[0] > PATH_S - dt / 2 || (speeds[0] == 0 && speeds[1] == 0);
        if (is_due && (point[1] != x() || point[2] != y() || point[3] != heading()))
            path.push_back({now(), x(), y(), heading()});
    }

    // distance from a point in a direction to the nearest wall; infinite if there is none
    double ray(double x, double y, double angle) const {
        double nearest = INFINITY;
        const double c = std::cos(angle), s = std::sin(angle);
        for (const auto& w : options.walls) {
            const double ex = w[2] - w[0], ey = w[3] - w[1], across = c * ey - s * ex;
            if (across == 0) continue;
            const double away = ((w[0] - x) * ey - (w[1] - y) * ex) / across;
            const double along = ((w[0] - x) * s - (w[1] - y) * c) / across;
            if (away >= 0 && along >= 0 && along <= 1) nearest = std::min(nearest, away);
        }
        return nearest;
    }
    double cone(const std::vector<double>& mount, double width) const {
        const double c = std::cos(heading()), s = std::sin(heading());
        const double px = x() + c * mount[0] - s * mount[1], py = y() + s * mount[0] + c * mount[1];
        double nearest = INFINITY;
        for (int k = 0; k < CONE_RAYS; k++)
            nearest = std::min(nearest, ray(px, py, heading() + mount[2] + width * (double(k) / (CONE_RAYS - 1) - 0.5)));
        return nearest;
    }
};

// ---- the network

class Network {
    const Options& options;
    fast::DomainParticipant* participant;
    fast::Publisher* publisher;
    fast::Subscriber* subscriber;

    template <class Message> fast::Topic* topic(const std::string& name) {
        const std::string other = options.lists("renamed", name) ? "other_msgs::msg::dds_::Other_" : "";
        fast::TypeSupport type(new Type<Message>(other, options.text("byte_order") == "big"));
        if (type.register_type(participant) != ReturnCode_t::RETCODE_OK) throw std::runtime_error("A type is taken.");
        const std::string wire = "rt" + options.text("namespace") + "/" + name;
        return participant->create_topic(wire, type.get_type_name(), fast::TOPIC_QOS_DEFAULT);
    }
    fast::ReliabilityQosPolicyKind reliability(const std::string& name) const {
        const std::string kind = name.substr(0, name.find('_')) == "range" ? "range" : name;
        return options.lists("reliable", kind) ? fast::RELIABLE_RELIABILITY_QOS : fast::BEST_EFFORT_RELIABILITY_QOS;
    }

public:
    std::map<std::string, fast::DataWriter*> writers;
    std::map<std::string, fast::DataReader*> readers;

    explicit Network(const Options& o) : options(o) {
        fast::DomainParticipantQos qos;
        auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
        udp->interfaceWhiteList = {"127.0.0.1"};
        udp->maxInitialPeersRange = PEERS;
        udp->sendBufferSize = udp->receiveBufferSize = 4 << 20;
        qos.transport().use_builtin_transports = false;
        qos.transport().user_transports.push_back(udp);
        Locator_t here;
        IPLocator::setIPv4(here, 127, 0, 0, 1);
        auto& builtin = qos.wire_protocol().builtin;
        builtin.metatrafficUnicastLocatorList.push_back(here);  // instead of a multicast group
        builtin.initialPeersList.push_back(here);
        builtin.discovery_config.leaseDuration = {10, 0};
        builtin.discovery_config.leaseDuration_announcementperiod = {1, 0};
        qos.name("fast_dds_robot");
        participant = fast::DomainParticipantFactory::get_instance()->create_participant(uint32_t(o.number("domain")), qos);
        if (!participant) throw std::runtime_error("Fast DDS made no participant.");
        publisher = participant->create_publisher(fast::PUBLISHER_QOS_DEFAULT);
        subscriber = participant->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
        write_to<Odometry>("odom");
        write_to<LaserScan>("scan");
        write_to<Bool>("bumper");
        write_to<PoseStamped>("pose");
        for (size_t k = 0; k < o.ranges.size(); k++) {
            const std::string name = "range_" + std::to_string(k);
            o.number("variance") > 0 ? write_to<RangeWithVariance>(name) : write_to<Range>(name);
        }
        if (!o.text("twist_topic").empty()) read_from<Twist>(o.text("twist_topic"));
        if (!o.text("stamped_topic").empty()) read_from<TwistStamped>(o.text("stamped_topic"));
    }
    ~Network() {
        participant->delete_contained_entities();
        fast::DomainParticipantFactory::get_instance()->delete_participant(participant);
    }
    template <class Message> void write_to(const std::string& name) {
        const std::string kind = name.substr(0, name.find('_'));
        if (options.number("rate_" + kind) <= 0) return;
        fast::DataWriterQos qos;
        qos.reliability().kind = reliability(name);
        qos.history().depth = 10;
        qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::DYNAMIC_RESERVE_MEMORY_MODE;
        if (kind == "scan") qos.publish_mode().kind = fast::ASYNCHRONOUS_PUBLISH_MODE;  // in fragments, if it is long
        writers[name] = publisher->create_datawriter(topic<Message>(name), qos);
    }
    template <class Message> void read_from(const std::string& name) {
        fast::DataReaderQos qos;
        qos.reliability().kind = reliability(name);
        qos.history().depth = 1000;
        qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::DYNAMIC_RESERVE_MEMORY_MODE;
        readers[name] = subscriber->create_datareader(topic<Message>(name), qos);
    }
    template <class Message> bool take(const std::string& name, Message& message, double& received) {
        const auto reader = readers.find(name);
        fast::SampleInfo info;
        while (reader != readers.end() && reader->second->take_next_sample(&message, &info) == ReturnCode_t::RETCODE_OK)
            if (info.valid_data) {
                received = info.reception_timestamp.seconds() + info.reception_timestamp.nanosec() * 1e-9;
                return true;
            }
        return false;
    }
};

// ---- the program

class Program {
    const Options& options;
    Robot robot;
    std::unique_ptr<Network> network;
    const double began;  // the time of this computer [s] at which the robot's time was 0
    double shift, nothing;
    std::map<std::string, double> due, sent;  // the robot's time by topic
    std::set<std::string> muted;
    std::string readings = "true";
    size_t scan_rays;
    uint64_t n_twist = 0, n_stamped = 0, n_late = 0;
    double linear = 0, angular = 0;
    std::mutex lock;
    std::atomic<bool> is_over{false};

    static double clock_now() {
        return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
    }
    Header header(const std::string& frame) const {
        const double time = began + robot.now() + shift;
        Header made;
        made.stamp.sec = int32_t(std::floor(time));
        made.stamp.nanosec = uint32_t((time - std::floor(time)) * 1e9);
        made.frame_id = frame;
        return made;
    }
    static Pose pose(double x, double y, double heading) {
        Pose made;
        made.position = {x, y, 0};
        made.orientation = {0, 0, std::sin(heading / 2), std::cos(heading / 2)};
        return made;
    }
    float reading(double distance, double most, double sd) {
        if (readings != "true") return std::stof(readings);
        const double noisy = std::isinf(distance) ? distance : robot.with_noise(distance, sd);
        return float(noisy > most ? nothing : noisy);
    }

    void listen() {
        Twist twist;
        TwistStamped stamped;
        double received = 0;
        while (network->take(options.text("twist_topic"), twist, received)) {
            n_twist++;
            accept(twist, received);
        }
        while (network->take(options.text("stamped_topic"), stamped, received)) {
            n_stamped++;
            const double stamp = stamped.header.stamp.sec + stamped.header.stamp.nanosec * 1e-9 - shift;
            const double most = options.number("max_age");
            if (most > 0 && std::abs(received - stamp) > most) n_late++;
            else accept(stamped.twist, received);
        }
    }
    void accept(const Twist& twist, double received) {
        linear = twist.linear.x;
        angular = twist.angular.z;
        robot.commands.push_back({received - began + options.number("delay"), linear, angular});
    }

    void publish() {
        for (const auto& [name, writer] : network->writers) {
            const std::string kind = name.substr(0, name.find('_'));
            const double now = robot.now(), period = 1 / options.number("rate_" + kind);
            if (now < due[name] - 1e-9) continue;
            due[name] = std::max(due[name] + period, now - period);
            if (!muted.count(name)) publish(name, kind, writer, now - std::exchange(sent[name], now));
        }
    }
    void publish(const std::string& name, const std::string& kind, fast::DataWriter* writer, double seconds) {
        if (kind == "odom") {
            Odometry odometry;
            odometry.header = header("odom");
            odometry.child_frame_id = "base_link";
            odometry.pose = pose(robot.odometry[0], robot.odometry[1], robot.odometry[2]);
            odometry.twist.linear.x = seconds > 0 ? std::exchange(robot.distance, 0) / seconds : 0;
            odometry.twist.angular.z = seconds > 0 ? std::exchange(robot.turned, 0) / seconds : 0;
            writer->write(&odometry);
        } else if (kind == "scan") {
            const auto angles = options.all("scan_angles"), limits = options.all("scan_limits");
            LaserScan scan;
            scan.header = header("base_link");
            scan.angle_min = float(angles[0]);
            scan.angle_max = float(angles[1]);
            const double increment = scan_rays > 1 ? (angles[1] - angles[0]) / double(scan_rays - 1) : 0;
            scan.angle_increment = float(increment);
            scan.scan_time = float(1 / options.number("rate_scan"));
            scan.range_min = float(limits[0]);
            scan.range_max = float(limits[1]);
            scan.ranges.reserve(scan_rays);
            const double sd = options.number("scan_noise");
            for (size_t k = 0; k < scan_rays; k++) {
                const double angle = robot.heading() + angles[0] + double(k) * increment;
                scan.ranges.push_back(reading(robot.ray(robot.x(), robot.y(), angle), limits[1], sd));
            }
            writer->write(&scan);
        } else if (kind == "range") {
            const auto limits = options.all("range_limits");
            RangeWithVariance range;
            range.header = header(name);
            range.field_of_view = float(options.number("cone"));
            range.min_range = float(limits[0]);
            range.max_range = float(limits[1]);
            range.variance = float(options.number("variance"));
            const double distance = robot.cone(options.ranges[std::stoul(name.substr(6))], options.number("cone"));
            range.range = reading(distance, limits[1], options.number("range_noise"));
            writer->write(range.variance > 0 ? static_cast<void*>(&range) : static_cast<Range*>(&range));
        } else if (kind == "bumper") {
            Bool bumper;
            bumper.data = robot.take_touch();
            writer->write(&bumper);
        } else {
            PoseStamped stamped;
            stamped.header = header("map");
            stamped.pose = pose(robot.x(), robot.y(), robot.heading());
            writer->write(&stamped);
        }
    }

    std::string answer(std::istringstream& line) {
        std::ostringstream text;
        text.precision(17);
        std::string word, name;
        line >> word;
        if (word == "place") {
            double x, y, heading;
            uint64_t seed;
            if (!(line >> x >> y >> heading >> seed)) throw std::invalid_argument("expected x, y, heading, and seed");
            robot.place(x, y, heading, seed);
        } else if (word == "now") {
            text << robot.now();
        } else if (word == "pose") {
            text << "[" << robot.x() << "," << robot.y() << "," << robot.heading() << "]";
        } else if (word == "motors") {
            text << "[" << robot.wheels()[0] << "," << robot.wheels()[1] << "]";
        } else if (word == "path") {
            for (const auto& p : robot.path)
                text << (&p == &robot.path[0] ? "[[" : ",[") << p[0] << "," << p[1] << "," << p[2] << "," << p[3] << "]";
            text << "]";
        } else if (word == "commands") {
            text << "{\"twist\":" << n_twist << ",\"stamped\":" << n_stamped << ",\"refused\":" << n_late
                 << ",\"linear\":" << linear << ",\"angular\":" << angular << "}";
        } else if (word == "endpoints") {
            std::string between = "{";
            const auto add = [&](const std::string& topic, int matched, int incompatible) {
                text << std::exchange(between, ",") << '"' << topic << "\":[" << matched << "," << incompatible << "]";
            };
            fast::PublicationMatchedStatus heard;
            fast::SubscriptionMatchedStatus hears;
            fast::OfferedIncompatibleQosStatus offered;
            fast::RequestedIncompatibleQosStatus requested;
            if (network) {
                for (const auto& [topic, writer] : network->writers) {
                    writer->get_publication_matched_status(heard);
                    writer->get_offered_incompatible_qos_status(offered);
                    add(topic, heard.current_count, int(offered.total_count));
                }
                for (const auto& [topic, reader] : network->readers) {
                    reader->get_subscription_matched_status(hears);
                    reader->get_requested_incompatible_qos_status(requested);
                    add(topic, hears.current_count, int(requested.total_count));
                }
            }
            text << (between == "{" ? "{}" : "}");
        } else if (word == "shift") {
            if (!(line >> shift)) throw std::invalid_argument("expected seconds");
        } else if (word == "mute" && line >> name) {
            muted.insert(name);
        } else if (word == "unmute" && line >> name) {
            muted.erase(name);
        } else if (word == "scan_rays") {
            if (!(line >> scan_rays)) throw std::invalid_argument("expected a number of rays");
        } else if (word == "readings" && line >> name) {
            if (name != "true") std::stof(name);
            readings = name;
        } else if (word == "leave") {
            network.reset();
        } else if (word == "return") {
            if (!network) network = std::make_unique<Network>(options);
        } else {
            throw std::invalid_argument("there is no such command");
        }
        return text.str().empty() ? "null" : text.str();
    }
    void obey() {
        for (std::string text; std::getline(std::cin, text);) {
            std::istringstream line(text);
            std::string reply;
            try {
                const std::lock_guard<std::mutex> held(lock);
                reply = answer(line);
            } catch (const std::exception& error) {
                reply = std::string("{\"error\":\"") + error.what() + "\"}";
            }
            std::cout << reply << std::endl;
        }
        is_over = true;
    }

public:
    explicit Program(const Options& o)
        : options(o), robot(o), network(std::make_unique<Network>(o)), began(clock_now()), shift(o.number("clock_shift")),
          nothing(o.number("nothing")), scan_rays(size_t(o.number("scan_rays"))) {}

    void run() {
        std::thread obeying(&Program::obey, this);
        std::cout << "\"ready\"" << std::endl;
        for (const auto start = std::chrono::steady_clock::now(); !is_over;) {
            std::this_thread::sleep_until(start + std::chrono::duration<double>(robot.now() + options.number("step")));
            const std::lock_guard<std::mutex> held(lock);
            if (network) listen();
            robot.step();
            if (network) publish();
        }
        obeying.join();
    }
};

int main(int n, char** words) {
    try {
        const Options options(n, words);
        Program(options).run();
    } catch (const std::exception& error) {
        std::cout << "{\"error\":\"" << error.what() << "\"}" << std::endl;
        return 1;
    }
}
