#include "bindings/scene/scene_error.h"

#include <fmt/format.h>

#include <new>

namespace rapid {

std::string SceneError::text() const
{
    std::string place = file.empty() ? "" : line > 0 ? fmt::format("{}:{}: ", file, line) : file + ": ";
    if (!node.empty()) place += fmt::format("node \"{}\": ", node);
    return place + message;
}

SceneError wrong_call(std::string message)
{
    SceneError error;
    error.kind = SceneError::WrongCall;
    error.message = std::move(message);
    return error;
}

SceneError caught_error(SceneError::Kind kind)
{
    SceneError result;
    try {
        throw;
    } catch (const Refusal& refusal) {
        return refusal.error;
    } catch (const Error& error) {
        result.kind = kind;
        result.message = error.message();
        result.file = error.location().file;
        result.line = error.location().line;
        result.node = error.node();
    } catch (const std::bad_alloc&) {
        result.kind = SceneError::OutOfMemory;
        result.message = "out of memory";
    } catch (const std::exception& error) {
        result.message = error.what();
    } catch (...) {
        result.message = "an exception that is no std::exception";
    }
    return result;
}

}  // namespace rapid
