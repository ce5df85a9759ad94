#include "bindings/command/or_throw.h"

#include <new>
#include <stdexcept>

#include "runtime/error.h"

namespace rapid {

void throw_error(const SceneError& error)
{
    const bool has_place = !error.file.empty() || !error.node.empty();
    if (error.kind == SceneError::OutOfMemory && !has_place && error.message == "out of memory") throw std::bad_alloc();
    if (error.kind == SceneError::Unexpected) throw std::runtime_error(error.message);
    Error told(error.message);
    if (!error.node.empty()) told.in_node(error.node);
    throw told.at({error.file, error.line});
}

}  // namespace rapid
