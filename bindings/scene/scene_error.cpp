#include "bindings/scene/scene_error.h"

#include <new>

namespace rapid {
namespace {

SceneError error_in_header(const Error& error, SceneError::Kind fault)
{
    SceneError result;
    switch (error.kind()) {
        case ErrorKind::Fault:
            result.kind = fault;
            break;
        case ErrorKind::WrongCall:
            result.kind = SceneError::WrongCall;
            break;
        case ErrorKind::Cancelled:
            result.kind = SceneError::Cancelled;
            break;
        case ErrorKind::TooLong:
            result.kind = SceneError::TooLong;
            break;
        case ErrorKind::OutOfMemory:
            result.kind = SceneError::OutOfMemory;
            break;
    }
    result.message = error.message();
    result.file = error.location().file;
    result.line = error.location().line;
    result.node = error.node();
    result.script_stack = error.trace();
    return result;
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

std::string SceneError::text() const { return error_text({file, line}, node, message); }

SceneError wrong_call(std::string message) { return error_of(SceneError::WrongCall, std::move(message)); }

SceneError busy()
{
    return error_of(SceneError::Busy,
                    "the scene is in another call, of another thread or of the current callback; wait for its end");
}

SceneError caught_error(SceneError::Kind fault)
{
    try {
        throw;
    } catch (const Error& error) {
        return error_in_header(error, fault);
    } catch (const SceneException& exception) {
        return exception.error();
    } catch (const std::bad_alloc&) {
        return error_of(SceneError::OutOfMemory, "out of memory");
    } catch (const std::exception& error) {
        return error_of(SceneError::Unexpected, error.what());
    } catch (...) {
        return error_of(SceneError::Unexpected, "an exception that is not a std::exception");
    }
}

}  // namespace rapid
