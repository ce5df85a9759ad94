// Random sequences of calls of rapid.h (tests/scene/call_model.h). Handles that are closed, of another type, made up or
// NULL are refused, and so are wrong names, sizes, numbers, files and arrays.
//
//   HOST_CALLS=24000 test_c "any sequence*"      more sequences; RC_PARAMS="seed=7" generates others
#include <exception>
#include <limits>
#include <thread>

#include "include/rapid/rapid.h"
#include "tests/scene/call_model.h"

namespace rapid {
namespace {

using test::Answer;
using test::Hostile;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

template <class Struct>
Struct sized()
{
    Struct value{};
    value.size = sizeof value;
    return value;
}

// Makes a call whose last argument is the error.
template <class Function>
Answer answer(const Function& call)
{
    rapid_error* error = nullptr;
    const int status = call(&error);
    const Answer result{status, rapid_error_text(error)};
    rapid_error_release(error);
    return result;
}

template <class Function>
Hostile hostile_call(Function call)
{
    return [call] { return answer(call); };
}

rapid_setting number_setting(const char* name, double value) { return {name, {RAPID_NUMBER, {value, 0, 0}, nullptr}}; }

// Offers an invalid object to a scene. It is refused at once, or when the scene gets it.
template <class Function>
Hostile hostile_offer(rapid_scene* scene, Function call)
{
    return hostile_call([=](rapid_error** e) {
        rapid_offers* offers = nullptr;
        rapid_offers_new(&offers, nullptr);
        int status = call(offers, e);
        if (status == RAPID_OK) status = rapid_scene_offer(scene, offers, e);
        rapid_offers_release(offers, nullptr);
        return status;
    });
}

// Calls that open a scene.
Hostile hostile_text(const char* text, const rapid_options& options = rapid_default_options())
{
    return hostile_call([=](rapid_error** e) {
        rapid_scene* scene = nullptr;
        const int status = rapid_scene_open_text("hostile.lua", text, &options, &scene, e);
        if (scene) rapid_scene_release(scene, nullptr);
        return scene && status != RAPID_OK ? static_cast<int>(RAPID_OK) : status;  // a scene despite an error
    });
}

struct CFace {
    using Scene = rapid_scene*;
    using Frame = rapid_frame*;
    using Snapshot = rapid_snapshot*;
    static constexpr bool refuses_closed = true;

    CFace() = default;
    CFace(const CFace&) = delete;
    CFace& operator=(const CFace&) = delete;
    ~CFace()
    {
        for (rapid_scene* scene : scenes_) rapid_scene_release(scene, nullptr);
        for (rapid_frame* frame : frames_) rapid_frame_release(frame, nullptr);
        for (rapid_snapshot* snapshot : snapshots_) rapid_snapshot_release(snapshot, nullptr);
    }

    Answer open(Scene& scene)
    {
        const Answer result = answer([&](rapid_error** e) {
            return rapid_scene_open_text("fall.lua", test::falling_scene, nullptr, &scene, e);
        });
        if (scene) scenes_.push_back(scene);
        return result;
    }
    Answer close(Scene scene)
    {
        return answer([&](rapid_error** e) { return rapid_scene_release(scene, e); });
    }
    Answer advance(Scene scene, Frame& frame)
    {
        return with(frame, [&](rapid_error** e) { return rapid_scene_advance(scene, &frame, e); });
    }
    Answer advance_to(Scene scene, std::int64_t number, Frame& frame)
    {
        return with(frame, [&](rapid_error** e) { return rapid_scene_advance_to(scene, number, &frame, e); });
    }
    static bool is_there(Frame frame) { return frame != nullptr; }
    Answer restart(Scene scene)
    {
        return answer([&](rapid_error** e) { return rapid_scene_restart(scene, e); });
    }
    Answer set(Scene scene, const char* name, double value)
    {
        const rapid_setting setting = number_setting(name, value);
        return answer([&](rapid_error** e) { return rapid_scene_set(scene, &setting, 1, e); });
    }
    Answer save(Scene scene, Snapshot& snapshot)
    {
        const Answer result = answer([&](rapid_error** e) { return rapid_scene_save(scene, &snapshot, e); });
        if (snapshot) snapshots_.push_back(snapshot);
        return result;
    }
    Answer restore(Scene scene, Snapshot snapshot)
    {
        return answer([&](rapid_error** e) { return rapid_scene_restore(scene, snapshot, e); });
    }
    Answer cancel(Scene scene)
    {
        return answer([&](rapid_error** e) { return rapid_scene_cancel(scene, e); });
    }
    Answer release(Frame frame)
    {
        return answer([&](rapid_error** e) { return rapid_frame_release(frame, e); });
    }
    Answer release(Snapshot snapshot)
    {
        return answer([&](rapid_error** e) { return rapid_snapshot_release(snapshot, e); });
    }
    Answer height(Frame frame, std::size_t& count, double& y)
    {
        auto P = sized<rapid_column>();
        const Answer result = answer([&](rapid_error** e) { return rapid_frame_column(frame, "P", &P, e); });
        count = P.count;
        if (P.data) y = static_cast<const float*>(P.data)[1];
        return result;
    }
    Answer inspect(Scene scene, const Frame* frame, std::int64_t& next)
    {
        return answer([&](rapid_error** e) -> int {
            const char* text = nullptr;
            int same = 0;
            if (frame)
                for (const int status :
                     {rapid_frame_describe(*frame, &text, e), rapid_frame_statistics_json(*frame, &text, e),
                      rapid_frame_columns(*frame, &text, e), rapid_frame_compare(*frame, *frame, 0, &same, nullptr, e)})
                    if (status != RAPID_OK) return status;
            test::require(!frame || same == 1, "a frame is not the same as itself");
            if (const int status = rapid_scene_explain(scene, &text, e); status != RAPID_OK) return status;
            next = rapid_scene_next_frame(scene);
            return RAPID_OK;
        });
    }

    std::vector<Hostile> hostile(Scene& scene, const Frame* frame, const Snapshot* snapshot)
    {
        std::vector<Hostile> all = forged(scene);
        add_openings(all);
        add_settings(all, scene);
        add_offers(all, scene);
        if (frame) add_frames(all, scene, *frame);
        if (snapshot)
            for (const char* path : {"", "/dev/full/x", "/dev/full"})
                all.push_back(hostile_call(
                    [=, file = *snapshot](rapid_error** e) { return rapid_snapshot_write(file, path, e); }));
        return all;
    }

private:
    template <class Function>
    Answer with(Frame& frame, const Function& call)
    {
        const Answer result = answer(call);
        if (frame) frames_.push_back(frame);
        return result;
    }

    // Returns handles of another type, made-up handles and NULL.
    std::vector<Hostile> forged(Scene open)
    {
        std::vector<Hostile> all;
        for (void* const wrong : {static_cast<void*>(nullptr), static_cast<void*>(this),
                                  frames_.empty() ? nullptr : static_cast<void*>(frames_[0]),
                                  snapshots_.empty() ? nullptr : static_cast<void*>(snapshots_[0])}) {
            auto* const scene = static_cast<rapid_scene*>(wrong);
            all.push_back(hostile_call([=](rapid_error** e) { return rapid_scene_advance(scene, nullptr, e); }));
            all.push_back(hostile_call([=](rapid_error** e) { return rapid_scene_release(scene, e); }));
        }
        all.push_back(hostile_call(
            [=](rapid_error** e) { return rapid_frame_release(reinterpret_cast<rapid_frame*>(open), e); }));
        all.push_back(hostile_call([=](rapid_error** e) { return rapid_scene_save(open, nullptr, e); }));
        all.push_back(hostile_call([=](rapid_error** e) { return rapid_scene_restore(open, nullptr, e); }));
        return all;
    }

    static void add_openings(std::vector<Hostile>& all)
    {
        for (const char* text : {static_cast<const char*>(nullptr), "", "return", "return 3", "error {}", "\x1bLJ",
                                 "return require 'rapid'.create { 3 }", "local function f() return f() + 1 end f()",
                                 "return ('x'):rep(1e15)", "return (((", "error(('x'):rep(1e7))"})
            all.push_back(hostile_text(text));
        rapid_options options = rapid_default_options();
        options.size = 0;
        all.push_back(hostile_text(test::falling_scene, options));
        options = rapid_default_options();
        options.set_count = 7;
        all.push_back(hostile_text(test::falling_scene, options));
        options = rapid_default_options();
        options.threads = -1;
        all.push_back(hostile_text(test::falling_scene, options));
        options = rapid_default_options();
        options.script_seconds = nan;
        all.push_back(hostile_text(test::falling_scene, options));
        for (const char* path : {static_cast<const char*>(nullptr), "", "/", "/dev/zero", "/none.lua"}) {
            all.push_back(hostile_call([=](rapid_error** e) {
                rapid_scene* none = nullptr;
                return rapid_scene_open(path, nullptr, &none, e);
            }));
            all.push_back(hostile_call([=](rapid_error** e) {
                rapid_frame* none = nullptr;
                return rapid_frame_read(path, &none, e);
            }));
            all.push_back(hostile_call([=](rapid_error** e) {
                rapid_snapshot* none = nullptr;
                return rapid_snapshot_read(path, &none, e);
            }));
        }
        all.push_back(hostile_call([](rapid_error** e) {
            const char* text = nullptr;
            return rapid_frame_text_of(0xffffffff, &text, e);
        }));
        all.push_back(hostile_call([](rapid_error** e) {
            std::uint32_t token = 0;
            return rapid_frame_token_of("\xff", &token, e);
        }));
    }

    static void add_settings(std::vector<Hostile>& all, Scene scene)
    {
        const rapid_setting text = {"height", {RAPID_TEXT, {0, 0, 0}, nullptr}},
                            unknown = {"height", {99, {0, 0, 0}, nullptr}},
                            vector = {"height", {RAPID_VEC3, {1, 2, 3}, nullptr}};
        for (const rapid_setting& setting :
             {text, unknown, vector, number_setting(nullptr, 1), number_setting("", 1), number_setting("height.x.y", 1),
              number_setting("solve.substeps", -1), number_setting("solve.substeps", 1e300),
              number_setting("solve.substeps", nan), number_setting("none.none", 1)})
            all.push_back(hostile_call([=](rapid_error** e) { return rapid_scene_set(scene, &setting, 1, e); }));
        all.push_back(hostile_call([=](rapid_error** e) { return rapid_scene_set(scene, nullptr, 3, e); }));
        for (const std::size_t place : {std::size_t{99}, ~std::size_t{0}}) {
            all.push_back(hostile_call([=](rapid_error** e) {
                auto parameter = sized<rapid_parameter>();
                return rapid_scene_parameter(scene, place, &parameter, e);
            }));
            all.push_back(hostile_call([=](rapid_error** e) {
                auto node = sized<rapid_node>();
                return rapid_scene_node(scene, place, &node, e);
            }));
        }
        all.push_back(hostile_call([=](rapid_error** e) { return rapid_scene_parameter(scene, 0, nullptr, e); }));
        all.push_back(hostile_call([=](rapid_error** e) {
            const char* graph = nullptr;
            return rapid_scene_graph(scene, 77, &graph, e);
        }));
        static constexpr std::int64_t ids[] = {0};
        struct Trace {
            const std::int64_t* ids;
            std::size_t count;
            const char* create;
            std::int64_t last;
        };
        for (const Trace& trace : {Trace{nullptr, 4, nullptr, 2}, Trace{ids, 0, nullptr, 2}, Trace{ids, 1, "none", 2},
                                   Trace{ids, 1, nullptr, -5}})
            all.push_back(hostile_call([=](rapid_error** e) {
                const char* lives = nullptr;
                return rapid_scene_trace(scene, trace.ids, trace.count, trace.create, 1, trace.last, &lives, e);
            }));
        for (const auto& [node, frame] : {std::pair{"none", 2}, std::pair{"create1", -5}, std::pair{"", 2}})
            all.push_back(hostile_call([scene, node = node, frame = frame](rapid_error** e) {
                rapid_frame* points = nullptr;
                return rapid_scene_points_after(scene, node, frame, &points, e);
            }));
    }

    static void add_offers(std::vector<Hostile>& all, Scene scene)
    {
        static const float corners[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
        for (const std::int32_t corner : {-1, 3, std::numeric_limits<std::int32_t>::max()})
            all.push_back(hostile_offer(scene, [=](rapid_offers* offers, rapid_error** e) {
                const std::int32_t triangle[] = {0, 1, corner};
                return rapid_offers_mesh(offers, "mesh", corners, 3, triangle, 1, e);
            }));
        all.push_back(hostile_offer(scene, [](rapid_offers* offers, rapid_error** e) {
            return rapid_offers_mesh(offers, "mesh", nullptr, 3, nullptr, 1, e);
        }));
        for (const auto& [name, type, data] :
             {std::tuple{"P", 99, corners}, std::tuple{"P", int{RAPID_FLOAT_VEC3}, static_cast<const float*>(nullptr)},
              std::tuple{"Q", int{RAPID_FLOAT_VEC3}, corners}, std::tuple{"P", int{RAPID_INT32}, corners},
              std::tuple{static_cast<const char*>(nullptr), int{RAPID_FLOAT_VEC3}, corners}})
            all.push_back(
                hostile_offer(scene, [name = name, type = type, data = data](rapid_offers* offers, rapid_error** e) {
                    auto column = sized<rapid_column>();
                    column.name = name, column.type = type, column.data = data;
                    return rapid_offers_points(offers, "cloud", 3, &column, 1, e);
                }));
        all.push_back(hostile_offer(scene, [](rapid_offers* offers, rapid_error** e) {
            const auto shape = sized<rapid_shape>();  // without a callback
            return rapid_offers_shape(offers, "ball", &shape, e);
        }));
        all.push_back(hostile_offer(scene, [](rapid_offers* offers, rapid_error** e) {
            auto type = sized<rapid_node_type>();
            type.name = "no name", type.kind = 99;
            return rapid_offers_node(offers, &type, e);
        }));
        all.push_back(hostile_call([=](rapid_error** e) { return rapid_scene_offer(scene, nullptr, e); }));
        all.push_back(hostile_call([](rapid_error** e) { return rapid_call_add_rod(nullptr, 0, 1, 1, 0, e); }));
    }

    static void add_frames(std::vector<Hostile>& all, Scene scene, Frame frame)
    {
        for (const char* name : {static_cast<const char*>(nullptr), "", "none", "P.x", "\xff\x1b[2J"})
            for (const auto function : {rapid_frame_column, rapid_frame_group, rapid_frame_expanded})
                all.push_back(hostile_call([=](rapid_error** e) {
                    auto column = sized<rapid_column>();
                    return function(frame, name, &column, e);
                }));
        all.push_back(hostile_call([=](rapid_error** e) {
            rapid_column column{};  // of no size
            return rapid_frame_column(frame, "P", &column, e);
        }));
        all.push_back(hostile_call([=](rapid_error** e) { return rapid_frame_column(frame, "P", nullptr, e); }));
        all.push_back(hostile_call([=](rapid_error** e) {
            rapid_value value{};
            return rapid_frame_detail(frame, "none", &value, e);
        }));
        all.push_back(hostile_call([=](rapid_error** e) {
            rapid_frame* output = nullptr;
            return rapid_frame_output(frame, "none", &output, e);
        }));
        for (const char* path : {static_cast<const char*>(nullptr), "", "x", "x.none", "/dev/full/x.csv", "/dev/full"})
            all.push_back(hostile_call([=](rapid_error** e) { return rapid_frame_write(frame, path, e); }));
        for (const double tolerance : {-1.0, nan})
            all.push_back(hostile_call(
                [=](rapid_error** e) { return rapid_frame_compare(frame, frame, tolerance, nullptr, nullptr, e); }));
        for (const int edge : {0, -5, std::numeric_limits<int>::max()})
            all.push_back(hostile_call([=](rapid_error** e) {
                const void* png = nullptr;
                std::size_t bytes = 0;
                return rapid_scene_picture(scene, frame, edge, edge, &png, &bytes, e);
            }));
    }

    std::vector<rapid_scene*> scenes_;
    std::vector<rapid_frame*> frames_;
    std::vector<rapid_snapshot*> snapshots_;
};

}  // namespace

TEST_CASE("any sequence of calls does what the model says", "[c][random]") { test::check_random_calls<CFace>(); }

TEST_CASE("sequences of calls on several threads do not know of each other", "[c][threads]")
{
    rc::prop("calls on three threads", [] {
        std::exception_ptr failed[3];
        std::vector<std::thread> threads;
        for (std::exception_ptr& fault : failed)
            threads.emplace_back([&fault, sequence = *test::calls()] {
                try {
                    test::run_calls<CFace>(sequence);
                } catch (...) {
                    fault = std::current_exception();
                }
            });
        for (std::thread& thread : threads) thread.join();
        for (const std::exception_ptr& fault : failed)
            if (fault) std::rethrow_exception(fault);
    });
}

}  // namespace rapid
