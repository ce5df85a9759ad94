#include "bindings/command_line/or_throw.h"

#include <new>
#include <stdexcept>

namespace rapid {

Error as_error(const SceneError& error)
{
    Error result(error.message);
    if (!error.node.empty()) result.in_node(error.node);
    return result.at({error.file, error.line}).with_trace(SceneError::script_stack());
}

void throw_error(const SceneError& error)
{
    const bool has_place = !error.file.empty() || !error.node.empty();
    if (error.kind == SceneError::OutOfMemory && !has_place && error.message == "out of memory") throw std::bad_alloc();
    if (error.kind == SceneError::Unexpected) throw std::runtime_error(error.message);
    throw as_error(error);
}

}  // namespace rapid
