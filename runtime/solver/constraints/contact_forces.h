// The contact forces on each point, as `:contact { record = true }` writes them to three attributes:
//
//   normalforce     N, the sum over the point's contacts of normal impulse / time
//   frictionforce   N, the same for tangential impulses
//   contactnum      contacts under pressure at the end of the frame
//
// Forces are means over the substeps of the frame in which the point is awake. A sleeping point keeps the values with
// which it fell asleep. Contacts with other points and with shapes both count.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/math/vec.h"
#include "runtime/points/point_set.h"

namespace rapid {

class Sleep;
struct Substep;

class ContactForces {
public:
    static constexpr const char* names[] = {"contactnum", "frictionforce", "normalforce"};

    explicit ContactForces(std::size_t size) : sums_(size) {}

    // Records the points whose radius is above 0.
    void include(std::span<const float> radii);
    void begin(const Substep& step, const Sleep* sleep);
    // Adds impulses on a point, N s. Different points may be updated concurrently, each from one thread.
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
    // Adds work, J: by friction on the point, and by moving shapes that it touches.
    void add_work(std::size_t i, double friction, double shapes)
    {
        sums_[i].friction_work += friction;
        sums_[i].shape_work += shapes;
    }
    void count(std::size_t i) { ++sums_[i].contacts; }

    // Return sums over all points, J.
    double friction_work() const;
    double shape_work() const;
    // Writes the sums to the columns, which must exist, at the end of the frame.
    void store(PointSet& points) const;

private:
    struct Sum {
        double normal = 0, tangential = 0;         // N s
        double time = 0;                           // s
        double friction_work = 0, shape_work = 0;  // J
        std::int32_t contacts = 0;                 // in the last substep
        bool is_recorded = false;
    };
    std::vector<Sum> sums_;
};

// Splits the impulse that several contacts gave a point together into parts along their normals, each at least 0, by
// least squares (Gauss-Seidel). Returns the remainder.
Vec3d split_impulse(const Vec3d& impulse, std::span<const Vec3d> normals, std::span<double> parts);

}  // namespace rapid
