// Objects as parameter values: shapes, meshes, point sets, motions, functions. They are immutable and shared between
// nodes, states and threads.
#pragma once

#include <memory>
#include <string_view>

namespace rapid {

class Object {
public:
    static constexpr std::string_view param_type = "object";
    virtual ~Object() = default;

    // Returns its name in messages: "mesh", "level set", "shape", "points", "motion", "function".
    virtual std::string_view kind() const = 0;

    // Returns true if it changes with time, such as a motion that is not constant, or an object that one moves.
    virtual bool varies() const { return false; }
};

using ObjectPtr = std::shared_ptr<const Object>;

}  // namespace rapid
