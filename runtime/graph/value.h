// Values of a graph file for the parameters of nodes, converted by the host of the scripting language.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "runtime/base/frame.h"
#include "runtime/base/object.h"
#include "runtime/math/vec.h"

namespace rapid {

struct Value;

// `rapid.attr "bounce"`: the value of each point's attribute.
struct AttributeRef {
    std::string name;
};

// A table: list part (1, 2, ...), other integer keys, and names.
struct Table {
    std::vector<Value> list;
    std::map<std::int64_t, Value> numbered;  // keys outside the list part
    std::map<std::string, Value> named;
};

// A parameter given as a function of the frame. It is called on one thread, before the frame is computed.
class FrameFunction {
public:
    virtual ~FrameFunction() = default;
    // Throws the script's Error, with its location.
    virtual Value call(const Frame& frame) const = 0;
};

struct Value : std::variant<std::monostate, bool, double, std::string, Vec3d, AttributeRef,
                            std::shared_ptr<const Table>, ObjectPtr, std::shared_ptr<const FrameFunction>> {
    using variant::variant;

    bool is_nil() const { return std::holds_alternative<std::monostate>(*this); }
    template <class T>
    const T* get() const
    {
        return std::get_if<T>(this);
    }
    const Table* table() const
    {
        const auto* pointer = get<std::shared_ptr<const Table>>();
        return pointer ? pointer->get() : nullptr;
    }
    // Returns the object if it is a T.
    template <class T>
    std::shared_ptr<const T> object() const
    {
        const auto* pointer = get<ObjectPtr>();
        return pointer ? std::dynamic_pointer_cast<const T>(*pointer) : nullptr;
    }
    const FrameFunction* function() const
    {
        const auto* pointer = get<std::shared_ptr<const FrameFunction>>();
        return pointer ? pointer->get() : nullptr;
    }
};

// Returns a description for messages: 1.4, "up", {0, 1, 0}, a mesh, a function, nil.
std::string describe(const Value& value);

}  // namespace rapid
