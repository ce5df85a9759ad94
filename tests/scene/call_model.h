// Random sequences of valid, wrong and hostile calls, compared with a model of the open objects and their frames. Each
// call has the status that the model predicts, an error has a message, and open frames satisfy the formula of a fall.
//
// A Face makes the calls in one language:
//
//   struct Face {
//       struct Scene, Frame, Snapshot;                 handles; {} is empty
//       static constexpr bool refuses_closed;          whether closed handles may be used, which is an error
//       Answer open(Scene&); ...                       as CallModel uses them
//       std::vector<Hostile> hostile(Scene&, Frame*, Snapshot*)     calls that must be errors and change nothing; with
//   };                                                              open handles, or null if there are none
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "include/rapid/scene.h"
#include "tests/amount.h"
#include "tests/test.h"

namespace rapid::test {

inline const char* const falling_scene = R"(
local rapid = require "rapid"
local height = rapid.param("height", 10, "m, of the drop")
return rapid.create { points = rapid.points.from { P = {{0, height, 0}, {1, height, 0}} } } :gravity {} :solve {}
)";

// The result of a call: 0 or a SceneError::Kind, and the message of the error.
struct Answer {
    int status = 0;
    std::string text = {};
};
using Hostile = std::function<Answer()>;

// A call: its kind, the index of its object among all that were created, and a number.
enum What {
    Open,
    Close,
    Advance,
    AdvanceByNumber,
    AdvanceTo,
    Restart,
    Set,
    Save,
    Restore,
    Cancel,
    Release,
    Inspect,
    Attack
};
using Call = std::tuple<What, int, int>;

// Opening and setting run the scene's file, which takes a thousand times as long as other calls, so they are rarer.
inline rc::Gen<std::vector<Call>> calls()
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
                                                      {3, Inspect},
                                                      {8, Attack}});
    const auto one = rc::gen::tuple(what, rc::gen::inRange(0, 4), rc::gen::inRange(0, 1000));
    return rc::gen::resize(60, rc::gen::container<std::vector<Call>>(one));
}

inline void require(bool holds, const std::string& what)
{
    if (!holds) throw std::runtime_error(what);  // on any thread
}

template <class Face>
class CallModel {
public:
    void call(const Call& call)
    {
        const auto [what, which, number] = call;
        if (scenes_.empty() || what == Open) return open();
        ModelScene& scene = scenes_[which % scenes_.size()];
        if (what == Release) return release(number);
        if (!scene.open && !Face::refuses_closed) return;
        switch (what) {
            case Close:
                expect(scene.open ? 0 : SceneError::WrongCall, face_.close(scene.handle));
                scene.open = false;
                break;
            case Advance:
            case AdvanceByNumber:
                return advance(scene, scene.next, what == AdvanceByNumber);
            case AdvanceTo:
                return advance(scene, number % 7, true);
            case Restart:
                expect(scene.open ? 0 : SceneError::WrongCall, face_.restart(scene.handle));
                if (scene.open) begin(scene);
                break;
            case Set:
                return set(scene, number);
            case Save:
                return save(scene);
            case Restore:
                return restore(scene, number);
            case Cancel:
                expect(scene.open ? 0 : SceneError::WrongCall, face_.cancel(scene.handle));
                scene.cancelled = scene.open;
                break;
            case Inspect:
                if (scene.open) inspect(scene);
                break;
            default:
                if (scene.open) attack(scene, number);
        }
    }

    // Checks that open frames have kept their values.
    void check_frames()
    {
        for (ModelFrame& frame : frames_) {
            if (!frame.open && !Face::refuses_closed) continue;
            std::size_t count = 0;
            double y = 0;
            expect(frame.open ? 0 : SceneError::WrongCall, face_.height(frame.handle, count, y));
            if (!frame.open) continue;
            const double t = static_cast<double>(frame.number - 1) / 24;
            require(count == 2, "the number of points");
            require(std::abs(y - (frame.height - 9.81 / 2 * t * t)) < 1e-4,
                    fmt::format("a point of frame {} is at {} m", frame.number, y));
        }
    }

private:
    struct ModelScene {
        typename Face::Scene handle{};
        bool open = true, cancelled = false;
        std::int64_t next = 1;
        double height = 10, set_height = 10;  // of the current run; of the next start
        bool has_advanced() const { return next > 1; }
    };
    struct ModelFrame {
        typename Face::Frame handle{};
        bool open = true;
        std::int64_t number = 0;
        double height = 0;
    };
    struct ModelSnapshot {
        typename Face::Snapshot handle{};
        bool open = true;
        std::int64_t frame = 0;
        double height = 0;
    };

    static void expect(int status, const Answer& answer)
    {
        require(answer.status == status,
                fmt::format("status {} where the model says {}: {}", answer.status, status, answer.text));
        require(answer.text.empty() == (status == 0), "an error without a text, or none");
    }

    void open()
    {
        if (scenes_.size() == 4) return;
        ModelScene scene;
        expect(0, face_.open(scene.handle));
        scenes_.push_back(std::move(scene));
    }

    void advance(ModelScene& scene, std::int64_t to, bool by_number)
    {
        ModelFrame frame;
        const bool late = by_number && to < scene.next;
        int status = 0;
        if (!scene.open || late)
            status = SceneError::WrongCall;
        else if (scene.cancelled)
            status = SceneError::Cancelled;
        expect(status, by_number ? face_.advance_to(scene.handle, to, frame.handle)
                                 : face_.advance(scene.handle, frame.handle));
        require(face_.is_there(frame.handle) == (status == 0), "a frame where there is none, or none");
        if (status == SceneError::Cancelled) scene.cancelled = false;
        if (status != 0) return;
        scene.next = to + 1;
        frame.number = to;
        frame.height = scene.height;
        frames_.push_back(std::move(frame));
    }

    void begin(ModelScene& scene)
    {
        scene.next = 1;
        scene.cancelled = false;
        scene.height = scene.set_height;
    }

    void set(ModelScene& scene, int number)
    {
        const bool wrong = number % 4 == 0, good = scene.open && !wrong;
        const double height = number % 100;  // m, of which check_frames() sees a ten-thousandth
        expect(good ? 0 : SceneError::WrongCall, face_.set(scene.handle, wrong ? "heigt" : "height", height));
        if (!good) return;
        scene.set_height = height;
        begin(scene);
    }

    void save(ModelScene& scene)
    {
        ModelSnapshot snapshot;
        const bool good = scene.open && scene.has_advanced();
        expect(good ? 0 : SceneError::WrongCall, face_.save(scene.handle, snapshot.handle));
        if (!good) return;
        snapshot.frame = scene.next - 1;
        snapshot.height = scene.height;
        snapshots_.push_back(std::move(snapshot));
    }

    void restore(ModelScene& scene, int number)
    {
        if (snapshots_.empty()) return;
        ModelSnapshot& snapshot = snapshots_[number % snapshots_.size()];
        if (!snapshot.open && !Face::refuses_closed) return;
        const bool good = scene.open && snapshot.open;
        expect(good ? 0 : SceneError::WrongCall, face_.restore(scene.handle, snapshot.handle));
        if (!good) return;
        begin(scene);
        scene.next = snapshot.frame + 1;
        scene.height = snapshot.height;
    }

    void release(int number)
    {
        if (!frames_.empty() && number % 2 == 0)
            release(frames_[number % frames_.size()]);
        else if (!snapshots_.empty())
            release(snapshots_[number % snapshots_.size()]);
    }
    template <class Thing>
    void release(Thing& thing)
    {
        if (!thing.open && !Face::refuses_closed) return;
        expect(thing.open ? 0 : SceneError::WrongCall, face_.release(thing.handle));
        thing.open = false;
    }

    void inspect(ModelScene& scene)
    {
        std::int64_t next = 0;
        expect(0, face_.inspect(scene.handle, open_handle(frames_), next));
        require(next == scene.next, fmt::format("frame {} is next where the model says {}", next, scene.next));
    }

    void attack(ModelScene& scene, int number)
    {
        const std::vector<Hostile> all = face_.hostile(scene.handle, open_handle(frames_), open_handle(snapshots_));
        const std::size_t which = static_cast<std::size_t>(number) % all.size();
        const Answer answer = all[which]();
        require(answer.status != 0, fmt::format("hostile call {} of {} is none of an error", which, all.size()));
        require(!answer.text.empty(), fmt::format("hostile call {} of {}: an error without a text", which, all.size()));
        if (answer.status == SceneError::Cancelled) {
            require(scene.cancelled, "a call is cancelled where nobody has asked for it");
            scene.cancelled = false;
        }
        inspect(scene);
    }

    // Returns the most recent open object.
    template <class Thing>
    static auto open_handle(std::vector<Thing>& things) -> decltype(&things.front().handle)
    {
        for (auto thing = things.rbegin(); thing != things.rend(); ++thing)
            if (thing->open) return &thing->handle;
        return nullptr;
    }

    Face face_;
    std::vector<ModelScene> scenes_;
    std::vector<ModelFrame> frames_;
    std::vector<ModelSnapshot> snapshots_;
};

template <class Face>
void run_calls(const std::vector<Call>& sequence)
{
    CallModel<Face> model;
    for (const Call& call : sequence) model.call(call);
    model.check_frames();
}

// Runs random sequences with HOST_CALLS (240) calls in total.
template <class Face>
void check_random_calls()
{
    constexpr int calls_of_a_sequence = 24;  // on average
    rc::detail::TestParams params = rc::detail::configuration().testParams;
    params.maxSuccess = amount("HOST_CALLS", 240) / calls_of_a_sequence;
    const auto result =
        rc::detail::checkTestable([] { run_calls<Face>(*calls()); }, rc::detail::TestMetadata(), params);
    std::ostringstream text;
    rc::detail::printResultMessage(result, text);
    INFO(text.str());
    CHECK(result.template is<rc::detail::SuccessResult>());
}

}  // namespace rapid::test
