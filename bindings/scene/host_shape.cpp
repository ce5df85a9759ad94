// A shape whose distance is a callback of the program over arrays of positions.
#include <fmt/format.h>

#include "bindings/scene/host_object.h"
#include "bindings/scene/scene_error.h"
#include "runtime/shapes/first_contact.h"

namespace rapid {
namespace {

// Answers a batch of queries.
class HostSampler {
public:
    HostSampler(const HostShape& shape, const std::string& name, bool guarded)
        : shape_(shape), name_(name), guarded_(guarded)
    {
    }

    // P: shape [n][3]; gradient: empty, or shape [n].
    void query(std::span<const double> P, std::span<double> phi, std::span<Vec3d> gradient) const
    {
        if (phi.empty()) return;
        GuardedArray<double> distance(phi.size(), guarded_), slopes(3 * gradient.size(), guarded_);
        call_program(name_.c_str(), shape_.distance, phi.size(), P.data(), distance.data(),
                     gradient.empty() ? nullptr : slopes.data());
        distance.check(fmt::format("the distance of the program's {}", name_), 1);
        slopes.check(fmt::format("the gradient of the program's {}", name_), 3);
        for (std::size_t i = 0; i < phi.size(); ++i) phi[i] = distance[i];
        for (std::size_t i = 0; i < gradient.size(); ++i)
            gradient[i] = Vec3d(slopes[3 * i], slopes[3 * i + 1], slopes[3 * i + 2]);
    }

    double distance(const Vec3d& P) const
    {
        double phi = 0;
        query({P.data(), 3}, {&phi, 1}, {});
        return phi;
    }
    double distance(const Vec3d& P, Vec3d& gradient) const
    {
        double phi = 0;
        query({P.data(), 3}, {&phi, 1}, {&gradient, 1});
        return phi;
    }
    double slope_bound() const { return shape_.slope_bound; }
    double smallest_feature() const { return shape_.smallest_feature; }
    double rounding() const { return 0x1p-40; }  // m; of a distance that is exact in double precision
    Box3d bounds() const
    {
        return {Vec3d(shape_.lower[0], shape_.lower[1], shape_.lower[2]),
                Vec3d(shape_.upper[0], shape_.upper[1], shape_.upper[2])};
    }

private:
    const HostShape& shape_;
    const std::string& name_;
    bool guarded_;
};

// A sampler of a shape that is not convex, which traces many paths at once.
class HostFieldSampler : public HostSampler {
public:
    using HostSampler::HostSampler;

    void distances(int n, const double* X, const double* Y, const double* Z, double* phi) const
    {
        query(packed(n, X, Y, Z), {phi, static_cast<unsigned>(n)}, {});
    }
    void distances_along(int n, const double* X, const double* Y, const double* Z, const double* vx, const double* vy,
                         const double* vz, double* phi, double* slope) const
    {
        std::vector<Vec3d> gradient(static_cast<unsigned>(n));
        query(packed(n, X, Y, Z), {phi, static_cast<unsigned>(n)}, gradient);
        for (int i = 0; i < n; ++i) slope[i] = gradient[i].dot(Vec3d(vx[i], vy[i], vz[i]));
    }

private:
    static std::vector<double> packed(int n, const double* X, const double* Y, const double* Z)
    {
        std::vector<double> P(3 * static_cast<std::size_t>(static_cast<unsigned>(n)));
        for (int i = 0; i < n; ++i) {
            P[3 * i] = X[i];
            P[3 * i + 1] = Y[i];
            P[3 * i + 2] = Z[i];
        }
        return P;
    }
};

class OfferedShape final : public ShapeOf<OfferedShape> {
public:
    OfferedShape(const HostShape& shape, std::string name, bool guarded)
        : shape_(shape), name_(std::move(name)), guarded_(guarded)
    {
    }
    HostSampler sampler() const { return {shape_, name_, guarded_}; }
    void first_contact(std::span<const Path> paths, std::span<Contact> contacts) const override
    {
        if (shape_.smallest_feature > 0)
            FirstContactSearch(HostFieldSampler(shape_, name_, guarded_), paths, contacts).find();
        else
            find_in_convex(paths, contacts);
    }
    Box3d bounds() const override { return sampler().bounds(); }
    double slope_bound() const override { return shape_.slope_bound; }
    // Evaluates all positions in one call.
    void distance(std::span<const Vec3d> P, std::span<double> phi, std::span<Vec3d> gradient) const override
    {
        if (!P.empty()) sampler().query({P.front().data(), 3 * P.size()}, phi, gradient);
    }

private:
    // One call finds the paths that are too short to reach the shape; the others are few, and are traced one by one.
    void find_in_convex(std::span<const Path> paths, std::span<Contact> contacts) const
    {
        std::vector<double> P, phi(paths.size());
        P.reserve(3 * paths.size());
        for (const Path& path : paths) P.insert(P.end(), path.P.data(), path.P.data() + 3);
        sampler().query(P, phi, {});
        std::vector<std::size_t> indices;
        std::vector<Path> near;
        for (std::size_t i = 0; i < paths.size(); ++i) {
            const Path& path = paths[i];
            contacts[i] = Contact();
            // The speed is convex along the path.
            const double fastest = std::max(path.v.norm(), path.velocity(path.duration).norm());
            const double rounding = 0x1p-20 * (path.P.cwiseAbs().maxCoeff() + path.radius);
            if (phi[i] - path.radius - rounding > path.duration * fastest * shape_.slope_bound) continue;
            indices.push_back(i);
            near.push_back(path);
        }
        std::vector<Contact> found(near.size());
        FirstContactSearch(sampler(), near, found).find();
        for (std::size_t k = 0; k < indices.size(); ++k) contacts[indices[k]] = found[k];
    }

    const HostShape shape_;
    const std::string name_;  // shape "NAME"
    const bool guarded_;
};

}  // namespace

ObjectPtr make_shape(const std::string& name, const HostShape& shape, bool guarded)
{
    if (!shape.distance) throw Error("the function of the distance is missing");
    for (int axis = 0; axis < 3; ++axis)
        if (!(shape.lower[axis] <= shape.upper[axis]))
            throw Error(fmt::format("its bounds go from {} to {} along axis {}; the lower one must come first",
                                    shape.lower[axis], shape.upper[axis], axis));
    if (!(shape.slope_bound >= 1))
        throw Error(fmt::format("slope_bound = {}; it must be at least 1", shape.slope_bound));
    if (!(shape.smallest_feature >= 0))
        throw Error(fmt::format("smallest_feature = {}; it must be at least 0", shape.smallest_feature));
    return std::make_shared<OfferedShape>(shape, fmt::format("shape \"{}\"", name), guarded);
}

}  // namespace rapid
