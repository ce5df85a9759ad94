// What a graph's parameters can hold besides numbers and text: shapes, meshes, point sets, motions, functions. Made
// once, never changed, shared between nodes, states and threads.
#pragma once

#include <memory>
#include <string_view>

namespace rapid {

class Object {
public:
    static constexpr std::string_view param_type = "object";
    virtual ~Object() = default;

    // What it is called in messages: "mesh", "level set", "shape", "points", "motion", "function".
    virtual std::string_view kind() const = 0;

    // Whether it is another at each time: a motion that is not constant, and what such a motion moves.
    virtual bool varies() const { return false; }
};

using ObjectPtr = std::shared_ptr<const Object>;

}  // namespace rapid
