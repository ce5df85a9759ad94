// A function of one point, given by the host of the scripting language, for native nodes that take one (`where`): they
// do not know which language it is.
#pragma once

#include <memory>
#include <span>

#include "runtime/graph/node.h"
#include "runtime/object.h"
#include "runtime/parallel.h"

namespace rapid {

// A function that is asked about the points of one set.
class PointTest {
public:
    virtual ~PointTest() = default;

    // When columns stay where they are. of_all: it will be asked about all points.
    virtual void begin(bool of_all) = 0;
    // Points a chunk, see EditPass.
    virtual std::size_t chunk() const { return chunk_size; }
    // Leaves those of `selected` for which it is true; from 0 or 1 to 0 or 1, for the points from `begin` on. Of any
    // chunk, from any thread. Error: what the script raised, with the point.
    virtual void test(std::size_t begin, std::span<std::uint8_t> selected) const = 0;
};

class PointFunction : public Object {
public:
    static constexpr std::string_view param_type = "function of a point";
    std::string_view kind() const override { return "function"; }

    // The names that it reads, from its code.
    virtual void uses(Uses& uses) const = 0;
    // Whether it may ask for a point's place in the set.
    virtual bool asks_places() const = 0;

    // The set and `now` outlive what is made.
    virtual std::unique_ptr<PointTest> test_of(const PointSet& points, const Evaluation& now) const = 0;
};

}  // namespace rapid
