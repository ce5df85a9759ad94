#include "bindings/view/request_fields.h"

#include <fmt/format.h>

#include <array>
#include <vector>

#include "runtime/base/error.h"

namespace rapid {
namespace {

constexpr int max_depth = 8;  // of lists: copying deeper ones would overflow the stack
constexpr int min_edge = 16, max_edge = 16384;

int edge_of(const CheckedJson& request, const char* name, int usual)
{
    const int edge = request.value(name, usual);
    if (edge < min_edge || edge > max_edge)
        throw Error(fmt::format("{} = {}; it must be from {} to {} pixels", name, edge, min_edge, max_edge));
    return edge;
}

}  // namespace

CheckedJson parse_request(const std::string& message)
{
    const auto is_shallow = [](int depth, CheckedJson::parse_event_t, CheckedJson&) { return depth <= max_depth; };
    CheckedJson request = CheckedJson::parse(message, is_shallow, false);
    if (!request.is_object()) throw Error("a request must be a JSON object");
    return request;
}

std::int64_t frame_of(const CheckedJson& request, const char* name, std::int64_t first, std::int64_t last)
{
    const auto frame = request.at(name).get<std::int64_t>();
    if (frame < first || frame > last)
        throw Error(fmt::format("{} = {}; it must be a frame from {} to {}", name, frame, first, last));
    return frame;
}

PictureSize size_of(const CheckedJson& request)
{
    return {edge_of(request, "width", 1280), edge_of(request, "height", 720)};
}

PictureCamera camera_of(const CheckedJson& request)
{
    if (!request.contains("camera")) return {};
    const auto camera = request["camera"].get<std::vector<double>>();
    if (camera.size() != 7)
        throw Error(fmt::format("camera has {} numbers; it must have 7: position, target, angle", camera.size()));
    return {std::array{camera[0], camera[1], camera[2]}, std::array{camera[3], camera[4], camera[5]}, camera[6]};
}

FrameOptions frame_options_of(const CheckedJson& request)
{
    FrameOptions frame_options;
    frame_options.colour = request.value("colour", "");
    frame_options.group = request.value("group", "");
    frame_options.velocities = request.value("velocities", false);
    frame_options.most = request.value("most", frame_options.most);
    return frame_options;
}

}  // namespace rapid
