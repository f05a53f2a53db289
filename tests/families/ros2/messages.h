// Messages of ROS 2, with the type names and the order of members that ROS 2 gives them on the wire.
//
// Fast CDR writes and reads the bytes, as in ROS 2's own rmw_fastrtps, which has such serializers, too. So the generator
// fastddsgen and its Java runtime are not needed.

#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <type_traits>
#include <vector>

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fastdds/dds/topic/TopicDataType.hpp>

#define MEMBERS(...) \
    template <class Each> void members(Each&& each) { each(__VA_ARGS__); }
#define NAME(package, type) \
    static constexpr const char* name = package "::msg::dds_::" type "_"

struct Time {
    int32_t sec = 0;
    uint32_t nanosec = 0;
    MEMBERS(sec, nanosec)
};

struct Header {
    Time stamp;
    std::string frame_id;
    MEMBERS(stamp, frame_id)
};

struct Bool {
    NAME("std_msgs", "Bool");
    bool data = false;
    MEMBERS(data)
};

struct Vector3 {
    double x = 0, y = 0, z = 0;
    MEMBERS(x, y, z)
};

struct Quaternion {
    double x = 0, y = 0, z = 0, w = 1;
    MEMBERS(x, y, z, w)
};

struct Twist {
    NAME("geometry_msgs", "Twist");
    Vector3 linear, angular;
    MEMBERS(linear, angular)
};

struct TwistStamped {
    NAME("geometry_msgs", "TwistStamped");
    Header header;
    Twist twist;
    MEMBERS(header, twist)
};

struct Pose {
    Vector3 position;
    Quaternion orientation;
    MEMBERS(position, orientation)
};

struct PoseStamped {
    NAME("geometry_msgs", "PoseStamped");
    Header header;
    Pose pose;
    MEMBERS(header, pose)
};

struct Odometry {
    NAME("nav_msgs", "Odometry");
    Header header;
    std::string child_frame_id;
    Pose pose;
    std::array<double, 36> pose_covariance{};
    Twist twist;
    std::array<double, 36> twist_covariance{};
    MEMBERS(header, child_frame_id, pose, pose_covariance, twist, twist_covariance)
};

struct LaserScan {
    NAME("sensor_msgs", "LaserScan");
    Header header;
    float angle_min = 0, angle_max = 0, angle_increment = 0, time_increment = 0, scan_time = 0, range_min = 0, range_max = 0;
    std::vector<float> ranges, intensities;
    MEMBERS(header, angle_min, angle_max, angle_increment, time_increment, scan_time, range_min, range_max, ranges,
            intensities)
};

struct Range {
    NAME("sensor_msgs", "Range");
    Header header;
    uint8_t radiation_type = 1;  // infrared
    float field_of_view = 0, min_range = 0, max_range = 0, range = 0;
    MEMBERS(header, radiation_type, field_of_view, min_range, max_range, range)
};

struct RangeWithVariance : Range {  // since ROS 2 Iron
    float variance = 0;
    MEMBERS(header, radiation_type, field_of_view, min_range, max_range, range, variance)
};

template <class T> constexpr bool is_plain = std::is_arithmetic_v<T>;  // for Fast CDR
template <class T> constexpr bool is_plain<std::vector<T>> = true;
template <class T, size_t n> constexpr bool is_plain<std::array<T, n>> = true;
template <> inline constexpr bool is_plain<std::string> = true;

template <bool writes> struct Coder {
    eprosima::fastcdr::Cdr& cdr;
    template <class... T> void operator()(T&... members) { (code(members), ...); }
    template <class T> void code(T& member) {
        if constexpr (!is_plain<T>) member.members(*this);
        else if constexpr (writes) cdr << member;
        else cdr >> member;
    }
};

struct Sizer {  // with the most padding that there can be
    size_t bytes = 4;
    template <class... T> void operator()(T&... members) { (add(members), ...); }
    template <class T> void add(T& member) {
        if constexpr (std::is_arithmetic_v<T>) bytes += 2 * sizeof member;
        else if constexpr (is_plain<T>) bytes += 16 + member.size() * sizeof(member[0]);
        else member.members(*this);
    }
};

// What Fast DDS asks about a type.
template <class Message> class Type : public eprosima::fastdds::dds::TopicDataType {
    using Payload = eprosima::fastrtps::rtps::SerializedPayload_t;
    using Cdr = eprosima::fastcdr::Cdr;
    bool is_big;

public:
    Type(const std::string& other_name, bool is_big) : is_big(is_big) {
        setName(other_name.empty() ? Message::name : other_name.c_str());
        m_typeSize = 1024;  // more is allocated for those that are longer
        m_isGetKeyDefined = false;
    }
    bool serialize(void* data, Payload* payload) override {
        eprosima::fastcdr::FastBuffer buffer(reinterpret_cast<char*>(payload->data), payload->max_size);
        Cdr cdr(buffer, is_big ? Cdr::BIG_ENDIANNESS : Cdr::LITTLE_ENDIANNESS, Cdr::DDS_CDR);
        payload->encapsulation = is_big ? CDR_BE : CDR_LE;
        try {
            cdr.serialize_encapsulation();
            static_cast<Message*>(data)->members(Coder<true>{cdr});
        } catch (eprosima::fastcdr::exception::Exception&) {
            return false;
        }
        payload->length = uint32_t(cdr.getSerializedDataLength());
        return true;
    }
    bool deserialize(Payload* payload, void* data) override {
        eprosima::fastcdr::FastBuffer buffer(reinterpret_cast<char*>(payload->data), payload->length);
        Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
        try {
            cdr.read_encapsulation();
            static_cast<Message*>(data)->members(Coder<false>{cdr});
        } catch (eprosima::fastcdr::exception::Exception&) {
            return false;
        }
        return true;
    }
    std::function<uint32_t()> getSerializedSizeProvider(void* data) override {
        return [data] {
            Sizer sizer;
            static_cast<Message*>(data)->members(sizer);
            return uint32_t(sizer.bytes);
        };
    }
    void* createData() override { return new Message; }
    void deleteData(void* data) override { delete static_cast<Message*>(data); }
    bool getKey(void*, eprosima::fastrtps::rtps::InstanceHandle_t*, bool) override { return false; }
};
