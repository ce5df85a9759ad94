#include "bindings/view/frame_message.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

#include "runtime/error.h"
#include "runtime/graph/evaluation.h"

namespace rapid {
namespace {

using nlohmann::ordered_json;

// Puts arrays behind one another, and their places into the header.
class Message {
public:
    explicit Message(ordered_json header) : header_(std::move(header)) { header_["arrays"] = ordered_json::object(); }

    ordered_json& header() { return header_; }

    // An array to be filled; valid until the next one is added.
    template <class T>
    std::span<T> add(const char* name, const char* type, std::size_t count)
    {
        const std::size_t begin = data_.size();
        header_["arrays"][name] = {{"type", type}, {"begin", begin}, {"count", count}};
        data_.resize(begin + (count * sizeof(T) + 3) / 4 * 4);
        return {reinterpret_cast<T*>(data_.data() + begin), count};
    }

    std::string finish(std::uint32_t request) const
    {
        std::string head = header_.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
        head.resize((head.size() + 3) / 4 * 4, ' ');
        const std::uint32_t words[2] = {request, static_cast<std::uint32_t>(head.size())};
        std::string all(sizeof words + head.size() + data_.size(), '\0');
        std::memcpy(all.data(), words, sizeof words);
        std::memcpy(all.data() + sizeof words, head.data(), head.size());
        std::memcpy(all.data() + sizeof words + head.size(), data_.data(), data_.size());
        return all;
    }

private:
    ordered_json header_;
    std::vector<char> data_;
};

// The finite values' least and largest; 0 and 0 where there are none.
std::pair<float, float> range_of(std::span<const float> values)
{
    float low = std::numeric_limits<float>::infinity(), high = -low;
    for (const float value : values) {
        if (!std::isfinite(value)) continue;
        low = std::min(low, value);
        high = std::max(high, value);
    }
    return low <= high ? std::pair(low, high) : std::pair(0.0f, 0.0f);
}

std::uint16_t quantised(float value, float low, float scale)
{
    const float part = (value - low) * scale;
    return static_cast<std::uint16_t>(part > 0 ? std::min(part + 0.5f, 65535.0f) : 0.0f);  // NaN: 0
}

void add_positions(Message& message, const PointSet& points, const ShownPoints& shown)
{
    const Strided<Vec3f> P = points.P().read();
    Vec3f low = Vec3f::Constant(std::numeric_limits<float>::infinity()), high = -low;
    for (std::size_t k = 0; k < shown.count; ++k) {
        const Vec3f& p = P[shown[k]];
        low = low.cwiseMin(p);
        high = high.cwiseMax(p);
    }
    if (shown.count == 0) low = high = Vec3f::Zero();
    message.header()["box"] = {{low.x(), low.y(), low.z()}, {high.x(), high.y(), high.z()}};
    Vec3f scale;
    for (int axis = 0; axis < 3; ++axis) scale[axis] = high[axis] > low[axis] ? 65535 / (high[axis] - low[axis]) : 0;
    const std::span<std::uint16_t> to = message.add<std::uint16_t>("P", "u16", 3 * shown.count);
    for (std::size_t k = 0; k < shown.count; ++k) {
        const Vec3f& p = P[shown[k]];
        for (int axis = 0; axis < 3; ++axis) to[3 * k + axis] = quantised(p[axis], low[axis], scale[axis]);
    }
}

void add_velocities(Message& message, const PointSet& points, const ShownPoints& shown)
{
    const Strided<Vec3f> v = points.v().read();
    float most = 0;
    for (std::size_t k = 0; k < shown.count; ++k) most = std::max(most, v[shown[k]].cwiseAbs().maxCoeff());
    message.header()["fastest"] = most;
    const float scale = most > 0 ? 32767 / most : 0;
    const std::span<std::int16_t> to = message.add<std::int16_t>("v", "i16", 3 * shown.count);
    for (std::size_t k = 0; k < shown.count; ++k)
        for (int axis = 0; axis < 3; ++axis)
            to[3 * k + axis] = static_cast<std::int16_t>(std::lround(v[shown[k]][axis] * scale));
}

void add_values(Message& message, const char* name, std::span<const float> values, const ShownPoints& shown)
{
    const auto [low, high] = range_of(values);
    message.header()["ranges"][name] = {low, high};
    const float scale = high > low ? 65535 / (high - low) : 0;
    const std::span<std::uint16_t> to = message.add<std::uint16_t>(name, "u16", shown.count);
    for (std::size_t k = 0; k < shown.count; ++k) to[k] = quantised(values[shown[k]], low, scale);
}

void add_colours(Message& message, const PointSet& points, const FrameWish& wish, const ShownPoints& shown)
{
    const auto* Cd = points.find<Vec3f>("Cd");
    if (Cd && (wish.colour.empty() || wish.colour == "Cd")) {
        message.header()["colour"] = "Cd";
        const std::span<std::uint8_t> to = message.add<std::uint8_t>("colour", "u8", 3 * shown.count);
        const Strided<Vec3f> from = Cd->read();
        for (std::size_t k = 0; k < shown.count; ++k)
            for (int axis = 0; axis < 3; ++axis)
                to[3 * k + axis] =
                    static_cast<std::uint8_t>(std::lround(255 * std::clamp(from[shown[k]][axis], 0.0f, 1.0f)));
        return;
    }
    const std::string name = wish.colour.empty() ? "speed" : wish.colour;
    message.header()["colour"] = name;
    add_values(message, "value", numbers_of(points, name), shown);
}

}  // namespace

std::vector<float> numbers_of(const PointSet& points, const std::string& name)
{
    std::vector<float> numbers(points.size());
    if (name == "speed" && !points.has("speed")) {
        const Strided<Vec3f> v = points.v().read();
        for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = v[i].norm();
        return numbers;
    }
    if (name.starts_with(group_prefix)) {
        const Column<std::uint8_t>* members = points.find_group(name.substr(group_prefix.size()));
        if (!members)
            throw Error(fmt::format("the points have no group \"{}\" here", name.substr(group_prefix.size())));
        for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = (*members)[i];
        return numbers;
    }
    const AnyColumn* column = points.find(name);
    if (!column) throw Error(fmt::format("the points have no attribute \"{}\" here", name));
    std::visit(
        [&](const auto& values) {
            const auto from = values.read();
            using T = std::decay_t<decltype(values[0])>;
            for (std::size_t i = 0; i < numbers.size(); ++i) {
                if constexpr (std::is_same_v<T, Vec3f>)
                    numbers[i] = from[i].norm();
                else if constexpr (std::is_same_v<T, Quatf>)
                    numbers[i] = from[i].w();
                else
                    numbers[i] = static_cast<float>(from[i]);
            }
        },
        *column);
    return numbers;
}

ShownPoints shown_points(const PointSet& points, const FrameWish& wish)
{
    ShownPoints shown;
    shown.count = points.size();
    if (wish.group.empty() && points.size() <= wish.most) return shown;
    const Column<std::uint8_t>* members = nullptr;
    if (!wish.group.empty()) {
        members = points.find_group(wish.group);
        if (!members) throw Error(fmt::format("the points have no group \"{}\" here", wish.group));
    }
    std::vector<std::uint32_t> places;
    for (std::uint32_t i = 0; i < points.size(); ++i)
        if (!members || (*members)[i]) places.push_back(i);
    // By id, so that the same points are shown in every frame.
    const Strided<std::int64_t> id = points.id().read();
    while (places.size() > wish.most) {
        shown.every *= 2;
        std::erase_if(places, [&](std::uint32_t i) { return static_cast<std::uint64_t>(id[i]) % shown.every != 0; });
    }
    shown.count = places.size();
    shown.places = std::move(places);
    return shown;
}

std::string frame_message(std::uint32_t request, const PointSet& points, const FrameWish& wish, const std::string& head)
{
    Message message(ordered_json::parse(head));
    const ShownPoints shown = shown_points(points, wish);
    message.header()["total"] = points.size();
    message.header()["shown"] = shown.count;
    message.header()["every"] = shown.every;
    add_positions(message, points, shown);
    add_colours(message, points, wish, shown);
    if (const auto* pscale = points.find<float>("pscale")) {
        if (pscale->is_uniform())
            message.header()["radius"] = points.empty() ? 0.0f : (*pscale)[0];
        else
            add_values(message, "radius", numbers_of(points, "pscale"), shown);
    }
    if (wish.velocities) add_velocities(message, points, shown);
    return message.finish(request);
}

std::string trails_message(std::uint32_t request, const std::vector<float>& ends, std::uint64_t every)
{
    Message message(ordered_json({{"every", every}}));
    const std::span<float> to = message.add<float>("ends", "f32", ends.size());
    std::copy(ends.begin(), ends.end(), to.begin());
    return message.finish(request);
}

std::string shapes_message(std::uint32_t request, const PictureScene& scene, const std::set<std::uint64_t>& known,
                           const std::vector<std::uint64_t>& numbers)
{
    Message message(ordered_json::object());
    ordered_json bodies = ordered_json::array(), planes = ordered_json::array();
    for (const PictureScene::Plane& plane : scene.planes)
        planes.push_back(
            {{"normal", {plane.normal.x(), plane.normal.y(), plane.normal.z()}}, {"offset", plane.offset}});
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
        const PictureScene::Body& body = scene.bodies[b];
        bodies.push_back(
            {{"mesh", numbers[b]}, {"role", body.role == PictureScene::Body::Collider ? "collider" : "emitter"}});
        if (known.contains(numbers[b])) continue;
        const Mesh& mesh = *body.mesh;
        const std::string name = std::to_string(numbers[b]);
        const std::span<float> places = message.add<float>(("P" + name).c_str(), "f32", 3 * mesh.positions.size());
        std::memcpy(places.data(), mesh.positions.data(), places.size_bytes());
        const std::span<std::uint32_t> corners =
            message.add<std::uint32_t>(("T" + name).c_str(), "u32", 3 * mesh.triangles.size());
        std::memcpy(corners.data(), mesh.triangles.data(), corners.size_bytes());
    }
    message.header()["bodies"] = std::move(bodies);
    message.header()["planes"] = std::move(planes);
    return message.finish(request);
}

}  // namespace rapid
