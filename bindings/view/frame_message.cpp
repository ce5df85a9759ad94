#include "bindings/view/frame_message.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <numeric>

#include "runtime/error.h"
#include "runtime/graph/evaluation.h"
#include "runtime/io/text_table.h"

namespace rapid {
namespace {

using nlohmann::ordered_json;

// Puts arrays behind one another, and their places into the header. They are written where they are sent from: a frame
// of a million points has eight megabytes, and each copy of them takes milliseconds.
class Message {
public:
    explicit Message(ordered_json header) : header_(std::move(header)) { header_["arrays"] = ordered_json::object(); }

    ordered_json& header() { return header_; }

    // An array that fill(std::span<T>) writes, in finish().
    template <class T, class F>
    void add(const std::string& name, const char* type, std::size_t count, F fill)
    {
        header_["arrays"][name] = {{"type", type}, {"begin", size_}, {"count", count}};
        arrays_.push_back([begin = size_, count, fill = std::move(fill)](char* data) {
            fill(std::span<T>(reinterpret_cast<T*>(data + begin), count));
        });
        size_ += (count * sizeof(T) + 3) / 4 * 4;
    }

    std::string finish(std::uint32_t request) const
    {
        std::string head = header_.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
        head.resize((head.size() + 3) / 4 * 4, ' ');
        const std::uint32_t words[2] = {request, static_cast<std::uint32_t>(head.size())};
        std::string all;
        all.reserve(sizeof words + head.size() + size_);
        all.append(reinterpret_cast<const char*>(words), sizeof words);
        all += head;
        all.resize(all.size() + size_);
        for (const auto& fill : arrays_) fill(all.data() + sizeof words + head.size());
        return all;
    }

private:
    ordered_json header_;
    std::vector<std::function<void(char* data)>> arrays_;
    std::size_t size_ = 0;
};

// Whole numbers for values between low and high: from `first` to the largest of 16 bits. What is not a number, or
// below, gets the least.
struct WordScale {
    float low, factor, first = 0;

    WordScale(float from, float to, float least = 0)
        : low(from), factor(to > from ? (65535 - least) / (to - from) : 0), first(least)
    {
    }
    std::uint16_t operator()(float value) const
    {
        const float place = (value - low) * factor;
        return static_cast<std::uint16_t>(first + (place > 0 ? std::min(place + 0.5f, 65535 - first) : 0.0f));
    }
};

// So many floats are taken at once: a whole number of vectors, and of triples.
constexpr std::size_t period = 48;

// Of values that take turns, as x, y and z do, each one's least and largest; 0 and 0 where none is finite.
template <std::size_t turns>
std::array<std::pair<float, float>, turns> ranges_of(std::span<const float> values)
{
    static_assert(period % turns == 0);
    constexpr float infinity = std::numeric_limits<float>::infinity();
    std::array<float, period> low, high;
    low.fill(infinity);
    high.fill(-infinity);
    // Without branches, and each into a place of its own: the loop is vectorised, 11 times as fast for a million
    // points.
    const auto take = [&](const float* from, std::size_t count) {
        for (std::size_t j = 0; j < count; ++j) {
            const bool is_finite = std::abs(from[j]) < infinity;  // files may have others
            low[j] = is_finite && from[j] < low[j] ? from[j] : low[j];
            high[j] = is_finite && from[j] > high[j] ? from[j] : high[j];
        }
    };
    std::size_t begin = 0;
    for (; begin + period <= values.size(); begin += period) take(values.data() + begin, period);
    take(values.data() + begin, values.size() - begin);
    std::array<std::pair<float, float>, turns> ranges;
    for (std::size_t k = 0; k < turns; ++k) {
        for (std::size_t j = k + turns; j < period; j += turns) {
            low[k] = std::min(low[k], low[j]);
            high[k] = std::max(high[k], high[j]);
        }
        ranges[k] = low[k] <= high[k] ? std::pair(low[k], high[k]) : std::pair(0.0f, 0.0f);
    }
    return ranges;
}

// The points that are shown, where these are not all with what is shown of them.
PointSet shown_of(const PointSet& points, const ShownPoints& shown, const FrameWish& wish)
{
    if (!shown.places) return points;
    PointSet needed = points;  // shares the columns
    for (const std::string& name : points.column_names())
        if (name != "P" && name != "v" && name != "id" && name != "Cd" && name != "pscale" && name != wish.colour)
            needed.remove(name);
    for (const std::string& name : points.group_names())
        if (group_prefix + name != wish.colour) needed.remove_group(name);
    return needed.select(*shown.places);
}

void add_positions(Message& message, const PointSet& points)
{
    const Strided<Vec3f> P = points.P().read();
    const std::size_t count = points.size();
    const auto* values = reinterpret_cast<const float*>(P.data);
    const auto ranges = ranges_of<3>({values, 3 * (P.stride == 0 ? std::min<std::size_t>(count, 1) : count)});
    const Vec3f low(ranges[0].first, ranges[1].first, ranges[2].first);
    const Vec3f high(ranges[0].second, ranges[1].second, ranges[2].second);
    message.header()["box"] = {{low.x(), low.y(), low.z()}, {high.x(), high.y(), high.z()}};
    message.add<std::uint16_t>("P", "u16", 3 * count, [=](std::span<std::uint16_t> to) {
        std::array<float, period> from{}, factor{};
        for (std::size_t j = 0; j < period; ++j) {
            const auto axis = static_cast<Eigen::Index>(j % 3);
            from[j] = low[axis];
            factor[j] = WordScale(low[axis], high[axis]).factor;
        }
        const auto quantise = [&](const float* source, std::size_t begin, std::size_t n) {
            for (std::size_t j = 0; j < n; ++j) {
                const float place = (source[j] - from[j]) * factor[j] + 0.5f;
                const float bounded = place > 0 ? std::min(place, 65535.0f) : 0;  // not a number: 0
                to[begin + j] = static_cast<std::uint16_t>(static_cast<std::int32_t>(bounded));
            }
        };
        if (P.stride == 0) {
            for (std::size_t k = 0; k < count; ++k) quantise(values, 3 * k, 3);
            return;
        }
        std::size_t begin = 0;
        for (; begin + period <= to.size(); begin += period) quantise(values + begin, begin, period);
        quantise(values + begin, begin, to.size() - begin);
    });
}

void add_velocities(Message& message, const PointSet& points)
{
    const Strided<Vec3f> v = points.v().read();
    float most = 0;
    for (std::size_t k = 0; k < points.size(); ++k) most = std::max(most, v[k].cwiseAbs().maxCoeff());
    message.header()["fastest"] = most;
    const float scale = most > 0 ? 32767 / most : 0;
    message.add<std::int16_t>("v", "i16", 3 * points.size(), [=, count = points.size()](std::span<std::int16_t> to) {
        for (std::size_t k = 0; k < count; ++k)
            for (int axis = 0; axis < 3; ++axis)
                to[3 * k + axis] = static_cast<std::int16_t>(std::lround(v[k][axis] * scale));
    });
}

void add_values(Message& message, const char* name, std::vector<float> values, bool is_flag = false)
{
    auto [low, high] = ranges_of<1>(values)[0];
    if (is_flag) {  // 0 and 1 keep their colours where all points are the same
        low = std::min(low, 0.0f);
        high = std::max(high, 1.0f);
    }
    message.header()["ranges"][name] = {low, high};
    std::size_t unknown = 0;
    for (const float value : values) unknown += std::isnan(value);
    message.header()["unknown"][name] = unknown;
    // 0 is kept for those without a value, where there are some.
    const WordScale scale(low, high, unknown > 0 ? 1 : 0);
    const std::size_t count = values.size();
    message.add<std::uint16_t>(name, "u16", count, [=, values = std::move(values)](std::span<std::uint16_t> to) {
        for (std::size_t k = 0; k < count; ++k) to[k] = scale(values[k]);
        for (std::size_t k = 0; unknown > 0 && k < count; ++k)
            if (std::isnan(values[k])) to[k] = 0;
    });
}

void add_colours(Message& message, const PointSet& points, const FrameWish& wish)
{
    const auto* Cd = points.find<Vec3f>("Cd");
    if (Cd && (wish.colour.empty() || wish.colour == "Cd")) {
        message.header()["colour"] = "Cd";
        message.add<std::uint8_t>("colour", "u8", 3 * points.size(), [from = Cd->read()](std::span<std::uint8_t> to) {
            const auto* values = reinterpret_cast<const float*>(from.data);
            const std::size_t same = from.stride == 0 ? 3 : to.size();  // values that are not repeated
            // Over single numbers, without branches: the loop is vectorised.
            for (std::size_t j = 0; j < std::min(same, to.size()); ++j) {
                const float bounded = values[j] > 0 ? std::min(values[j], 1.0f) : 0;  // not a number: 0
                to[j] = static_cast<std::uint8_t>(static_cast<std::int32_t>(255 * bounded + 0.5f));
            }
            for (std::size_t j = same; j < to.size(); ++j) to[j] = to[j - 3];
        });
        return;
    }
    const std::string name = wish.colour.empty() ? "speed" : wish.colour;
    message.header()["colour"] = name;
    add_values(message, "value", numbers_of(points, name), name.starts_with(group_prefix) || name == "asleep");
}

}  // namespace

// The place of each text among those of the points, in the order of the alphabet.
std::vector<float> ranks_of(const Column<Token>& column)
{
    const TextTable table = text_table(column);
    std::vector<std::size_t> order(table.texts.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return table.texts[a].text() < table.texts[b].text(); });
    std::vector<float> rank(order.size());
    for (std::size_t k = 0; k < order.size(); ++k) rank[order[k]] = static_cast<float>(k);
    std::vector<float> ranks(column.size());
    for (std::size_t i = 0; i < ranks.size(); ++i) ranks[i] = rank[static_cast<std::size_t>(table.places[i])];
    return ranks;
}

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
    if (const auto* texts = std::get_if<Column<Token>>(column)) return ranks_of(*texts);
    std::visit(
        [&](const auto& values) {
            const auto from = values.read();
            using T = std::decay_t<decltype(values[0])>;
            for (std::size_t i = 0; i < numbers.size(); ++i) {
                if constexpr (std::is_same_v<T, Vec3f>)
                    numbers[i] = from[i].norm();
                else if constexpr (std::is_same_v<T, Quatf>)
                    numbers[i] = from[i].w();
                else if constexpr (std::is_arithmetic_v<T>)
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
        if (shown.every > UINT64_MAX / 2) {  // files of others may have many points of one id
            places.resize(wish.most);
            break;
        }
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
    const PointSet some = shown_of(points, shown, wish);
    message.header()["total"] = points.size();
    message.header()["shown"] = shown.count;
    message.header()["every"] = shown.every;
    add_positions(message, some);
    add_colours(message, some, wish);
    if (const auto* pscale = some.find<float>("pscale")) {
        if (pscale->is_uniform())
            message.header()["radius"] = points.empty() ? 0.0f : (*pscale)[0];
        else
            add_values(message, "radius", numbers_of(some, "pscale"));
    }
    if (wish.velocities) add_velocities(message, some);
    return message.finish(request);
}

std::string trails_message(std::uint32_t request, const std::vector<float>& ends, std::uint64_t every)
{
    Message message(ordered_json({{"every", every}}));
    message.add<float>("ends", "f32", ends.size(),
                       [&](std::span<float> to) { std::copy(ends.begin(), ends.end(), to.begin()); });
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
        message.add<float>("P" + name, "f32", 3 * mesh.positions.size(), [&](std::span<float> to) {
            std::memcpy(to.data(), mesh.positions.data(), to.size_bytes());
        });
        message.add<std::uint32_t>("T" + name, "u32", 3 * mesh.triangles.size(), [&](std::span<std::uint32_t> to) {
            std::memcpy(to.data(), mesh.triangles.data(), to.size_bytes());
        });
    }
    message.header()["bodies"] = std::move(bodies);
    message.header()["planes"] = std::move(planes);
    return message.finish(request);
}

}  // namespace rapid
