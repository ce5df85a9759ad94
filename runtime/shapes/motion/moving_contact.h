// Finds the first contact of a path with a body that can be sampled at any position and time.
#pragma once

#include <algorithm>

#include "runtime/shapes/contact_walk.h"

namespace rapid {

// Returns the first contact of a path. Body has at(P, time, exact), which returns phi, gradient and vc, and rounding().
// Field is the field for ContactWalk, constructed from {body, path, level}.
template <class Field, class Body>
Contact first_contact_of(const Body& body, const Path& path)
{
    Field field{body, path, path.radius};
    const auto start = body.at(path.P, path.begin, field.exact_within(Exact::AtStart));
    const double f = start.phi - path.radius;
    const double flush = flush_within(path.P, path.radius, body.rounding());
    if (f < -flush) {
        Contact contact;
        const double slope = start.gradient.norm();
        contact.time = 0;
        contact.n = unit_normal(start.gradient, path.v - start.vc);
        contact.vc = start.vc;
        contact.depth = slope > 0 && !is_at_band_edge(start.phi, body.band(), body.voxel()) ? -f / slope : -f;
        return contact;
    }
    // A point slightly below the surface by rounding uses its own height as the level to touch at.
    field.level = path.radius + std::min(f, 0.0);
    ContactWalk walk(field, field.sample(0, std::max(f, 0.0), start), 0, path.duration);
    if (f <= flush) walk.leave_surface(2 * flush);
    return walk.walk();
}

}  // namespace rapid
