// Births on the surface of a mesh, uniform by area.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "runtime/base/error.h"
#include "runtime/shapes/scatter/alias_table.h"
#include "runtime/shapes/scatter/scatter.h"

namespace rapid {
namespace {

// A triangle, prepared for births.
struct Face {
    Vec3d corner, to_second, to_third;
    Vec3f N;
};

class ScatterOnMesh final : public Scatter {
public:
    ScatterOnMesh(std::vector<Face> faces, AliasTable chances) : faces_(std::move(faces)), chances_(std::move(chances))
    {
    }

    void place(RandomKey key, std::uint64_t first, std::span<Birthplace> out) const override
    {
        constexpr std::size_t block_size = 256;
        std::array<std::array<double, 4>, block_size> numbers;
        for (std::size_t begin = 0; begin < out.size(); begin += block_size) {
            const std::size_t n = std::min(block_size, out.size() - begin);
            uniform4(key, first + begin, 0, std::span(numbers).first(n));
            for (std::size_t i = 0; i < n; ++i) {
                const auto& u = numbers[i];
                Birthplace& birth = out[begin + i];
                birth.element = chances_.draw(u[0], u[1]);
                // Uniform in a triangle (Turk 1990).
                const double s = std::sqrt(u[2]);
                birth.b1 = static_cast<float>(s * (1 - u[3]));
                birth.b2 = static_cast<float>(s * u[3]);
                const Face& face = faces_[static_cast<std::size_t>(birth.element)];
                birth.P =
                    (face.corner + double(birth.b1) * face.to_second + double(birth.b2) * face.to_third).cast<float>();
                birth.N = face.N;
            }
        }
    }

private:
    std::vector<Face> faces_;
    AliasTable chances_;
};

}  // namespace

ScatterPtr scatter_on_surface(const MeshPtr& mesh, std::span<const double> given)
{
    std::vector<Face> faces;
    std::vector<double> areas;
    faces.reserve(mesh->triangles.size());
    areas.reserve(mesh->triangles.size());
    double sum = 0;
    for (const Mesh::Triangle& t : mesh->triangles) {
        const Vec3d a = mesh->positions[t[0]].cast<double>();
        const Vec3d ab = mesh->positions[t[1]].cast<double>() - a, ac = mesh->positions[t[2]].cast<double>() - a;
        const Vec3d twice_area = ab.cross(ac);
        faces.push_back({a, ab, ac, twice_area.normalized().cast<float>()});
        areas.push_back(given.empty() ? twice_area.norm() / 2 : given[areas.size()]);
        sum += areas.back();
    }
    if (!(sum > 0))
        throw Error(fmt::format("mesh \"{}\" has {} faces but no area, so it can't emit points", mesh->name,
                                mesh->triangles.size()));
    return std::make_shared<ScatterOnMesh>(std::move(faces), AliasTable(areas, sum));
}

}  // namespace rapid
