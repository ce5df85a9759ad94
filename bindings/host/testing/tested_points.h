// The points of a scene's frame, as a test has them.
#pragma once

#include <string>
#include <unordered_map>

#include "runtime/points/point_set.h"

namespace rapid {

struct TestedPoints {
    PointSet set;
    std::string source;                                    // for messages: "frame 48", "frame 48, output sparks"
    std::unordered_map<std::int64_t, std::size_t> places;  // by id; made when first asked for
};

// A value as its numbers: 1, 3 (vec3), 4 (quaternion, x y z w) or none (a text).
struct Numbers {
    int count = 1;
    double x[4] = {};
};
inline Numbers numbers_of(const Vec3f& v) { return {3, {v.x(), v.y(), v.z()}}; }
inline Numbers numbers_of(const Quatf& q) { return {4, {q.x(), q.y(), q.z(), q.w()}}; }
inline Numbers numbers_of(Token) { return {0}; }
template <class T>
Numbers numbers_of(T value)
{
    return {1, {static_cast<double>(value)}};
}

}  // namespace rapid
