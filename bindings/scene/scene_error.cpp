#include "bindings/scene/scene_error.h"

#include <new>

#include "runtime/cancellation.h"
#include "runtime/setting_names.h"

namespace rapid {
namespace {

// Whether it is of memory that the system or a limit refuses. Errors pass through Lua as their text, so that is all
// that tells: Rapid's (runtime/at_node.h), LuaJIT's, and those of the limits. "C++ exception" is LuaJIT's word for one
// that passes through it: functions for Lua turn theirs into errors (guarded()), so it is one for which there was no
// memory, neither.
bool is_of_memory(std::string_view message)
{
    for (const std::string& words :
         {std::string("out of memory"), std::string("not enough memory"), std::string("C++ exception"),
          name_of(Setting::ScriptMemory) + " sets the limit", "or set " + name_of(Setting::Memory)})
        if (message.find(words) != message.npos) return true;
    return false;
}

SceneError error_of(SceneError::Kind kind, std::string message)
{
    SceneError error;
    error.kind = kind;
    error.message = std::move(message);
    return error;
}

}  // namespace

std::string_view version() { return RAPID_VERSION; }

std::string SceneError::text() const
{
    Error error(message);
    return error.in_node(node).at({file, line}).what();
}

SceneError wrong_call(std::string message) { return error_of(SceneError::WrongCall, std::move(message)); }

SceneError busy()
{
    return error_of(
        SceneError::Busy,
        "the scene is in another call: of another thread, or the one that has called back; wait for its end");
}

void end_as_cancelled() { throw SceneException(error_of(SceneError::Cancelled, Cancellation::text)); }

SceneError caught_error(SceneError::Kind kind)
{
    try {
        throw;
    } catch (const SceneException& exception) {
        return exception.error();
    } catch (const Error& error) {
        SceneError result = error_of(is_of_memory(error.message()) ? SceneError::OutOfMemory : kind, error.message());
        result.file = error.location().file;
        result.line = error.location().line;
        result.node = error.node();
        result.script_stack = error.trace();
        return result;
    } catch (const std::bad_alloc&) {
        return error_of(SceneError::OutOfMemory, "out of memory");
    } catch (const std::exception& error) {
        return error_of(SceneError::Unexpected, error.what());
    } catch (...) {
        return error_of(SceneError::Unexpected, "an exception that is no std::exception");
    }
}

}  // namespace rapid
