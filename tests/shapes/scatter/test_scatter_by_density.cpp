#include "runtime/shapes/scatter/scatter_by_density.h"

#include <cmath>

#include "runtime/base/error.h"
#include "tests/files/temporary_folder.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

namespace {

std::vector<Birthplace> places_of(const ScatterPtr& scatter, std::size_t n)
{
    std::vector<Birthplace> out(n);
    scatter->place(RandomKey(1, "emit1"), 0, out);
    return out;
}

// Returns the square [0, 1]² in the plane y = 0, with two triangles per cell.
MeshPtr square(int divisions) { return make_grid(1, 1, divisions, Vec3d(0.5, 0, 0.5)); }

// Returns the density x at the corners of faces.
std::vector<float> by_x(const Mesh& mesh)
{
    std::vector<float> density;
    for (const Mesh::Triangle& t : mesh.triangles)
        for (int c = 0; c < 3; ++c) density.push_back(mesh.positions[static_cast<std::size_t>(t[c])].x());
    return density;
}

std::vector<float> uniform(const Mesh& mesh, float density)
{
    return std::vector<float>(3 * mesh.triangles.size(), density);
}

}  // namespace

TEST_CASE("births by the density x on a square are distributed as x², and uniformly across", "[scatter][density]")
{
    // The density varies only within faces for one cell, and mostly between faces for 30.
    const int divisions = GENERATE(1, 30);
    CAPTURE(divisions);
    const MeshPtr mesh = square(divisions);
    constexpr std::size_t n = 200'000, bins = 20;
    std::vector<double> along(bins), across(bins);
    for (const Birthplace& birth : places_of(scatter_by_density(mesh, by_x(*mesh)), n)) {
        ++along[std::min(bins - 1, static_cast<std::size_t>(birth.P.x() * bins))];
        ++across[std::min(bins - 1, static_cast<std::size_t>(birth.P.z() * bins))];
    }
    // Chi-square with 19 degrees of freedom has the standard deviation sqrt(38). The key is fixed.
    double chi_along = 0, chi_across = 0;
    for (std::size_t b = 0; b < bins; ++b) {
        const double expected = n * (std::pow((b + 1.0) / bins, 2) - std::pow(double(b) / bins, 2));
        chi_along += std::pow(along[b] - expected, 2) / expected;
        chi_across += std::pow(across[b] - double(n) / bins, 2) * bins / n;
    }
    CHECK(chi_along < 19 + 4 * std::sqrt(38.0));
    CHECK(chi_across < 19 + 4 * std::sqrt(38.0));
}

TEST_CASE("a birth by density lies on its face, at its weights, with the face's normal", "[scatter][density]")
{
    const MeshPtr mesh = make_torus(1, 0.3, 12, Vec3d::Zero());
    for (const Birthplace& birth : places_of(scatter_by_density(mesh, uniform(*mesh, 3)), 500)) {
        const Mesh::Triangle& t = mesh->triangles.at(static_cast<std::size_t>(birth.element));
        const auto corner = [&](int c) { return mesh->positions[static_cast<std::size_t>(t[c])]; };
        const Vec3f there = (1 - birth.b1 - birth.b2) * corner(0) + birth.b1 * corner(1) + birth.b2 * corner(2);
        CHECK_THAT(birth.P, close_to(there, 1e-6));
        CHECK(std::min({birth.b1, birth.b2, 1 - birth.b1 - birth.b2}) >= -1e-6f);
        CHECK(std::abs(birth.N.dot(corner(1) - corner(0))) < 1e-6);
        CHECK(birth.N.norm() == Approx(1));
    }
}

TEST_CASE("nothing is born where the density is 0, whatever batch a birth is in", "[scatter][density]")
{
    const MeshPtr mesh = square(10);
    std::vector<float> density = by_x(*mesh);
    for (float& d : density) d = d > 0.55f ? 1.0f : 0.0f;
    const ScatterPtr scatter = scatter_by_density(mesh, density);
    const std::vector<Birthplace> all = places_of(scatter, 5000);
    for (const Birthplace& birth : all) CHECK(birth.P.x() >= 0.5f);
    std::vector<Birthplace> later(7);
    scatter->place(RandomKey(1, "emit1"), 4000, later);
    for (std::size_t i = 0; i < later.size(); ++i) CHECK(later[i].P == all[4000 + i].P);
    CHECK(error_of([&] { scatter_by_density(mesh, uniform(*mesh, 0)); }) ==
          "the density is 0 everywhere on the mesh; it must be above 0 somewhere");
}
