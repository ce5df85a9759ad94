#include "runtime/shapes/level_set/placed.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "runtime/base/error.h"
#include "runtime/shapes/level_set/level_set_tools.h"

namespace rapid {
namespace {

class PlacedScatter final : public Scatter {
public:
    PlacedScatter(ScatterPtr rest, const Pose& pose) : rest_(std::move(rest)), pose_(pose) {}

    void place(RandomKey key, std::uint64_t first, std::span<Birthplace> out) const override
    {
        rest_->place(key, first, out);
        for (Birthplace& birth : out) {
            birth.P = (pose_ * birth.P.cast<double>()).cast<float>();
            birth.N = (pose_.rotation * birth.N.cast<double>()).cast<float>();
        }
    }

private:
    ScatterPtr rest_;
    Pose pose_;
};

}  // namespace

Box3d moved(const Pose& pose, const Box3d& box)
{
    if (box.isEmpty()) return box;
    if (pose.rotation.vec().isZero(0)) {
        const auto corner = [&](const Vec3d& X) { return Vec3d(pose.translation + pose.scale * X); };
        return {corner(box.min()), corner(box.max())};
    }
    const Vec3d infinite = Vec3d::Constant(std::numeric_limits<double>::infinity());
    if (!box.sizes().allFinite()) return {-infinite, infinite};
    Box3d around;
    for (int k = 0; k < 8; ++k) around.extend(pose * box.corner(static_cast<Box3d::CornerType>(k)));
    return around;
}

template <class Base>
Box3d PlacedOf<Base>::bounds() const
{
    return moved(pose_, rest_->bounds());
}

template <class Base>
void PlacedOf<Base>::distance(std::span<const Vec3d> P, std::span<double> phi, std::span<Vec3d> gradient) const
{
    // Uses a fixed buffer: kernels query point by point and must not allocate.
    std::array<Vec3d, 64> X;
    for (std::size_t begin = 0; begin < P.size(); begin += X.size()) {
        const std::size_t n = std::min(X.size(), P.size() - begin);
        for (std::size_t i = 0; i < n; ++i) X[i] = to_rest_ * P[begin + i];
        rest_->distance(std::span(X).first(n), phi.subspan(begin, n),
                        gradient.empty() ? gradient : gradient.subspan(begin, n));
    }
    for (double& distance : phi) distance *= pose_.scale;
    for (Vec3d& g : gradient) g = pose_.rotation * g;
}

template <class Base>
void PlacedOf<Base>::first_contact(std::span<const Path> paths, std::span<Contact> contacts) const
{
    std::vector<Path> in_rest(paths.begin(), paths.end());
    const auto turned_back = [&](const Vec3d& v) -> Vec3d { return to_rest_.scale * (to_rest_.rotation * v); };
    for (Path& path : in_rest) {
        path.P = to_rest_ * path.P;
        path.v = turned_back(path.v);
        path.a = turned_back(path.a);
        path.radius *= to_rest_.scale;
    }
    rest_->first_contact(in_rest, contacts);
    for (Contact& contact : contacts) {
        contact.n = pose_.rotation * contact.n;
        contact.curvature *= to_rest_.scale;
        contact.depth *= pose_.scale;
    }
}

template <class Base>
ScatterPtr PlacedOf<Base>::surface_scatter() const
{
    return std::make_shared<PlacedScatter>(rest_->surface_scatter(), pose_);
}

template <class Base>
ScatterPtr PlacedOf<Base>::volume_scatter() const
{
    return std::make_shared<PlacedScatter>(rest_->volume_scatter(), pose_);
}

template <class Base>
MeshPtr PlacedOf<Base>::surface() const
{
    const MeshPtr mesh = rest_->surface();
    return mesh ? transformed(mesh, pose_.affine()) : nullptr;
}

template class PlacedOf<Shape>;
template class PlacedOf<LevelSet>;

LevelSetPtr PlacedLevelSet::with_band(double metres) const
{
    return std::make_shared<PlacedLevelSet>(rest()->with_band(metres / pose().scale), pose());
}

void PlacedLevelSet::write(const std::filesystem::path& path, const std::string& grid) const
{
    resample_level_set(std::make_shared<PlacedLevelSet>(rest(), pose()), voxel())->write(path, grid);
}

ShapePtr placed(const ShapePtr& rest, const Pose& pose)
{
    constexpr int most = 1000;  // each level calls the next one on the stack
    int moves = 1;
    for (const Shape* shape = rest.get(); const auto* outer = dynamic_cast<const PlacedOf<Shape>*>(shape); ++moves)
        shape = outer->rest().get();
    if (moves > most)
        throw Error(fmt::format("a {} is moved more than {} times; move it once, with a product of the motions",
                                rest->kind(), most));
    return std::make_shared<PlacedOf<Shape>>(rest, pose);
}

}  // namespace rapid
