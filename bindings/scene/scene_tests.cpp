// Tests of scenes in Lua.
#include <fmt/format.h>

#include <exception>

#include "bindings/host/testing/run_tests.h"
#include "bindings/scene/scene_error.h"
#include "bindings/scene/scene_tests.h"

namespace rapid {
namespace {

TestOptions engine_options(const SceneTestOptions& options)
{
    if (options.already_run < 0) refuse(fmt::format("already_run = {}; it must be at least 0", options.already_run));
    if (options.threads < 0 || options.threads > max_threads)
        refuse(fmt::format("threads = {}; it must be from 0 to {}", options.threads, max_threads));
    TestOptions result{options.filter, options.already_run, options.threads, {}};
    result.on_timeout = [on_script_timeout = options.on_script_timeout](const std::string& message) {
        call_hook(on_script_timeout, message);
    };
    return result;
}

}  // namespace

Result<Done> run_scene_tests(const std::string& file, const SceneTestOptions& options,
                             const std::function<void(const SceneTestEvent& event)>& on_event)
{
    try {
        std::exception_ptr thrown;  // which may not pass through Lua
        run_test_file(file, engine_options(options), [&](const TestEvent& event) {
            if (!on_event || thrown) return;
            try {
                call_program("listener", on_event,
                             SceneTestEvent{static_cast<SceneTestEvent::Kind>(event.kind), event.name, event.message});
            } catch (...) {
                thrown = std::current_exception();
            }
        });
        if (thrown) std::rethrow_exception(thrown);
        return Done();
    } catch (...) {
        return caught_error(SceneError::WrongCall);
    }
}

}  // namespace rapid
