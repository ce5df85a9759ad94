// What single precision resolves where the points of a scene are.
#pragma once

#include <string>

#include "runtime/points/point_set.h"

namespace rapid {

// The distance between neighbouring floats at x.
double spacing_at(float x);

struct Resolution {
    double coordinate = 0;      // m, the largest of a point
    double spacing = 0;         // m, between neighbouring positions there
    double h = 0;               // s, the frame's length
    bool loses_motion = false;  // a point moves by less than half the spacing in a frame, and so not at all
};

// Of a sample of the points. h: s, the frame's length.
Resolution resolution_of(const PointSet& points, double h);

// The coarser one.
Resolution coarser(const Resolution& a, const Resolution& b);

// A line that says so where it matters; else empty.
std::string text_of(const Resolution& resolution);

}  // namespace rapid
