// Reads the fields of a page's request, each checked against its type and its range. All functions throw if a field has
// another type, or a value that is refused; the error names a valid value.
#pragma once

#include <cstdint>
#include <string>

#include "bindings/view/frame_message.h"
#include "include/rapid/scene.h"
#include "runtime/base/json.h"

namespace rapid {

// Lists and objects nested deeper than eight levels are skipped. Throws Error unless the message is a JSON object.
CheckedJson parse_request(const std::string& message);

// A frame that can be computed: one from first to last.
std::int64_t frame_of(const CheckedJson& request, const char* name, std::int64_t first, std::int64_t last);

// width and height, from 16 to 16384 pixels.
PictureSize size_of(const CheckedJson& request);

// camera: position, target, vertical angle in degrees. Without one, the camera is fitted.
PictureCamera camera_of(const CheckedJson& request);

// colour, group, velocities, most.
FrameOptions frame_options_of(const CheckedJson& request);

}  // namespace rapid
