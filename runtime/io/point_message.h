// Points in a message between processes (files/read_apart.h).
#pragma once

#include "runtime/files/message.h"
#include "runtime/points/point_set.h"

namespace rapid {

void send_points(const PointSet& points, MessageWriter& message);
// Throws Error if the message does not contain a valid set of points.
PointSet receive_points(MessageReader& message);

}  // namespace rapid
