// Random sequences of calls, right and wrong, against a model of what is open and at which frame it is: each call has
// the status that the model says, and what frames hold is the formula of a fall as long as they are open.
//
//   RC_PARAMS='max_success=100000' test_c "any sequence*"      others and more of them: see also seed=7
#include <fmt/format.h>

#include <cmath>
#include <exception>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "include/rapid/rapid.h"
#include "tests/test.h"

namespace rapid {
namespace {

const char* const fall = R"(
local rapid = require "rapid"
local height = rapid.param("height", 10, "m, of the drop")
return rapid.create { points = rapid.points.from { P = {{0, height, 0}, {1, height, 0}} } } :gravity {} :solve {}
)";

struct ModelScene {
    rapid_scene* handle = nullptr;
    bool open = true, cancelled = false, ready = true;
    std::int64_t next = 1;
    double height = 10, set_height = 10;  // of the run; and of the next start
    bool has_advanced() const { return next > 1; }
};
struct ModelFrame {
    rapid_frame* handle = nullptr;
    bool open = true;
    std::int64_t number = 0;
    double height = 0;
};
struct ModelSnapshot {
    rapid_snapshot* handle = nullptr;
    bool open = true;
    std::int64_t frame = 0;
    double height = 0;
};

// A call: what it does, to which of the things that there have been, and a number.
enum What { Open, Close, Advance, AdvanceByNumber, AdvanceTo, Restart, Set, Save, Restore, Cancel, Release, Refuse };
using Call = std::tuple<What, int, int>;

// Opening and setting run the scene's file, which takes a thousand times as long as any other call.
rc::Gen<std::vector<Call>> calls()
{
    const auto what = rc::gen::weightedElement<What>({{1, Open},
                                                      {3, Close},
                                                      {6, Advance},
                                                      {6, AdvanceByNumber},
                                                      {6, AdvanceTo},
                                                      {6, Restart},
                                                      {1, Set},
                                                      {6, Save},
                                                      {6, Restore},
                                                      {6, Cancel},
                                                      {8, Release},
                                                      {5, Refuse}});
    const auto one = rc::gen::tuple(what, rc::gen::inRange(0, 4), rc::gen::inRange(0, 100));
    return rc::gen::resize(60, rc::gen::container<std::vector<Call>>(one));
}

void require(bool holds, const std::string& what)
{
    if (!holds) throw std::runtime_error(what);  // on any thread
}

class Program {
public:
    ~Program()
    {
        for (const ModelScene& scene : scenes_) rapid_scene_close(scene.handle, nullptr);
        for (const ModelFrame& frame : frames_) rapid_frame_release(frame.handle, nullptr);
        for (const ModelSnapshot& snapshot : snapshots_) rapid_snapshot_release(snapshot.handle, nullptr);
    }

    void call(const Call& call)
    {
        const auto [what, which, number] = call;
        if (scenes_.empty() || what == Open) return open();
        ModelScene& scene = scenes_[which % scenes_.size()];
        switch (what) {
            case Close:
                expect(scene.open ? RAPID_OK : RAPID_WRONG_CALL, rapid_scene_close(scene.handle, error()));
                scene.open = false;
                break;
            case Advance:
            case AdvanceByNumber:
                return advance(scene, scene.next, what == AdvanceByNumber);
            case AdvanceTo:
                return advance(scene, number % 7, true);
            case Restart:
                return restart(scene);
            case Set:
                return set(scene, number);
            case Save:
                return save(scene);
            case Restore:
                return restore(scene, number);
            case Cancel:
                expect(scene.open ? RAPID_OK : RAPID_WRONG_CALL, rapid_scene_cancel(scene.handle, error()));
                scene.cancelled = scene.open;
                break;
            case Release:
                return release(number);
            default:
                return refuse(number);
        }
    }

    // What is open holds what it did at first.
    void check_frames()
    {
        for (const ModelFrame& frame : frames_) {
            rapid_column P{};
            P.size = sizeof P;
            expect(frame.open ? RAPID_OK : RAPID_WRONG_CALL, rapid_frame_column(frame.handle, "P", &P, error()));
            if (!frame.open) continue;
            const double t = static_cast<double>(frame.number - 1) / 24;
            require(P.count == 2, "the number of points");
            const double y = static_cast<const float*>(P.data)[1];
            require(std::abs(y - (frame.height - 9.81 / 2 * t * t)) < 1e-4,
                    fmt::format("a point of frame {} is at {} m", frame.number, y));
        }
    }

private:
    rapid_error** error()
    {
        rapid_error_free(error_);
        error_ = nullptr;
        return &error_;
    }

    void expect(int status, int found)
    {
        const std::string text = rapid_error_text(error_);
        const bool has_error = error_ != nullptr;
        rapid_error_free(error_);
        error_ = nullptr;
        require(found == status, fmt::format("status {} where the model says {}: {}", found, status, text));
        require(has_error == (status != RAPID_OK) && text.empty() == !has_error, "an error without a text, or none");
    }

    void open()
    {
        if (scenes_.size() == 4) return;
        ModelScene scene;
        expect(RAPID_OK, rapid_scene_open_text("fall.lua", fall, nullptr, &scene.handle, error()));
        scenes_.push_back(scene);
    }

    void advance(ModelScene& scene, std::int64_t to, bool by_number)
    {
        ModelFrame frame;
        const bool late = by_number && to < scene.next;
        int status = RAPID_OK;
        if (!scene.open || !scene.ready || late)
            status = RAPID_WRONG_CALL;
        else if (scene.cancelled)
            status = RAPID_CANCELLED;
        expect(status, by_number ? rapid_scene_advance_to(scene.handle, to, &frame.handle, error())
                                 : rapid_scene_advance(scene.handle, &frame.handle, error()));
        require((frame.handle != nullptr) == (status == RAPID_OK), "a frame where there is none, or none");
        if (status == RAPID_CANCELLED) scene.cancelled = false;
        if (status != RAPID_OK) return;
        scene.next = to + 1;
        frame.number = to;
        frame.height = scene.height;
        frames_.push_back(frame);
    }

    void begin(ModelScene& scene)
    {
        scene.next = 1;
        scene.ready = true;
        scene.cancelled = false;
        scene.height = scene.set_height;
    }

    void restart(ModelScene& scene)
    {
        expect(scene.open ? RAPID_OK : RAPID_WRONG_CALL, rapid_scene_restart(scene.handle, error()));
        if (scene.open) begin(scene);
    }

    void set(ModelScene& scene, int number)
    {
        const bool wrong = number % 4 == 0;
        const rapid_setting setting = {wrong ? "heigt" : "height",
                                       {RAPID_NUMBER, {static_cast<double>(number), 0, 0}, nullptr}};
        const bool good = scene.open && !wrong;
        expect(good ? RAPID_OK : RAPID_WRONG_CALL, rapid_scene_set(scene.handle, &setting, 1, error()));
        if (!good) return;
        scene.set_height = number;
        begin(scene);
    }

    void save(ModelScene& scene)
    {
        ModelSnapshot snapshot;
        const bool good = scene.open && scene.ready && scene.has_advanced();
        expect(good ? RAPID_OK : RAPID_WRONG_CALL, rapid_scene_save(scene.handle, &snapshot.handle, error()));
        if (!good) return;
        snapshot.frame = scene.next - 1;
        snapshot.height = scene.height;
        snapshots_.push_back(snapshot);
    }

    void restore(ModelScene& scene, int number)
    {
        if (snapshots_.empty()) return;
        const ModelSnapshot& snapshot = snapshots_[number % snapshots_.size()];
        const bool good = scene.open && snapshot.open;
        expect(good ? RAPID_OK : RAPID_WRONG_CALL, rapid_scene_restore(scene.handle, snapshot.handle, error()));
        if (!good) return;
        begin(scene);
        scene.next = snapshot.frame + 1;
        scene.height = snapshot.height;
    }

    void release(int number)
    {
        if (!frames_.empty() && number % 2 == 0) {
            ModelFrame& frame = frames_[number % frames_.size()];
            expect(frame.open ? RAPID_OK : RAPID_WRONG_CALL, rapid_frame_release(frame.handle, error()));
            frame.open = false;
        } else if (!snapshots_.empty()) {
            ModelSnapshot& snapshot = snapshots_[number % snapshots_.size()];
            expect(snapshot.open ? RAPID_OK : RAPID_WRONG_CALL, rapid_snapshot_release(snapshot.handle, error()));
            snapshot.open = false;
        }
    }

    // Handles of something else, made up, or NULL.
    void refuse(int number)
    {
        void* const wrong[] = {nullptr, this, frames_.empty() ? nullptr : frames_[0].handle,
                               snapshots_.empty() ? nullptr : snapshots_[0].handle};
        auto* const scene = static_cast<rapid_scene*>(wrong[number % 4]);
        std::int64_t frame = 0;
        expect(RAPID_WRONG_CALL, rapid_scene_advance(scene, nullptr, error()));
        expect(RAPID_WRONG_CALL, rapid_scene_next_frame(scene, &frame, error()));
        expect(RAPID_WRONG_CALL, rapid_scene_close(scene, error()));
        expect(RAPID_WRONG_CALL, rapid_frame_release(reinterpret_cast<rapid_frame*>(scenes_[0].handle), error()));
    }

    std::vector<ModelScene> scenes_;
    std::vector<ModelFrame> frames_;
    std::vector<ModelSnapshot> snapshots_;
    rapid_error* error_ = nullptr;
};

void run(const std::vector<Call>& sequence)
{
    Program program;
    for (const Call& call : sequence) program.call(call);
    program.check_frames();
}

}  // namespace

TEST_CASE("any sequence of calls does what the model says", "[c]")
{
    rc::prop("calls", [] { run(*calls()); });
}

TEST_CASE("sequences of calls on several threads do not know of each other", "[c][threads]")
{
    rc::prop("calls on three threads", [] {
        std::exception_ptr failed[3];
        std::vector<std::thread> threads;
        for (std::exception_ptr& fault : failed)
            threads.emplace_back([&fault, sequence = *calls()] {
                try {
                    run(sequence);
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
