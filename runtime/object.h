// Objects as values of parameters: shapes, meshes, point sets, motions, functions. Immutable, and shared between nodes,
// states and threads.
#pragma once

#include <memory>
#include <string_view>

namespace rapid {

class Object {
public:
    static constexpr std::string_view param_type = "object";
    virtual ~Object() = default;

    // Its name in messages: "mesh", "level set", "shape", "points", "motion", "function".
    virtual std::string_view kind() const = 0;

    // Whether it changes with time: a motion that is not constant, and an object that it moves.
    virtual bool varies() const { return false; }
};

using ObjectPtr = std::shared_ptr<const Object>;

}  // namespace rapid
