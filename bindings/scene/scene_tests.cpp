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
    if (options.threads < 0 || options.threads > most_threads)
        refuse(fmt::format("threads = {}; it must be from 0 to {}", options.threads, most_threads));
    TestOptions result{options.filter, options.already_run, options.threads, {}};
    result.on_timeout = [late = options.late](const std::string& message) { call_hook(late, message); };
    return result;
}

}  // namespace

Result<Done> run_scene_tests(const std::string& file, const SceneTestOptions& options,
                             const std::function<void(const SceneTestEvent& event)>& tell)
{
    try {
        std::exception_ptr thrown;  // which may not pass through Lua
        run_test_file(file, engine_options(options), [&](const TestEvent& event) {
            if (!tell || thrown) return;
            try {
                call_program("listener", tell,
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
