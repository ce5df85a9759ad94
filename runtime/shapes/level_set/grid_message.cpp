#include "runtime/shapes/level_set/grid_message.h"

namespace rapid {

bool is_uniform(const openvdb::Mat4R& map)
{
    return map(0, 0) > 0 && map(0, 0) == map(1, 1) && map(1, 1) == map(2, 2) && map(0, 1) == 0 && map(0, 2) == 0 &&
           map(1, 0) == 0 && map(1, 2) == 0 && map(2, 0) == 0 && map(2, 1) == 0;
}

bool is_uniform(const openvdb::math::Transform& transform)
{
    return transform.isLinear() && is_uniform(transform.baseMap()->getAffineMap()->getMat4());
}

openvdb::math::Transform::Ptr transform_of(const openvdb::Mat4R& map, const std::string& name)
{
    const double volume = map.getMat3().det();
    if (!map.isFinite() || !std::isnormal(volume))
        throw Error(fmt::format("the transform of grid \"{}\" has no inverse: its voxels have {} m³", name, volume));
    if (!is_uniform(map)) return openvdb::math::Transform::createLinearTransform(map);
    auto transform = openvdb::math::Transform::createLinearTransform(map(0, 0));
    const openvdb::Vec3d translation = map.getTranslation();
    if (translation != openvdb::Vec3d(0)) transform->postTranslate(translation);
    return transform;
}

void check_extent(const openvdb::CoordBBox& leaves, const std::string& name)
{
    if (leaves.empty()) return;
    constexpr double most = 1 << 28;  // a gigabyte of index: 5,000 voxels along each axis
    double blocks = 1;
    for (int axis = 0; axis < 3; ++axis)
        blocks *= (static_cast<double>(leaves.max()[axis]) - static_cast<double>(leaves.min()[axis])) / 8 + 1;
    if (blocks > most)
        throw Error(fmt::format(
            "the values of grid \"{}\" are spread over {:.3g} boxes of 8 x 8 x 8 voxels; at most {:.3g} are possible",
            name, blocks, most));
}

}  // namespace rapid
