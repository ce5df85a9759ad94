#include "runtime/shapes/scatter/scatter_by_density.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "runtime/base/error.h"
#include "runtime/shapes/scatter/alias_table.h"

namespace rapid {
namespace {

// A linear density is the sum over the corners of d_i λ_i, whose integrals over a face of area A are A d_i / 3. A birth
// draws a face and a corner with these weights, then a position with the density λ_i. The weights λ then have the
// distribution Dirichlet(2, 1, 1), that of the spacings of three uniform numbers in [0, 1) with two spacings joined.
class ScatterByDensity final : public Scatter {
public:
    ScatterByDensity(MeshPtr mesh, AliasTable corners) : mesh_(std::move(mesh)), corners_(std::move(corners)) {}

    void place(RandomKey key, std::uint64_t first, std::span<Birthplace> out) const override
    {
        for (std::size_t i = 0; i < out.size(); ++i) {
            const auto which = uniform4(key, first + i, 0), where = uniform4(key, first + i, 1);
            const std::int32_t item = corners_.draw(which[0], which[1]), corner = item % 3;
            std::array<double, 3> u{where[0], where[1], where[2]};
            std::sort(u.begin(), u.end());
            std::array<double, 3> weights;
            weights[static_cast<std::size_t>(corner)] = u[1];
            weights[static_cast<std::size_t>((corner + 1) % 3)] = u[2] - u[1];
            weights[static_cast<std::size_t>((corner + 2) % 3)] = 1 - u[2];
            out[i] = at(item / 3, weights[1], weights[2]);
        }
    }

private:
    Birthplace at(std::int32_t face, double b1, double b2) const
    {
        const Mesh::Triangle& t = mesh_->triangles[static_cast<std::size_t>(face)];
        const auto corner = [&](int c) {
            return mesh_->positions[static_cast<std::size_t>(t[c])].template cast<double>();
        };
        const Vec3d a = corner(0), ab = corner(1) - a, ac = corner(2) - a;
        Birthplace birth;
        birth.P = (a + b1 * ab + b2 * ac).cast<float>();
        birth.N = ab.cross(ac).normalized().cast<float>();
        birth.element = face;
        birth.b1 = static_cast<float>(b1);
        birth.b2 = static_cast<float>(b2);
        return birth;
    }

    MeshPtr mesh_;
    AliasTable corners_;  // three per face
};

}  // namespace

ScatterPtr scatter_by_density(const MeshPtr& mesh, std::span<const float> density, std::span<const double> areas)
{
    std::vector<double> weights;
    weights.reserve(3 * mesh->triangles.size());
    double area = 0, sum = 0;
    for (const Mesh::Triangle& t : mesh->triangles) {
        const Vec3d a = mesh->positions[static_cast<std::size_t>(t[0])].cast<double>();
        const Vec3d ab = mesh->positions[static_cast<std::size_t>(t[1])].cast<double>() - a;
        const Vec3d ac = mesh->positions[static_cast<std::size_t>(t[2])].cast<double>() - a;
        const double face = areas.empty() ? ab.cross(ac).norm() / 2 : areas[weights.size() / 3];
        area += face;
        for (int c = 0; c < 3; ++c) {
            weights.push_back(face * double(density[weights.size()]));
            sum += weights.back();
        }
    }
    if (!(area > 0))
        throw Error(fmt::format("mesh \"{}\" has {} faces but no area, so it can't emit points", mesh->name,
                                mesh->triangles.size()));
    if (!(sum > 0)) throw Error("the density is 0 everywhere on the mesh; it must be above 0 somewhere");
    return std::make_shared<ScatterByDensity>(mesh, AliasTable(weights, sum));
}

}  // namespace rapid
