// The contact forces on each point, as `:contact { record = true }` writes them to three attributes:
//
//   normalforce     N, the sum over the point's contacts of their normal impulses / time
//   frictionforce   N, the same of their tangential impulses
//   contactnum      contacts that press at the end of the frame
//
// Forces are means over the sub-steps of the frame in which the point is awake; a point that sleeps keeps those that it
// fell asleep under. Contacts are those with other points and with shapes.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/points/point_set.h"
#include "runtime/vec.h"

namespace rapid {

class Sleep;
struct Substep;

class ContactForces {
public:
    static constexpr const char* names[] = {"contactnum", "frictionforce", "normalforce"};

    explicit ContactForces(std::size_t size) : sums_(size) {}

    // Points of this radius above 0 are recorded.
    void include(std::span<const float> radii);
    void begin(const Substep& step, const Sleep* sleep);
    // Impulses on a point, N s. Points may be added to at the same time, each from one thread.
    void add(std::size_t i, double normal, double tangential)
    {
        sums_[i].normal += normal;
        sums_[i].tangential += tangential;
    }
    void add(std::size_t i, const Vec3d& n, const Vec3d& impulse)
    {
        const double normal = n.dot(impulse);
        add(i, std::abs(normal), (impulse - normal * n).norm());
    }
    // J: of friction on the point, and of what moves the shape that it touches.
    void add_work(std::size_t i, double friction, double shapes)
    {
        sums_[i].friction_work += friction;
        sums_[i].shape_work += shapes;
    }
    void count(std::size_t i) { ++sums_[i].contacts; }

    // J, of all points.
    double friction_work() const;
    double shape_work() const;
    // At the end of the frame, into the columns, which must exist.
    void store(PointSet& points) const;

private:
    struct Sum {
        double normal = 0, tangential = 0;         // N s
        double time = 0;                           // s
        double friction_work = 0, shape_work = 0;  // J
        std::int32_t contacts = 0;                 // in the last sub-step
        bool is_recorded = false;
    };
    std::vector<Sum> sums_;
};

// The parts along the normals, at least 0, of what several contacts gave a point together: the least squares of what is
// left, which is returned. Gauss-Seidel.
Vec3d split_impulse(const Vec3d& impulse, std::span<const Vec3d> normals, std::span<double> parts);

}  // namespace rapid
