#include "runtime/picture/light.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "runtime/base/parallel.h"
#include "runtime/picture/screen_mesh.h"

namespace rapid {
namespace {

constexpr int shadow_size = 1024;  // texels across the shadow map of the meshes
constexpr int cells = 160;         // across the shadow grid of the points
constexpr int slices = 64;         // of the grid, along the light
constexpr float cells_per_texel = static_cast<float>(cells) / shadow_size;
constexpr std::size_t slice = std::size_t{cells} * cells;

// Larger points are discs that cover several cells. A smaller one puts its whole cross section into one cell.
constexpr float small_radius = 1.5f;  // cells
constexpr float max_covered = 4;      // per large ball, enough to be opaque: exp(-0.7 · 4) is dark

// The cells that a point covers, in units of cells.
struct ShadowDisc {
    float x, y, radius, taken;

    int reach() const { return radius <= small_radius ? 0 : static_cast<int>(std::ceil(radius)); }

    // Returns how many times the point covers a cell.
    float covers(int cell_x, int cell_y) const
    {
        if (radius <= small_radius) {
            const bool in_cell = cell_x == static_cast<int>(x) && cell_y == static_cast<int>(y);
            return in_cell ? taken * 3.14159f * radius * radius : 0;
        }
        const float dx = static_cast<float>(cell_x) + 0.5f - x, dy = static_cast<float>(cell_y) + 0.5f - y;
        const float part = std::clamp(radius + 0.5f - std::sqrt(dx * dx + dy * dy), 0.0f, 1.0f);
        return part * taken * std::min(radius / small_radius, max_covered);
    }

    // Returns how many times the point covers its own centre, as read back from the blurred cells.
    float covers_itself() const
    {
        if (radius > 5) return taken * std::min(radius / small_radius, max_covered);
        const std::array<float, 7> along_x = weights(x), along_y = weights(y);
        if (radius <= small_radius) return along_x[3] * along_y[3] * covers(static_cast<int>(x), static_cast<int>(y));
        float sum = 0;
        for (int j = -3; j <= 3; ++j)
            for (int i = -3; i <= 3; ++i)
                if (const float weight = along_x[i + 3] * along_y[j + 3]; weight > 0)
                    sum += weight * covers(static_cast<int>(x) + i, static_cast<int>(y) + j);
        return sum;
    }

private:
    // Returns the weights of the cells around `at` in the value interpolated there between two blurred cells.
    static std::array<float, 7> weights(float at)
    {
        constexpr std::array<float, 9> blur = {0, 0, 0.0625f, 0.25f, 0.375f, 0.25f, 0.0625f, 0, 0};
        const float middle = at - std::floor(at) - 0.5f;
        const int low = middle < 0 ? -1 : 0;  // the nearer of the two, relative to the point's cell
        const float part = middle - static_cast<float>(low);
        std::array<float, 7> result{};
        for (int k = -3; k <= 3; ++k)
            result[k + 3] =
                (1 - part) * blur[std::clamp(k - low + 4, 0, 8)] + part * blur[std::clamp(k - low - 1 + 4, 0, 8)];
        return result;
    }
};

Vec3f light_direction(const Camera& camera)
{
    const Lens lens = Lens::of_camera(camera, 2, 2);
    // The light comes from above, slightly from the left, and from behind the viewer: the visible sides of shapes are
    // lit, and shadows fall to the right.
    const Vec3f across = lens.right * -0.45f + Vec3f::UnitY() * 0.85f - lens.forward * 0.35f;
    return across.normalized();
}

}  // namespace

Light::Light(const PictureScene& scene, const PictureView& view) : direction_(light_direction(view.camera))
{
    const float radius = std::max(1e-6f, 0.7f * static_cast<float>(view.bounds.diagonal().norm()));
    depth_range_ = 2 * radius;
    lens_.forward = -direction_;
    lens_.right = any_tangent(direction_);
    lens_.up = lens_.right.cross(lens_.forward);
    lens_.origin = view.bounds.center().cast<float>() + direction_ * radius;
    lens_.focal = 0.5f * shadow_size / radius;
    lens_.center_x = lens_.center_y = 0.5f * shadow_size;
    lens_.parallel = true;
    draw_meshes(scene);
}

void Light::draw_meshes(const PictureScene& scene)
{
    for (const PictureScene::Body& body : scene.bodies) {
        if (body.role != PictureScene::Body::Collider) continue;
        if (mesh_depth_.empty())
            mesh_depth_.assign(std::size_t{shadow_size} * shadow_size, std::numeric_limits<float>::infinity());
        const ScreenMesh mesh(*body.mesh, lens_, 0);
        for_each_band(shadow_size, [&](int begin, int end) {
            for (const ScreenTriangle& triangle : mesh.triangles())
                mesh.cover(triangle, {0, begin, shadow_size, end}, [&](int x, int y, const Vec3f&, float depth) {
                    float& nearest = mesh_depth_[static_cast<std::size_t>(y) * shadow_size + x];
                    nearest = std::min(nearest, depth);
                });
        });
    }
}

void Light::Range::extend(int low, int high)
{
    const bool none = begin == end;
    begin = none ? low : std::min(begin, low);
    end = none ? high + 1 : std::max(end, high + 1);
}

void Light::gather(const PointSet& points, std::span<const float> opacity, float min_radius)
{
    constexpr float unit = 4096;
    constexpr std::size_t count = slice * slices;
    if (!sums_) {
        if (points.empty()) return;
        sums_ = std::make_unique<std::atomic<std::uint64_t>[]>(count);
        covered_.assign(count, 0);
        spread_.assign(count, 0);
    }
    // Clears the cells of the previous frame.
    const auto for_each_row = [&](const auto& f) {
        tbb::parallel_for(z_.begin, z_.end, [&](int k) {
            for (int y = y_.begin; y < y_.end; ++y)
                f(static_cast<std::size_t>(k) * slice + static_cast<std::size_t>(y) * cells);
        });
    };
    for_each_row([&](std::size_t row) { std::fill_n(&covered_[row + x_.begin], x_.end - x_.begin, 0.0f); });

    min_radius_ = min_radius;
    const Strided<Vec3f> P = points.P().read();
    const Column<float>* pscale = points.find<float>("pscale");
    const float cells_per_metre = lens_.focal * cells_per_texel;
    const std::size_t chunks = (points.size() + chunk_size - 1) / chunk_size;
    std::vector<std::array<Range, 3>> reached(chunks);
    for_each_chunk(points.size(), [&](std::size_t begin, std::size_t end) {
        std::array<Range, 3>& range = reached[begin / chunk_size];
        for (std::size_t i = begin; i < end; ++i) {
            const Vec3f s = lens_.project(P[i]);
            const float x = s.x() * cells_per_texel, y = s.y() * cells_per_texel, z = s.z() / depth_range_ * slices;
            if (!(x >= 0 && y >= 0 && z >= 0 && x < cells && y < cells && z < slices)) continue;
            const float taken = opacity.empty() ? 1 : opacity[i];
            if (taken == 0) continue;
            const float r = std::max(min_radius, pscale ? (*pscale)[i] : 0.0f) * cells_per_metre;
            const ShadowDisc disc{x, y, std::min(r, static_cast<float>(cells)), taken};
            const Eigen::Vector3i cell = Vec3f(x, y, z).cast<int>();
            const int reach = disc.reach();
            const int left = std::max(cell.x() - reach, 0), right = std::min(cell.x() + reach, cells - 1);
            const int low = std::max(cell.y() - reach, 0), high = std::min(cell.y() + reach, cells - 1);
            range[0].extend(left, right);
            range[1].extend(low, high);
            range[2].extend(cell.z(), cell.z());
            for (int cy = low; cy <= high; ++cy)
                for (int cx = left; cx <= right; ++cx)
                    sums_[static_cast<std::size_t>(cell.z()) * slice + static_cast<std::size_t>(cy) * cells +
                          static_cast<std::size_t>(cx)]
                        .fetch_add(static_cast<std::uint64_t>(unit * disc.covers(cx, cy) + 0.5f),
                                   std::memory_order_relaxed);
        }
    });
    x_ = y_ = z_ = Range();
    for (const auto& [x, y, z] : reached) {
        if (x.begin == x.end) continue;
        x_.extend(std::max(x.begin - 2, 0), std::min(x.end + 1, cells - 1));
        y_.extend(std::max(y.begin - 2, 0), std::min(y.end + 1, cells - 1));
        z_.extend(z.begin, slices - 1);
    }
    // A load and a store take a tenth of the time of an exchange, and no other thread is active.
    for_each_row([&](std::size_t row) {
        for (std::size_t i = row + x_.begin; i < row + x_.end; ++i) {
            covered_[i] = static_cast<float>(sums_[i].load(std::memory_order_relaxed)) / unit;
            sums_[i].store(0, std::memory_order_relaxed);
        }
    });
    blur_covered();
    tbb::parallel_for(y_.begin, y_.end, [&](int y) {
        for (int k = z_.begin + 1; k < z_.end; ++k) {
            const std::size_t row = static_cast<std::size_t>(k) * slice + static_cast<std::size_t>(y) * cells;
            for (std::size_t i = row + x_.begin; i < row + x_.end; ++i) covered_[i] += covered_[i - slice];
        }
    });
}

// Blurs over the neighbours along both axes, so that cells do not show: weights 1, 4, 6, 4, 1. Values outside the range
// are 0.
void Light::blur_covered()
{
    tbb::parallel_for(z_.begin, z_.end, [&](int k) {
        const auto blur = [&](const std::vector<float>& from, std::vector<float>& to, const Range& along,
                              std::size_t step, std::size_t row) {
            for (int x = x_.begin; x < x_.end; ++x) to[row + x] = 0.375f * from[row + x];
            const int at = step == 1 ? 0 : static_cast<int>(row % slice / cells);
            for (const int away : {-2, -1, 1, 2}) {
                const float weight = away * away == 1 ? 0.25f : 0.0625f;
                const std::ptrdiff_t offset = away * static_cast<std::ptrdiff_t>(step);
                int begin = x_.begin, end = x_.end;
                if (step == 1) {
                    begin = std::max(begin, along.begin - away);
                    end = std::min(end, along.end - away);
                } else if (at + away < along.begin || at + away >= along.end) {
                    continue;
                }
                const float* source = from.data() + static_cast<std::ptrdiff_t>(row) + offset;
                float* const target = to.data() + row;
                for (int x = begin; x < end; ++x) target[x] += weight * source[x];
            }
        };
        const auto for_each_y = [&](const auto& f) {
            for (int y = y_.begin; y < y_.end; ++y)
                f(static_cast<std::size_t>(k) * slice + static_cast<std::size_t>(y) * cells);
        };
        for_each_y([&](std::size_t row) { blur(covered_, spread_, x_, 1, row); });
        for_each_y([&](std::size_t row) { blur(spread_, covered_, y_, cells, row); });
    });
}

float Light::mesh_transmittance(const Vec3f& P, const Vec3f& n) const
{
    if (mesh_depth_.empty()) return 1;
    // Tests slightly in front of the surface, because the raster of the shadow map would otherwise show on it.
    const float texel = 1 / lens_.focal;
    const Vec3f s = lens_.project(P + n * (2 * texel));
    if (!(s.x() >= 2 && s.y() >= 2 && s.x() < shadow_size - 2 && s.y() < shadow_size - 2)) return 1;
    // Averages nine texels, weighted by how much of each a square of two texels around s covers, for a smooth shadow
    // edge.
    const int x = static_cast<int>(s.x()), y = static_cast<int>(s.y());
    const float fx = s.x() - static_cast<float>(x), fy = s.y() - static_cast<float>(y);
    const float wx[3] = {1 - fx, 1, fx}, wy[3] = {1 - fy, 1, fy};
    float open = 0;
    for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 3; ++i)
            if (mesh_depth_[static_cast<std::size_t>(y + j - 1) * shadow_size + (x + i - 1)] > s.z() - 1.5f * texel)
                open += wx[i] * wy[j];
    return open / 4;
}

Vec3f Light::cell_of(const Vec3f& P) const
{
    const Vec3f s = lens_.project(P);
    return {s.x() * cells_per_texel - 0.5f, s.y() * cells_per_texel - 0.5f,
            std::min(s.z() / depth_range_ * slices - 1, static_cast<float>(slices) - 1.001f)};
}

bool Light::may_shade(const Box3f& box) const
{
    if (z_.begin == z_.end) return false;
    const Vec3f low(static_cast<float>(x_.begin - 1), static_cast<float>(y_.begin - 1),
                    static_cast<float>(z_.begin - 1));
    const Vec3f high(static_cast<float>(x_.end), static_cast<float>(y_.end), static_cast<float>(z_.end));
    return box.intersects(Box3f(low, high));
}

float Light::point_transmittance(const Vec3f& cell) const { return point_transmittance(cell, 0, slices); }

float Light::transmittance_of_others(const Vec3f& P, float radius, float taken) const
{
    if (z_.begin == z_.end) return 1;
    const Vec3f cell = cell_of(P);
    const float cells_per_metre = lens_.focal * cells_per_texel;
    const float r = std::min(std::max(min_radius_, radius) * cells_per_metre, static_cast<float>(cells));
    return point_transmittance(cell, ShadowDisc{cell.x() + 0.5f, cell.y() + 0.5f, r, taken}.covers_itself(),
                               static_cast<int>(lens_.project(P).z() / depth_range_ * slices));
}

// own: coverage of the position by the point that is there, to be excluded; own_slice: its slice.
float Light::point_transmittance(const Vec3f& cell, float own, int own_slice) const
{
    if (z_.begin == z_.end) return 1;
    if (!(cell.x() >= 0 && cell.y() >= 0 && cell.z() >= 0 && cell.x() < cells - 1 && cell.y() < cells - 1)) return 1;
    const Eigen::Vector3i corner = cell.cast<int>();
    const Vec3f part = cell - corner.cast<float>();
    const float* c = &covered_[(static_cast<std::size_t>(corner.z()) * cells + corner.y()) * cells +
                               static_cast<std::size_t>(corner.x())];
    const auto of_slice = [&](const float* at) {
        const float low = at[0] + part.x() * (at[1] - at[0]);
        const float high = at[cells] + part.x() * (at[cells + 1] - at[cells]);
        return low + part.y() * (high - low);
    };
    const float near = of_slice(c);
    float covered = near + part.z() * (of_slice(c + slice) - near);
    if (corner.z() + 1 >= own_slice) covered -= own * (corner.z() >= own_slice ? 1 : part.z());
    return covered > 0 ? std::exp(-0.7f * covered) : 1;
}

}  // namespace rapid
