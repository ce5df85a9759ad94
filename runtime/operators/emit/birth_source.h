// The source of an emitter: a mesh, a level set, an analytic shape, a fog, a curve, or points; at rest, moving or
// deforming.
//
// It provides the position of a birth, the normal there, and the attribute values that newborn points inherit. All of
// these depend only on the random key and the birth's number.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "runtime/base/object.h"
#include "runtime/graph/points_object.h"
#include "runtime/math/items.h"
#include "runtime/points/point_set.h"
#include "runtime/shapes/mesh/mesh.h"
#include "runtime/shapes/motion/body_path.h"
#include "runtime/shapes/scatter/alias_table.h"
#include "runtime/shapes/scatter/scatter.h"

namespace rapid {

class Curves;
class DensityGrid;
class MovingCurves;

class BirthSource {
public:
    BirthSource() = default;
    // from: "surface", "volume", "points" (a mesh's vertices), or empty for the object's default. Throws Error if the
    // object is not a source, or not of that kind. density: attribute by which positions are drawn, or empty. group:
    // group of mesh faces on which points are born, or empty.
    BirthSource(ObjectPtr object, std::string from, std::string density = "", std::string group = "");

    bool is(const ObjectPtr& object, const std::string& from, const std::string& density,
            const std::string& group) const
    {
        return object_ == object && from_ == from && density_ == density && group_ == group;
    }
    // Makes the points of this source continue those of `last`, the source until now: they travel from there to here.
    void follow(const BirthSource& last);

    // Moves the source to the interval that ends with a step; at the simulation's start, to that instant. Call it once
    // per step, before placing births, on one thread. A deforming source is known at whole frames, and its path within
    // a frame does not depend on the subframes.
    struct Move {
        std::optional<Jump> jump = {};  // detected in this interval
        bool at_beginning = false;      // births take place at t = 0 of the first interval
        std::size_t unmatched = 0;      // points of a changing set that did not exist before
    };
    Move move_to(const FrameClock& clock, std::int64_t step, const PathOptions& options);
    // Returns true if birthplaces move and must be carried along path().
    bool moves() const { return path_ != nullptr; }
    const BodyPath& path() const { return *path_; }

    // Returns true for a set without points, or a sequence without data in this interval.
    bool empty() const { return is_absent_ || (!scatter_ && values_.empty()); }
    bool has_normals() const { return has_normals_; }
    // Returns true if its attribute v must be added to the velocity of its path.
    bool has_own_velocity() const { return !path_is_of_v_; }

    // Attributes of its points, of a mesh's vertices, or of the corners of its faces, including v; read through
    // value().
    const PointSet& values() const { return values_; }
    // Returns the attributes that newborn points inherit: all except those that every point has individually (P, v,
    // id, age, ...).
    std::vector<std::string> inherited() const;

    // Places birth number births[i] at out[i]. N has length 1, or 0 if there is no normal. Source points are taken in
    // order, cyclically, or at random; with a density always at random. Draws from the uses 0 to 15 and 17 of the key.
    void place(RandomKey key, const Items& births, bool in_order, std::span<Birthplace> out) const;

    // Returns true if births are on faces that deform. redraw() then rejects and redraws birthplaces, so that births
    // are uniform by the area at their own times. time(i): of birth i at out[i], from 0 to 1 in the interval; an age
    // that is an attribute of the source changes with the birthplace. Draws from the use 18 of the key and, under other
    // keys, from those of place().
    bool redraws() const { return !largest_areas_.empty(); }
    void redraw(RandomKey key, const Items& births, std::span<Birthplace> out,
                const std::function<double(std::size_t)>& time) const;

    // Returns a column of values() at a birthplace: the point's own value, or the barycentric interpolation on a mesh.
    template <class T>
    T value(const Strided<T>& column, const Birthplace& place) const
    {
        if constexpr (std::is_same_v<T, float> || std::is_same_v<T, Vec3f>) {
            if (scatter_ && is_of_corners_) {
                const std::size_t first = 3 * static_cast<std::size_t>(place.element);
                const T &a = column[first], &b = column[first + 1], &c = column[first + 2];
                if (a == b && b == c) return a;  // an attribute of faces
                return a * (1 - place.b1 - place.b2) + b * place.b1 + c * place.b2;
            }
            if (scatter_) {
                const Mesh::Triangle& corner = mesh_->triangles[static_cast<std::size_t>(place.element)];
                const auto at = [&](int i) { return column[static_cast<std::size_t>(corner[i])]; };
                return at(0) * (1 - place.b1 - place.b2) + at(1) * place.b1 + at(2) * place.b2;
            }
        }
        return column[static_cast<std::size_t>(place.element)];
    }

    // Stores the previous sets of a source that is another set at each step.
    template <class Archive>
    void serialize(Archive& keep)
    {
        if (is_of_points_ && !moving_points_) keep(before_, earlier_, is_fresh_);
    }

private:
    void take_mesh(const MeshPtr& mesh);
    void take_shape(const ShapePtr& shape);
    void take_fog(const DensityGrid& fog);
    void take_curves(const Curves& curves);
    void take_points(PointSet points);
    std::vector<float> densities() const;
    ScatterPtr scatter_on(const MeshPtr& mesh) const;  // uses largest_areas_
    void take_chances();
    Move move_points_to(const FrameClock& clock, std::int64_t step, const PathOptions& options);
    FramePath path_at(const FrameClock& clock, std::int64_t step, const PathOptions& options) const;

    ObjectPtr object_;
    std::string from_, density_, group_;
    std::shared_ptr<const AnimatedMesh> moving_mesh_;    // the object, if it is one
    std::shared_ptr<const AnimatedShape> moving_shape_;  // likewise
    std::shared_ptr<const MovingCurves> moving_curves_;  // likewise
    BodyPathPtr path_;
    std::vector<double> largest_areas_;  // m², of the faces of mesh_ in the interval, if they deform
    ScatterPtr scatter_;                 // null: births are at the points of values_
    MeshPtr mesh_;                       // birthplaces refer to its triangles
    PointSet values_;
    bool is_of_corners_ = false;  // values_ has three per triangle of mesh_
    Column<Vec3f> normals_;       // of the points
    AliasTable chances_;          // of the points, by their density
    bool has_normals_ = false, is_absent_ = false;

    // For points: their motion, or the previous sets if a function of the frame gives a new set at each step.
    std::shared_ptr<const AnimatedPoints> moving_points_;
    std::optional<PointSet> before_, earlier_;
    bool is_of_points_ = false, path_is_of_v_ = false;
    bool is_fresh_ = false;  // follows another set and has not moved yet
};

}  // namespace rapid
