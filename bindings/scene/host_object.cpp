// Meshes and points of a program.
#include "bindings/scene/host_object.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>

#include "runtime/base/error.h"
#include "runtime/graph/points_object.h"
#include "runtime/shapes/mesh/mesh.h"

namespace rapid {
namespace {

template <class T>
Column<T> copied(const HostPoints::Column& from, std::size_t count)
{
    Column<T> column(count);
    const std::size_t stride = from.stride == 0 ? sizeof(T) : from.stride;
    const std::span<T> to = column.overwrite();
    for (std::size_t i = 0; i < count; ++i)
        std::memcpy(static_cast<void*>(&to[i]), static_cast<const char*>(from.data) + i * stride, sizeof(T));
    if constexpr (std::is_same_v<T, Token>) {
        for (const Token token : to) token_of_number(token.number);
    } else if constexpr (!std::is_integral_v<T>) {
        const auto* numbers = reinterpret_cast<const float*>(to.data());
        constexpr std::size_t each = sizeof(T) / sizeof(float);
        for (std::size_t k = 0; k < each * count; ++k)
            if (!std::isfinite(numbers[k]))
                throw Error(fmt::format("{} is {} at index {}; it must be finite", from.name, numbers[k], k / each));
    }
    return column;
}

AnyColumn copied_column(const HostPoints::Column& from, std::size_t count)
{
    switch (from.type) {
        case ColumnType::Float:
            return copied<float>(from, count);
        case ColumnType::Vec3:
            return copied<Vec3f>(from, count);
        case ColumnType::Int32:
            return copied<std::int32_t>(from, count);
        case ColumnType::Int64:
            return copied<std::int64_t>(from, count);
        case ColumnType::Quat:
            return copied<Quatf>(from, count);
        case ColumnType::String:
            return copied<Token>(from, count);
        case ColumnType::UInt8:
            break;
    }
    throw Error(fmt::format("{} has bytes; a column must be Float, Vec3, Int32, Int64, Quat or String", from.name));
}

}  // namespace

ObjectPtr make_mesh(const HostMesh& mesh, const std::string& name)
{
    auto made = std::make_shared<Mesh>();
    made->name = name;
    if (mesh.triangles.empty()) throw Error("it has no triangles");
    made->positions.reserve(mesh.positions.size());
    made->triangles.reserve(mesh.triangles.size());
    for (const auto& [x, y, z] : mesh.positions) {
        if (!std::isfinite(x) || !std::isfinite(y) || !std::isfinite(z))
            throw Error(fmt::format("position {} is not finite", made->positions.size()));
        made->positions.emplace_back(x, y, z);
    }
    for (const std::array<std::int32_t, 3>& corners : mesh.triangles) {
        for (const std::int32_t corner : corners)
            if (corner < 0 || static_cast<std::size_t>(corner) >= mesh.positions.size())
                throw Error(fmt::format("triangle {} has a corner at position {}; there are {}", made->triangles.size(),
                                        corner, mesh.positions.size()));
        made->triangles.emplace_back(corners[0], corners[1], corners[2]);
    }
    return made;
}

ObjectPtr make_points(const HostPoints& points)
{
    auto made = std::make_shared<PointsObject>();
    made->points.append(points.count);
    bool has_positions = false;
    for (const HostPoints::Column& column : points.columns) {
        if (!column.data && points.count > 0) throw Error(fmt::format("the data of {} is null", column.name));
        if (column.name == "id") throw Error("id can't be given; ids count from 0");
        AnyColumn values = copied_column(column, points.count);
        const AnyColumn* known = made->points.find(column.name);
        const AttributeSpec* spec = known_attribute(column.name);
        if ((known && known->index() != values.index()) || (spec && spec->fallback.index() != values.index()))
            throw Error(fmt::format("{} has the type {}; it must be {}", column.name, type_name(type_of(values)),
                                    type_name(known ? type_of(*known) : type_of(spec->fallback))));
        has_positions = has_positions || column.name == "P";
        made->points.set(column.name, std::move(values));
    }
    if (!has_positions) throw Error("P is missing; give a column of Vec3 of this name");
    const std::span<std::int64_t> id = made->points.id().overwrite();
    for (std::size_t i = 0; i < id.size(); ++i) id[i] = static_cast<std::int64_t>(i);
    return made;
}

ObjectPtr make_object(const std::string& name, const HostObject& offered, bool guarded)
{
    try {
        if (const auto* mesh = std::get_if<HostMesh>(&offered)) return make_mesh(*mesh, name);
        if (const auto* points = std::get_if<HostPoints>(&offered)) return make_points(*points);
        return make_shape(name, std::get<HostShape>(offered), guarded);
    } catch (const Error& error) {
        throw Error(fmt::format("the program offers \"{}\": {}", name, error.message()), error.kind());
    }
}

}  // namespace rapid
