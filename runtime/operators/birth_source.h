// What an emitter bears points from: a mesh, a level set, an analytic shape, or points; at rest, moving or deforming.
//
// It says where a birth takes place, which way the surface faces there, and which values the newborn take over from it.
// All of that depends on the random key and the birth's number alone.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "runtime/object.h"
#include "runtime/points/point_set.h"
#include "runtime/shapes/mesh/mesh.h"
#include "runtime/shapes/motion/body_path.h"
#include "runtime/shapes/scatter/scatter.h"

namespace rapid {

class BirthSource {
public:
    BirthSource() = default;
    // from: "surface", "volume", "points" (of a mesh its vertices), or empty for what the object suggests. Error: an
    // object that can't be born from, or not so.
    BirthSource(ObjectPtr object, std::string from);

    bool is(const ObjectPtr& object, const std::string& from) const { return object_ == object && from_ == from; }

    // Makes it what it is in the interval that ends with a step; at the simulation's start, what it is there. Once a
    // step, before births are placed, and on one thread. What deforms is known at frames: there it goes the same way
    // whatever the steps.
    struct Moved {
        std::optional<Jump> jump;  // found in this interval
        bool at_beginning;         // births are at t = 0 of an interval: of the one that begins at the start
    };
    Moved go_to(const FrameClock& clock, std::int64_t step, const PathOptions& options);
    // Whether births have ways to go along: places are then to be carried.
    bool moves() const { return path_ != nullptr; }
    const BodyPath& path() const { return *path_; }

    bool empty() const { return !scatter_ && values_.empty(); }  // a set of no points
    bool has_normals() const { return has_normals_; }

    // The source's own attributes, v included: of its points, or of a mesh's vertices, to be read through value().
    const PointSet& values() const { return values_; }
    // Those that the newborn take over: all but what every point has of its own (P, v, id, age, ...).
    std::vector<std::string> carried() const;

    // Birth number first + i goes to out[i]; N is of length 1, or 0 where there is no direction. Points are taken in
    // their order, one a birth and from the beginning again, or at random. Takes the uses 0 to 15 and 17 of the key's
    // numbers.
    void place(RandomKey key, std::uint64_t first, bool in_order, std::span<Birthplace> out) const;

    // The value at a birthplace of a column of values(): the point's own, or on a mesh by barycentric weights.
    template <class T>
    T value(const Strided<T>& column, const Birthplace& place) const
    {
        if constexpr (std::is_same_v<T, float> || std::is_same_v<T, Vec3f>) {
            if (scatter_) {
                const Mesh::Triangle& corner = mesh_->triangles[static_cast<std::size_t>(place.element)];
                const auto at = [&](int i) { return column[static_cast<std::size_t>(corner[i])]; };
                return at(0) * (1 - place.b1 - place.b2) + at(1) * place.b1 + at(2) * place.b2;
            }
        }
        return column[static_cast<std::size_t>(place.element)];
    }

private:
    void take_mesh(const MeshPtr& mesh);
    void take_shape(const ShapePtr& shape);
    void take_points(PointSet points);
    FramePath path_at(const FrameClock& clock, std::int64_t step, const PathOptions& options) const;

    ObjectPtr object_;
    std::string from_;
    std::shared_ptr<const AnimatedMesh> moving_mesh_;    // the object, where it is one
    std::shared_ptr<const AnimatedShape> moving_shape_;  // the same
    BodyPathPtr path_;
    ScatterPtr scatter_;  // null: births are at the points of values_
    MeshPtr mesh_;        // whose triangles the birthplaces name
    PointSet values_;
    Column<Vec3f> normals_;  // of the points
    bool has_normals_ = false;
};

}  // namespace rapid
