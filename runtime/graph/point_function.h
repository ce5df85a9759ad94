// A function of a point, from the host of the scripting language, as a parameter of native nodes (`where`).
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "runtime/base/error.h"
#include "runtime/base/frame.h"
#include "runtime/base/object.h"
#include "runtime/base/parallel.h"
#include "runtime/graph/evaluation.h"
#include "runtime/graph/node.h"

namespace rapid {

// A function of a point, evaluated on the points of one set.
class PointTest {
public:
    virtual ~PointTest() = default;

    // Is called when columns keep their addresses. of_all: it will be evaluated for all points.
    virtual void begin(bool of_all) = 0;
    // Points per chunk; see EditPass.
    virtual std::size_t chunk() const { return chunk_size; }
    // Clears `selected` (0 or 1, for the points from `begin` on) if the function is false. May be called for any
    // chunk, from any thread. Throws the script's Error, with the point.
    virtual void test(std::size_t begin, std::span<std::uint8_t> selected) const = 0;
};

class PointFunction : public Object {
public:
    static constexpr std::string_view param_type = "function of a point";
    std::string_view kind() const override { return "function"; }

    // Adds the attributes that its code reads.
    virtual void uses(Uses& uses) const = 0;
    // Returns true if it may read a point's index in the set; for a function of all points at once, if it may read any
    // point.
    virtual bool reads_indices() const = 0;
    // Returns the objects, such as shapes, that its code can query. Nothing if they are not known.
    virtual std::optional<std::vector<ObjectPtr>> objects() const = 0;

    // Creates the test. The set and `now` must outlive it.
    virtual std::unique_ptr<PointTest> test_of(const PointSet& points, const Evaluation& now) const = 0;
};

// A function of a point, from the host of the scripting language, that edits points for a native node.
class PointEditor {
public:
    virtual ~PointEditor() = default;

    // Calls the function for the points from `first` on, in parallel, and removes those that it kills. Throws the
    // script's Error, with the point.
    virtual void edit(PointSet& points, std::size_t first, const Evaluation& now) const = 0;
};

// An argument of a node whose text names attributes, such as the body of a function of a point.
class AttributeLocations {
public:
    virtual ~AttributeLocations() = default;

    // Returns the first location that names the attribute; line 0 if there is none.
    virtual Location location_of(const std::string& attribute) const = 0;

    // Returns the number of components of the value that it assigns to the attribute: 3 for a vec3, 4 for a
    // quaternion, 0 if unknown.
    virtual int numbers_of(const std::string& attribute) const = 0;
};

// An argument of a node that queries moving shapes, such as a function of a point. It is notified of each step before
// the node is evaluated.
class StepShapeUser {
public:
    virtual ~StepShapeUser() = default;

    virtual bool queries_moving_shapes() const = 0;
    // Begins the step that ends at `frame`. Must be called on one thread. Throws the Error of a motion, or of a file
    // of a sequence.
    virtual void begin_step(const FrameClock& clock, const Frame& frame) const = 0;
};

// An interface of values in a graph file that know their location.
class Located {
public:
    virtual ~Located() = default;
    virtual Location location() const = 0;
};

}  // namespace rapid
