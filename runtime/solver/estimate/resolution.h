// The resolution of single precision at the positions of a scene's points.
#pragma once

#include <string>

#include "runtime/points/point_set.h"

namespace rapid {

// Returns the distance between neighbouring floats at x.
double spacing_at(float x);

struct Resolution {
    double coordinate = 0;      // m, the largest of any point
    double spacing = 0;         // m, between neighbouring positions there
    double h = 0;               // s, the frame's length
    bool loses_motion = false;  // a point moves by less than half the spacing in a frame, and so not at all
};

// Returns the resolution for a sample of the points. h: s, the frame's length.
Resolution resolution_of(const PointSet& points, double h);

// Returns the coarser one.
Resolution coarser(const Resolution& a, const Resolution& b);

// Returns a warning line if the resolution matters, else an empty string.
std::string text_of(const Resolution& resolution);

}  // namespace rapid
