// Births on a mesh's surface, uniform by area.
#include <fmt/format.h>

#include <cmath>

#include "runtime/error.h"
#include "runtime/shapes/scatter.h"

namespace rapid {
namespace {

// Draws an item with a probability in proportion to its weight, in constant time: each of n equal columns holds the
// weight of its own item up to `keep`, and of one other above (Walker 1977, built as by Vose 1991).
class AliasTable {
public:
    AliasTable(const std::vector<double>& weights, double sum) : columns_(weights.size())
    {
        std::vector<std::int32_t> small, large;
        for (std::size_t i = 0; i < weights.size(); ++i) {
            columns_[i] = {weights[i] / sum * double(weights.size()), static_cast<std::int32_t>(i)};
            (columns_[i].keep < 1 ? small : large).push_back(static_cast<std::int32_t>(i));
        }
        while (!small.empty() && !large.empty()) {
            Column& filled = columns_[small.back()];
            small.pop_back();
            filled.other = large.back();
            Column& giver = columns_[large.back()];
            giver.keep -= 1 - filled.keep;
            if (giver.keep < 1) {
                small.push_back(large.back());
                large.pop_back();
            }
        }
        // What is left is full but for rounding. An item of weight 0 is never left: a giver would be, too.
        for (const std::int32_t i : large) columns_[i].keep = 1;
        for (const std::int32_t i : small)
            if (columns_[i].keep > 0) columns_[i].keep = 1;
    }

    // From two numbers in [0, 1).
    std::int32_t draw(double u, double w) const
    {
        const auto i = static_cast<std::int32_t>(u * double(columns_.size()));
        return w < columns_[i].keep ? i : columns_[i].other;
    }

private:
    struct Column {
        double keep;
        std::int32_t other;
    };
    std::vector<Column> columns_;
};

class ScatterOnMesh final : public Scatter {
public:
    ScatterOnMesh(MeshPtr mesh, AliasTable triangles) : mesh_(std::move(mesh)), triangles_(std::move(triangles)) {}

    void place(RandomKey key, std::uint64_t first, std::span<Birthplace> out) const override
    {
        for (std::size_t i = 0; i < out.size(); ++i) {
            const auto u = uniform4(key, first + i, 0);
            Birthplace& birth = out[i];
            birth.element = triangles_.draw(u[0], u[1]);
            // Uniform in a triangle (Turk 1990).
            const double s = std::sqrt(u[2]);
            birth.b1 = static_cast<float>(s * (1 - u[3]));
            birth.b2 = static_cast<float>(s * u[3]);

            const Mesh::Triangle& t = mesh_->triangles[birth.element];
            const Vec3d a = mesh_->positions[t[0]].cast<double>();
            const Vec3d ab = mesh_->positions[t[1]].cast<double>() - a, ac = mesh_->positions[t[2]].cast<double>() - a;
            birth.P = (a + double(birth.b1) * ab + double(birth.b2) * ac).cast<float>();
            birth.N = ab.cross(ac).normalized().cast<float>();
        }
    }

private:
    MeshPtr mesh_;
    AliasTable triangles_;
};

}  // namespace

ScatterPtr scatter_on_surface(const MeshPtr& mesh)
{
    std::vector<double> areas;
    areas.reserve(mesh->triangles.size());
    double sum = 0;
    for (const Mesh::Triangle& t : mesh->triangles) {
        const Vec3d a = mesh->positions[t[0]].cast<double>();
        areas.push_back(
            (mesh->positions[t[1]].cast<double>() - a).cross(mesh->positions[t[2]].cast<double>() - a).norm() / 2);
        sum += areas.back();
    }
    if (!(sum > 0))
        throw Error(fmt::format("mesh \"{}\" has {} faces and no area; nothing can be born on it", mesh->name,
                                mesh->triangles.size()));
    return std::make_shared<ScatterOnMesh>(mesh, AliasTable(areas, sum));
}

}  // namespace rapid
