#include "bindings/scene/scene_error.h"

#include <fmt/format.h>

#include <new>

#include "runtime/cancellation.h"
#include "runtime/of_thread.h"

namespace rapid {
namespace {

thread_local OfThread<std::string> last_script_stack;

// Where memory does not do for it there is none.
void keep_script_stack(const std::string& stack) noexcept
{
    try {
        *last_script_stack = stack;
    } catch (const std::bad_alloc&) {
        try {
            (*last_script_stack).clear();
        } catch (const std::bad_alloc&) {  // it has never been kept
        }
    }
}

// Whether it is of memory that the system or a limit refuses. Errors pass through Lua as their text, so that is all
// that tells: Rapid's (runtime/at_node.h), LuaJIT's, and those of the limits. "C++ exception" is LuaJIT's word for one
// that passes through it: functions for Lua turn theirs into errors (guarded()), so it is one for which there was no
// memory, neither.
bool is_of_memory(std::string_view message)
{
    for (const std::string_view words :
         {"out of memory", "not enough memory", "C++ exception", "--script-memory sets the limit", "or set --memory"})
        if (message.find(words) != message.npos) return true;
    return false;
}

}  // namespace

std::string SceneError::text() const
{
    std::string place = file.empty() ? "" : line > 0 ? fmt::format("{}:{}: ", file, line) : file + ": ";
    if (!node.empty()) place += fmt::format("node \"{}\": ", node);
    return place + message;
}

std::string SceneError::script_stack() { return *last_script_stack; }

SceneError wrong_call(std::string message)
{
    keep_script_stack({});
    SceneError error;
    error.kind = SceneError::WrongCall;
    error.message = std::move(message);
    return error;
}

SceneError busy()
{
    keep_script_stack({});
    SceneError error;
    error.kind = SceneError::Busy;
    error.message =
        "the scene is in another call: of another thread, or the one that has called back; wait for its end";
    return error;
}

void end_as_cancelled()
{
    SceneError error = wrong_call(Cancellation::text);
    error.kind = SceneError::Cancelled;
    throw Refusal{std::move(error)};
}

SceneError caught_error(SceneError::Kind kind)
{
    SceneError result;
    try {
        throw;
    } catch (const Refusal& refusal) {
        return refusal.error;
    } catch (const Error& error) {
        keep_script_stack(error.trace());
        result.kind = is_of_memory(error.message()) ? SceneError::OutOfMemory : kind;
        result.message = error.message();
        result.file = error.location().file;
        result.line = error.location().line;
        result.node = error.node();
    } catch (const std::bad_alloc&) {
        keep_script_stack({});
        result.kind = SceneError::OutOfMemory;
        result.message = "out of memory";
    } catch (const std::exception& error) {
        keep_script_stack({});
        result.message = error.what();
    } catch (...) {
        keep_script_stack({});
        result.message = "an exception that is no std::exception";
    }
    return result;
}

}  // namespace rapid
