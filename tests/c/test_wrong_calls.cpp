// Calls each function of rapid.h with wrong handles, during a call of its scene, and after a failed frame. The table of
// functions is checked against the header.
#include <array>
#include <cmath>
#include <fstream>
#include <functional>
#include <regex>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "include/rapid/rapid.h"
#include "tests/files/temporary_folder.h"
#include "tests/test.h"

namespace rapid {
namespace {

using Catch::Contains;

// Its kernel fails from frame 5 on.
const char* const fall = R"(
local rapid = require "rapid"
local height = rapid.param("height", 10, "m, of the drop")
return rapid.create { points = rapid.points.from { P = {{0, height, 0}} } }
  :attribute { heat = 2 }
  :points("fails", function(p, frame)
    p:join "all"
    if frame.number >= 5 then error "no more" end
  end)
  :detail("count", function(points) points.detail.count = #points end)
  :gravity {} :collide { shape = rapid.shape.plane {} } :collide { shape = rapid.shape.box { center = {0, -50, 0} } }
  :picture { camera = rapid.camera { position = {0, 2, 9}, target = {0, 0, 0} } } :solve {}
)";

template <class T>
T sized()
{
    T result{};
    result.size = sizeof(T);
    return result;
}

// The handles that functions are called with.
struct Handles {
    rapid_scene* scene = nullptr;
    rapid_frame* frame = nullptr;
    rapid_snapshot* snapshot = nullptr;
    rapid_offers* offers = nullptr;
    rapid_shapes* shapes = nullptr;
    rapid_run* run = nullptr;

    std::array<void*, 6> all() const { return {scene, frame, snapshot, offers, shapes, run}; }
    void set(std::size_t which, void* handle)
    {
        if (which == 0) scene = static_cast<rapid_scene*>(handle);
        if (which == 1) frame = static_cast<rapid_frame*>(handle);
        if (which == 2) snapshot = static_cast<rapid_snapshot*>(handle);
        if (which == 3) offers = static_cast<rapid_offers*>(handle);
        if (which == 4) shapes = static_cast<rapid_shapes*>(handle);
        if (which == 5) run = static_cast<rapid_run*>(handle);
    }
};

// The handles of a scene at frame 2.
struct Opened : Handles {
    explicit Opened(const rapid_options* options = nullptr)
    {
        REQUIRE(rapid_offers_new(&offers, nullptr) == RAPID_OK);
        REQUIRE(rapid_scene_open_text("fall.lua", fall, options, &scene, nullptr) == RAPID_OK);
        REQUIRE(rapid_scene_advance_to(scene, 2, &frame, nullptr) == RAPID_OK);
        REQUIRE(rapid_scene_save(scene, &snapshot, nullptr) == RAPID_OK);
        REQUIRE(rapid_scene_shapes(scene, 2, &shapes, nullptr) == RAPID_OK);
        rapid_run_options run_options = rapid_default_run_options();
        const rapid_frames two = {1, 2, 1};
        run_options.text = fall;
        run_options.frames = &two;
        REQUIRE(rapid_run_make("fall.lua", nullptr, &run_options, &run, nullptr) == RAPID_OK);
    }
    Opened(const Opened&) = delete;
    Opened& operator=(const Opened&) = delete;
    ~Opened()
    {
        rapid_run_release(run, nullptr);
        rapid_shapes_release(shapes, nullptr);
        rapid_frame_release(frame, nullptr);
        rapid_snapshot_release(snapshot, nullptr);
        rapid_scene_release(scene, nullptr);
        rapid_offers_release(offers, nullptr);
    }
};

// A function with valid arguments. takes: the initials of the handles that it takes, among scene, frame, snapshot
// ("n"), offers, shapes ("h") and run.
struct Function {
    const char* name;
    std::string takes;
    std::function<int(const Handles&, rapid_error**)> call;
    bool is_for_any_thread = false;  // may be called at any time
};

template <class T>
int released(int (*release)(T*, rapid_error**), T* made, int status)
{
    if (made) release(made, nullptr);
    return status;
}

// A function that returns a string of a frame.
Function text_of_frame(const char* name, int (*function)(rapid_frame*, const char**, rapid_error**))
{
    return {name, "f", [=](const Handles& h, rapid_error** e) {
                const char* text = nullptr;
                return function(h.frame, &text, e);
            }};
}

const std::vector<Function>& functions()
{
    static const float corners[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    static const std::int32_t triangle[] = {0, 1, 2};
    static const std::vector<Function> all = {
        {"rapid_scene_open", "",
         [](const Handles&, rapid_error** e) {
             rapid_scene* scene = nullptr;
             const std::string file = std::string(RAPID_SOURCE_DIR) + "/graphs/first.lua";
             const int status = rapid_scene_open(file.c_str(), nullptr, &scene, e);
             return released(rapid_scene_release, scene, status);
         }},
        {"rapid_scene_open_text", "",
         [](const Handles&, rapid_error** e) {
             rapid_scene* scene = nullptr;
             const int status = rapid_scene_open_text("fall.lua", fall, nullptr, &scene, e);
             return released(rapid_scene_release, scene, status);
         }},
        {"rapid_scene_release", "s", [](const Handles& h, rapid_error** e) { return rapid_scene_release(h.scene, e); },
         true},
        {"rapid_scene_parameter", "s",
         [](const Handles& h, rapid_error** e) {
             auto parameter = sized<rapid_parameter>();
             return rapid_scene_parameter(h.scene, 0, &parameter, e);
         }},
        {"rapid_scene_set", "s",
         [](const Handles& h, rapid_error** e) {
             const rapid_setting height = {"height", {RAPID_NUMBER, {3, 0, 0}, nullptr}};
             return rapid_scene_set(h.scene, &height, 1, e);
         }},
        {"rapid_scene_node", "s",
         [](const Handles& h, rapid_error** e) {
             auto node = sized<rapid_node>();
             return rapid_scene_node(h.scene, 0, &node, e);
         }},
        {"rapid_scene_node_types", "s",
         [](const Handles& h, rapid_error** e) {
             const char* json = nullptr;
             return rapid_scene_node_types(h.scene, &json, e);
         }},
        {"rapid_scene_warnings", "s",
         [](const Handles& h, rapid_error** e) {
             const char* text = nullptr;
             return rapid_scene_warnings(h.scene, &text, e);
         }},
        {"rapid_scene_advance", "s",
         [](const Handles& h, rapid_error** e) { return rapid_scene_advance(h.scene, nullptr, e); }},
        {"rapid_scene_advance_to", "s",
         [](const Handles& h, rapid_error** e) { return rapid_scene_advance_to(h.scene, 3, nullptr, e); }},
        {"rapid_scene_restart", "s", [](const Handles& h, rapid_error** e) { return rapid_scene_restart(h.scene, e); }},
        {"rapid_scene_cancel", "s", [](const Handles& h, rapid_error** e) { return rapid_scene_cancel(h.scene, e); },
         true},
        {"rapid_scene_save", "s",
         [](const Handles& h, rapid_error** e) {
             rapid_snapshot* snapshot = nullptr;
             const int status = rapid_scene_save(h.scene, &snapshot, e);
             return released(rapid_snapshot_release, snapshot, status);
         }},
        {"rapid_scene_restore", "sn",
         [](const Handles& h, rapid_error** e) { return rapid_scene_restore(h.scene, h.snapshot, e); }},
        {"rapid_snapshot_write", "n",
         [](const Handles& h, rapid_error** e) {
             const test::TemporaryFolder folder;
             return rapid_snapshot_write(h.snapshot, (folder / "fall.state").c_str(), e);
         }},
        {"rapid_snapshot_read", "",
         [](const Handles&, rapid_error** e) {
             const test::TemporaryFolder folder;
             const Opened other;
             const std::string file = folder / "fall.state";
             REQUIRE(rapid_snapshot_write(other.snapshot, file.c_str(), nullptr) == RAPID_OK);
             rapid_snapshot* snapshot = nullptr;
             const int status = rapid_snapshot_read(file.c_str(), &snapshot, e);
             return released(rapid_snapshot_release, snapshot, status);
         }},
        {"rapid_snapshot_release", "n",
         [](const Handles& h, rapid_error** e) { return rapid_snapshot_release(h.snapshot, e); }},
        {"rapid_offers_new", "",
         [](const Handles&, rapid_error** e) {
             rapid_offers* offers = nullptr;
             const int status = rapid_offers_new(&offers, e);
             return released(rapid_offers_release, offers, status);
         }},
        {"rapid_offers_guard", "o",
         [](const Handles& h, rapid_error** e) { return rapid_offers_guard(h.offers, 1, e); }},
        {"rapid_offers_on_release", "o",
         [](const Handles& h, rapid_error** e) {
             return rapid_offers_on_release(
                 h.offers, [](void*) {}, nullptr, e);
         }},
        {"rapid_offers_mesh", "o",
         [](const Handles& h, rapid_error** e) {
             return rapid_offers_mesh(h.offers, "corner", corners, 3, triangle, 1, e);
         }},
        {"rapid_offers_points", "o",
         [](const Handles& h, rapid_error** e) {
             auto P = sized<rapid_column>();
             P.name = "P";
             P.type = RAPID_FLOAT_VEC3;
             P.data = corners;
             return rapid_offers_points(h.offers, "cloud", 3, &P, 1, e);
         }},
        {"rapid_offers_shape", "o",
         [](const Handles& h, rapid_error** e) {
             auto shape = sized<rapid_shape>();
             shape.distance = [](void*, std::size_t, const double*, double*, double*) { return 0; };
             return rapid_offers_shape(h.offers, "ball", &shape, e);
         }},
        {"rapid_offers_node", "o",
         [](const Handles& h, rapid_error** e) {
             auto type = sized<rapid_node_type>();
             type.name = "nothing";
             type.call = [](void*, const rapid_call*) { return 0; };
             return rapid_offers_node(h.offers, &type, e);
         }},
        {"rapid_offers_release", "o",
         [](const Handles& h, rapid_error** e) { return rapid_offers_release(h.offers, e); }},
        {"rapid_scene_offer", "so",
         [](const Handles& h, rapid_error** e) { return rapid_scene_offer(h.scene, h.offers, e); }},
        {"rapid_scene_explain", "s",
         [](const Handles& h, rapid_error** e) {
             const char* json = nullptr;
             return rapid_scene_explain(h.scene, &json, e);
         }},
        {"rapid_scene_points_after", "s",
         [](const Handles& h, rapid_error** e) {
             rapid_frame* frame = nullptr;
             const int status = rapid_scene_points_after(h.scene, "gravity1", 3, &frame, e);
             return released(rapid_frame_release, frame, status);
         }},
        {"rapid_scene_graph", "s",
         [](const Handles& h, rapid_error** e) {
             const char* text = nullptr;
             return rapid_scene_graph(h.scene, RAPID_GRAPH_DOT, &text, e);
         }},
        {"rapid_scene_trace", "s",
         [](const Handles& h, rapid_error** e) {
             const std::int64_t id = 0;
             const char* json = nullptr;
             return rapid_scene_trace(h.scene, &id, 1, "create1", 1, 4, &json, e);
         }},
        {"rapid_frame_output", "f",
         [](const Handles& h, rapid_error** e) {
             rapid_frame* frame = nullptr;
             const int status = rapid_frame_output(h.frame, "main", &frame, e);
             return released(rapid_frame_release, frame, status);
         }},
        text_of_frame("rapid_frame_outputs", rapid_frame_outputs),
        text_of_frame("rapid_frame_columns", rapid_frame_columns),
        text_of_frame("rapid_frame_groups", rapid_frame_groups),
        text_of_frame("rapid_frame_details", rapid_frame_details),
        text_of_frame("rapid_frame_warnings", rapid_frame_warnings),
        text_of_frame("rapid_frame_statistics_json", rapid_frame_statistics_json),
        text_of_frame("rapid_frame_profile_json", rapid_frame_profile_json),
        text_of_frame("rapid_frame_describe", rapid_frame_describe),
        {"rapid_frame_statistics", "f",
         [](const Handles& h, rapid_error** e) {
             auto statistics = sized<rapid_statistics>();
             return rapid_frame_statistics(h.frame, &statistics, e);
         }},
        {"rapid_frame_indices", "f",
         [](const Handles& h, rapid_error** e) {
             const std::int64_t id = 0;
             std::uint32_t place = 0;
             return rapid_frame_indices(h.frame, &id, 1, &place, e);
         }},
        {"rapid_frame_column", "f",
         [](const Handles& h, rapid_error** e) {
             auto column = sized<rapid_column>();
             return rapid_frame_column(h.frame, "P", &column, e);
         }},
        {"rapid_frame_group", "f",
         [](const Handles& h, rapid_error** e) {
             auto column = sized<rapid_column>();
             return rapid_frame_group(h.frame, "all", &column, e);
         }},
        {"rapid_frame_expanded", "f",
         [](const Handles& h, rapid_error** e) {
             auto column = sized<rapid_column>();
             return rapid_frame_expanded(h.frame, "heat", &column, e);
         }},
        {"rapid_frame_text_of", "",
         [](const Handles&, rapid_error** e) {
             const char* text = nullptr;
             return rapid_frame_text_of(0, &text, e);
         }},
        {"rapid_frame_token_of", "",
         [](const Handles&, rapid_error** e) {
             std::uint32_t token = 0;
             return rapid_frame_token_of("leaf", &token, e);
         }},
        {"rapid_frame_detail", "f",
         [](const Handles& h, rapid_error** e) {
             rapid_value value{};
             return rapid_frame_detail(h.frame, "count", &value, e);
         }},
        {"rapid_frame_write", "f",
         [](const Handles& h, rapid_error** e) {
             const test::TemporaryFolder folder;
             return rapid_frame_write(h.frame, (folder / "fall.csv").c_str(), e);
         }},
        {"rapid_frame_read", "",
         [](const Handles&, rapid_error** e) {
             const test::TemporaryFolder folder;
             rapid_frame* frame = nullptr;
             const int status =
                 rapid_frame_read(folder.write("two.csv", "Px,Py,Pz\n0,0,0\n1,0,0\n").c_str(), &frame, e);
             return released(rapid_frame_release, frame, status);
         }},
        {"rapid_frame_compare", "f",
         [](const Handles& h, rapid_error** e) {
             int same = 0;
             const char* json = nullptr;
             return rapid_frame_compare(h.frame, h.frame, 0, &same, &json, e);
         }},
        {"rapid_scene_picture", "sf",
         [](const Handles& h, rapid_error** e) {
             const void* png = nullptr;
             std::size_t bytes = 0;
             return rapid_scene_picture(h.scene, h.frame, 32, 18, &png, &bytes, e);
         }},
        {"rapid_frame_release", "f", [](const Handles& h, rapid_error** e) { return rapid_frame_release(h.frame, e); }},
        {"rapid_scene_shapes", "s",
         [](const Handles& h, rapid_error** e) {
             rapid_shapes* shapes = nullptr;
             const int status = rapid_scene_shapes(h.scene, 1, &shapes, e);
             return released(rapid_shapes_release, shapes, status);
         }},
        {"rapid_shapes_mesh", "h",
         [](const Handles& h, rapid_error** e) {
             auto mesh = sized<rapid_mesh>();
             return rapid_shapes_mesh(h.shapes, 0, &mesh, e);
         }},
        {"rapid_shapes_plane", "h",
         [](const Handles& h, rapid_error** e) {
             auto plane = sized<rapid_plane>();
             return rapid_shapes_plane(h.shapes, 0, &plane, e);
         }},
        {"rapid_shapes_warnings", "h",
         [](const Handles& h, rapid_error** e) {
             const char* lines = nullptr;
             return rapid_shapes_warnings(h.shapes, &lines, e);
         }},
        {"rapid_frame_picture", "fh",
         [](const Handles& h, rapid_error** e) {
             const void* png = nullptr;
             std::size_t bytes = 0;
             return rapid_frame_picture(h.frame, h.shapes, nullptr, 32, 18, &png, &bytes, e);
         }},
        {"rapid_shapes_release", "h",
         [](const Handles& h, rapid_error** e) { return rapid_shapes_release(h.shapes, e); }},
        {"rapid_run_make", "",
         [](const Handles&, rapid_error** e) {
             rapid_run* run = nullptr;
             const int status = rapid_run_make("fall.lua", nullptr, nullptr, &run, e);
             return released(rapid_run_release, run, status);
         }},
        {"rapid_run_prepare", "r", [](const Handles& h, rapid_error** e) { return rapid_run_prepare(h.run, e); }},
        {"rapid_run_frames", "r",
         [](const Handles& h, rapid_error** e) {
             rapid_frames frames{};
             return rapid_run_frames(h.run, &frames, e);
         }},
        {"rapid_run_run", "r",
         [](const Handles& h, rapid_error** e) {
             rapid_run_prepare(h.run, nullptr);  // unless it is already prepared
             auto outcome = sized<rapid_outcome>();
             return rapid_run_run(h.run, &outcome, e);
         }},
        {"rapid_run_end_after_frame", "r",
         [](const Handles& h, rapid_error** e) { return rapid_run_end_after_frame(h.run, e); }},
        {"rapid_run_cancel", "r", [](const Handles& h, rapid_error** e) { return rapid_run_cancel(h.run, e); }},
        {"rapid_run_release", "r", [](const Handles& h, rapid_error** e) { return rapid_run_release(h.run, e); }},
    };
    return all;
}

// A getter, which has no error. It returns 0 for a wrong handle and for a scene inside another call.
struct Getter {
    const char* name;
    std::size_t takes;  // index of its handle
    std::function<double(const Handles&)> get;
    double value;  // for the handles of Opened
};

const std::vector<Getter>& getters()
{
    const auto get = [](auto function, auto Handles::*handle) {
        return [=](const Handles& h) { return static_cast<double>(function(h.*handle)); };
    };
    static const std::vector<Getter> all = {
        {"rapid_scene_parameter_count", 0, get(rapid_scene_parameter_count, &Handles::scene), 1},
        {"rapid_scene_node_count", 0, get(rapid_scene_node_count, &Handles::scene), 9},
        {"rapid_scene_fps", 0, get(rapid_scene_fps, &Handles::scene), 24},
        {"rapid_scene_first_frame", 0, get(rapid_scene_first_frame, &Handles::scene), 1},
        {"rapid_scene_next_frame", 0, get(rapid_scene_next_frame, &Handles::scene), 3},
        {"rapid_frame_number", 1, get(rapid_frame_number, &Handles::frame), 2},
        {"rapid_frame_time", 1, get(rapid_frame_time, &Handles::frame), 1.0 / 24},
        {"rapid_frame_fps", 1, get(rapid_frame_fps, &Handles::frame), 24},
        {"rapid_frame_size", 1, get(rapid_frame_size, &Handles::frame), 1},
        {"rapid_snapshot_frame", 2, get(rapid_snapshot_frame, &Handles::snapshot), 2},
        {"rapid_shapes_mesh_count", 4, get(rapid_shapes_mesh_count, &Handles::shapes), 1},
        {"rapid_shapes_plane_count", 4, get(rapid_shapes_plane_count, &Handles::shapes), 1},
        {"rapid_shapes_has_camera", 4, get(rapid_shapes_has_camera, &Handles::shapes), 1},
        {"rapid_run_first_frame", 5, get(rapid_run_first_frame, &Handles::run), 1},
    };
    return all;
}

// Returns the status of a function, and checks that an error has a message.
int status_of(const Function& function, const Handles& handles)
{
    rapid_error* error = nullptr;
    const int status = function.call(handles, &error);
    CHECK(rapid_error_kind(error) == status);
    CHECK(std::string(rapid_error_message(error)).empty() == (status == RAPID_OK));
    rapid_error_release(error);
    CHECK((status == RAPID_OK || function.call(handles, nullptr) == status));
    return status;
}

bool takes_scene(const Function& function) { return function.takes.find('s') != std::string::npos; }

}  // namespace

TEST_CASE("the table has all functions of the header", "[c]")
{
    std::ifstream file(RAPID_SOURCE_DIR "/include/rapid/rapid.h");
    const std::string header(std::istreambuf_iterator<char>(file), {});
    // Functions that take no handle, or accept NULL. test_scene.cpp tests the merge of parts.
    std::set<std::string> known = {
        "rapid_version",      "rapid_error_message",      "rapid_error_file",        "rapid_error_line",
        "rapid_error_node",   "rapid_error_text",         "rapid_error_release",     "rapid_error_kind",
        "rapid_call_add_rod", "rapid_error_script_stack", "rapid_scene_load_plugin", "rapid_merge_files",
        "rapid_snapshot_size"};
    for (const Getter& getter : getters()) known.insert(getter.name);
    for (const Function& function : functions()) known.insert(function.name);
    std::set<std::string> declared;
    const std::regex declaration(R"((?:^|\n)(?:int|void|const char\*|size_t|u?int64_t|double) (rapid_\w+)\()");
    for (std::sregex_iterator match(header.begin(), header.end(), declaration); match != std::sregex_iterator();
         ++match)
        declared.insert((*match)[1]);
    CHECK(declared == known);
}

TEST_CASE("each function fulfils its purpose", "[c]")
{
    for (const Function& function : functions()) {
        CAPTURE(function.name);
        const Opened opened;
        CHECK(status_of(function, opened) == RAPID_OK);
    }
}

TEST_CASE("each function refuses handles that are NULL, closed, made up or of something else", "[c]")
{
    const Opened opened;
    Handles closed;
    {
        const Opened other;
        closed = other;
    }
    int made_up = 0;
    const std::string letters = "sfnohr";
    for (const Function& function : functions())
        for (const char letter : function.takes) {
            const std::size_t which = letters.find(letter);
            const void* const other = opened.all()[(which + 1) % 6];
            for (const void* wrong : {static_cast<const void*>(nullptr), static_cast<const void*>(closed.all()[which]),
                                      static_cast<const void*>(&made_up), other}) {
                CAPTURE(function.name, letter, wrong);
                Handles handles = opened;
                handles.set(which, const_cast<void*>(wrong));
                CHECK(status_of(function, handles) == RAPID_WRONG_CALL);
            }
        }
}

TEST_CASE("each getter returns 0 of handles that are NULL, closed, made up or of something else", "[c]")
{
    const Opened opened;
    Handles closed;
    {
        const Opened other;
        closed = other;
    }
    int made_up = 0;
    for (const Getter& getter : getters()) {
        CAPTURE(getter.name);
        CHECK(getter.get(opened) == Approx(getter.value));
        for (void* const wrong : {static_cast<void*>(nullptr), closed.all()[getter.takes], static_cast<void*>(&made_up),
                                  opened.all()[(getter.takes + 1) % 6]}) {
            Handles handles = opened;
            handles.set(getter.takes, wrong);
            CHECK(getter.get(handles) == 0);
        }
    }
}

TEST_CASE("within a call of its scene a getter of it returns 0, and those of frames do not", "[c]")
{
    struct Seen {
        const Opened* opened = nullptr;
        std::vector<double> values;
    } seen;
    rapid_options options = rapid_default_options();
    options.user = &seen;
    options.progress = [](void* user, std::int64_t, std::int64_t) {
        auto& now = *static_cast<Seen*>(user);
        if (now.opened)
            for (const Getter& getter : getters()) now.values.push_back(getter.get(*now.opened));
        return 1;
    };
    const Opened opened(&options);
    seen.opened = &opened;
    REQUIRE(rapid_scene_advance_to(opened.scene, 3, nullptr, nullptr) == RAPID_OK);
    REQUIRE(seen.values.size() == getters().size());
    for (std::size_t i = 0; i < seen.values.size(); ++i) {
        CAPTURE(getters()[i].name);
        CHECK(seen.values[i] == Approx(getters()[i].takes == 0 ? 0 : getters()[i].value));
    }
}

TEST_CASE("within a call of its scene each function of it is refused, and those of frames are not", "[c]")
{
    struct Seen {
        const Opened* opened = nullptr;
        const Function* function = nullptr;
        int status = -1;
    } seen;
    rapid_options options = rapid_default_options();
    options.user = &seen;
    options.progress = [](void* user, std::int64_t, std::int64_t) {
        auto& now = *static_cast<Seen*>(user);
        if (now.opened) now.status = status_of(*now.function, *now.opened);
        return 1;
    };
    for (const Function& function : functions()) {
        CAPTURE(function.name);
        seen.opened = nullptr;
        const Opened opened(&options);
        seen = {&opened, &function, -1};
        const int status = rapid_scene_advance_to(opened.scene, 3, nullptr, nullptr);
        const bool refused = takes_scene(function) && !function.is_for_any_thread;
        CHECK(seen.status == (refused ? RAPID_BUSY : RAPID_OK));
        const bool cancels = std::string(function.name) == "rapid_scene_cancel";
        CHECK(status == (cancels ? RAPID_CANCELLED : RAPID_OK));
    }
}

TEST_CASE("after a failed frame a scene accepts any call, but has no next frame until it is restarted or restored",
          "[c]")
{
    const std::set<std::string> refused = {"rapid_scene_advance", "rapid_scene_advance_to", "rapid_scene_save"};
    const Opened opened;
    for (const Function& function : functions()) {
        CAPTURE(function.name);
        const bool ends = std::string(function.name).find("_release") != std::string::npos;
        if (ends) continue;
        REQUIRE(rapid_scene_restart(opened.scene, nullptr) == RAPID_OK);
        REQUIRE(rapid_scene_advance_to(opened.scene, 5, nullptr, nullptr) == RAPID_FAILED_FRAME);
        CHECK(status_of(function, opened) == (refused.count(function.name) ? RAPID_WRONG_CALL : RAPID_OK));
        REQUIRE(rapid_scene_restart(opened.scene, nullptr) == RAPID_OK);
        CHECK(rapid_scene_advance_to(opened.scene, 4, nullptr, nullptr) == RAPID_OK);
    }
}

TEST_CASE("a struct whose size can't be is refused by each function that takes one", "[c]")
{
    const Opened h;
    for (const std::size_t size : {std::size_t{0}, std::size_t{3}, std::size_t{1} << 20}) {
        CAPTURE(size);
        const auto with_size = [&](auto made, const auto& call) {
            made.size = size;
            CHECK(call(made) == RAPID_WRONG_CALL);
        };
        with_size(rapid_default_options(), [&](auto& s) {
            rapid_scene* scene = nullptr;
            return rapid_scene_open_text("fall.lua", fall, &s, &scene, nullptr);
        });
        with_size(rapid_parameter(), [&](auto& s) { return rapid_scene_parameter(h.scene, 0, &s, nullptr); });
        with_size(rapid_node(), [&](auto& s) { return rapid_scene_node(h.scene, 0, &s, nullptr); });
        with_size(rapid_shape(), [&](auto& s) { return rapid_offers_shape(h.offers, "ball", &s, nullptr); });
        with_size(rapid_node_type(), [&](auto& s) { return rapid_offers_node(h.offers, &s, nullptr); });
        with_size(rapid_statistics(), [&](auto& s) { return rapid_frame_statistics(h.frame, &s, nullptr); });
        with_size(rapid_mesh(), [&](auto& s) { return rapid_shapes_mesh(h.shapes, 0, &s, nullptr); });
        with_size(rapid_plane(), [&](auto& s) { return rapid_shapes_plane(h.shapes, 0, &s, nullptr); });
        with_size(rapid_default_run_options(), [&](auto& s) {
            rapid_run* run = nullptr;
            return rapid_run_make("fall.lua", nullptr, &s, &run, nullptr);
        });
        with_size(rapid_column(), [&](auto& s) { return rapid_frame_column(h.frame, "P", &s, nullptr); });
        with_size(rapid_column(), [&](auto& s) { return rapid_frame_group(h.frame, "all", &s, nullptr); });
        with_size(rapid_column(), [&](auto& s) { return rapid_frame_expanded(h.frame, "P", &s, nullptr); });
    }
}

TEST_CASE("names, types and numbers that there are not are refused", "[c]")
{
    const Opened h;
    rapid_scene* scene = nullptr;
    rapid_frame* frame = nullptr;
    const void* png = nullptr;
    std::size_t bytes = 0;
    rapid_value value{};
    auto column = sized<rapid_column>();
    auto parameter = sized<rapid_parameter>();
    auto node = sized<rapid_node>();
    const auto refused = [](const std::string& what, const auto& call, int status = RAPID_WRONG_CALL) {
        rapid_error* error = nullptr;
        CHECK(call(&error) == status);
        CHECK_THAT(rapid_error_text(error), Contains(what));
        rapid_error_release(error);
    };
    const char* text = nullptr;
    std::uint32_t token = 0;
    refused("no string has the number 4000000000",
            [&](rapid_error** e) { return rapid_frame_text_of(4000000000u, &text, e); });
    refused("not valid UTF-8", [&](rapid_error** e) { return rapid_frame_token_of("\xff", &token, e); });
    const auto setting = [&](const char* name, rapid_value to) {
        return [=, &h](rapid_error** e) {
            const rapid_setting wrong = {name, to};
            return rapid_scene_set(h.scene, &wrong, 1, e);
        };
    };
    refused(
        "nowhere.lua", [&](auto e) { return rapid_scene_open("nowhere.lua", nullptr, &scene, e); }, RAPID_WRONG_SCENE);
    refused("no file", [&](auto e) { return rapid_scene_open("", nullptr, &scene, e); });
    refused("no name", [&](auto e) { return rapid_scene_open_text("", fall, nullptr, &scene, e); });
    refused("threads = -1", [&](auto e) {
        rapid_options options = rapid_default_options();
        options.threads = -1;
        return rapid_scene_open_text("fall.lua", fall, &options, &scene, e);
    });
    refused("script_seconds = -1", [&](auto e) {
        rapid_options options = rapid_default_options();
        options.script_seconds = -1;
        return rapid_scene_open_text("fall.lua", fall, &options, &scene, e);
    });
    refused("heigth", setting("heigth", {RAPID_NUMBER, {1, 0, 0}, nullptr}));
    refused("height", setting("height", {RAPID_TEXT, {0, 0, 0}, "high"}));
    refused("height", setting("height", {RAPID_VEC3, {1, 2, 3}, nullptr}));
    refused("height", setting("height", {RAPID_NUMBER, {NAN, 0, 0}, nullptr}));
    refused("type of its value is 9", setting("height", {9, {0, 0, 0}, nullptr}));
    refused("has 1 parameters", [&](auto e) { return rapid_scene_parameter(h.scene, 1, &parameter, e); });
    refused("index = 99", [&](auto e) { return rapid_scene_node(h.scene, 99, &node, e); });
    refused("frame 0", [&](auto e) { return rapid_scene_advance_to(h.scene, 0, &frame, e); });
    refused("frame 2", [&](auto e) { return rapid_scene_advance_to(h.scene, 2, &frame, e); });
    refused("\"other\"", [&](auto e) { return rapid_frame_output(h.frame, "other", &frame, e); });
    refused("did you mean \"solve1\"",
            [&](auto e) { return rapid_scene_points_after(h.scene, "solve", 2, &frame, e); });
    refused("frame 0", [&](auto e) { return rapid_scene_points_after(h.scene, "solve1", 0, &frame, e); });
    refused("nowhere.so", [&](auto e) { return rapid_scene_load_plugin("nowhere.so", e); });
    refused("not a plugin of Rapid", [&](auto e) { return rapid_scene_load_plugin("/proc/self/exe", e); });
    refused("file is NULL", [&](auto e) { return rapid_scene_load_plugin(nullptr, e); });
    refused("form = 3", [&](auto e) { return rapid_scene_graph(h.scene, 3, &text, e); });
    refused("form = -1", [&](auto e) { return rapid_scene_graph(h.scene, -1, &text, e); });
    const std::int64_t id = 0;
    refused("no ids", [&](auto e) { return rapid_scene_trace(h.scene, nullptr, 0, nullptr, 1, 2, &text, e); });
    refused("frame 0", [&](auto e) { return rapid_scene_trace(h.scene, &id, 1, nullptr, 0, 0, &text, e); });
    refused("did you mean \"create1\"",
            [&](auto e) { return rapid_scene_trace(h.scene, &id, 1, "create", 1, 2, &text, e); });
    auto mesh = sized<rapid_mesh>();
    refused("have 1 meshes", [&](auto e) { return rapid_shapes_mesh(h.shapes, 1, &mesh, e); });
    rapid_run* run = nullptr;
    refused("no file", [&](auto e) { return rapid_run_make("", nullptr, nullptr, &run, e); });
    refused("part 3 of 2", [&](auto e) {
        rapid_run_options options = rapid_default_run_options();
        options.part = 3;
        options.part_count = 2;
        return rapid_run_make("fall.lua", nullptr, &options, &run, e);
    });
    refused("not prepared", [&](auto e) { return rapid_run_run(h.run, nullptr, e); });
    refused("no parts", [&](auto e) { return rapid_merge_files(nullptr, 0, "a.csv", nullptr, nullptr, nullptr, e); });
    refused("parts is NULL",
            [&](auto e) { return rapid_merge_files(nullptr, 1, "a.csv", nullptr, nullptr, nullptr, e); });
    refused("did you mean \"heat\"", [&](auto e) { return rapid_frame_column(h.frame, "haet", &column, e); });
    refused("\"al\"", [&](auto e) { return rapid_frame_group(h.frame, "al", &column, e); });
    refused("\"x\"", [&](auto e) { return rapid_frame_expanded(h.frame, "x", &column, e); });
    refused("\"x\"", [&](auto e) { return rapid_frame_detail(h.frame, "x", &value, e); });
    refused(".xyz", [&](auto e) { return rapid_frame_write(h.frame, "points.xyz", e); });
    refused("/dev/null", [&](auto e) { return rapid_frame_write(h.frame, "/dev/null/points.csv", e); });
    rapid_snapshot* snapshot = nullptr;
    refused("nowhere.state", [&](auto e) { return rapid_snapshot_read("nowhere.state", &snapshot, e); });
    refused("/dev/null", [&](auto e) { return rapid_snapshot_write(h.snapshot, "/dev/null/fall.state", e); });
    refused("nowhere.csv", [&](auto e) { return rapid_frame_read("nowhere.csv", &frame, e); });
    refused(".png", [&](auto e) { return rapid_frame_read("points.png", &frame, e); });
    for (const double wrong : {-1.0, double(NAN)})
        refused("tolerance = ",
                [&](auto e) { return rapid_frame_compare(h.frame, h.frame, wrong, nullptr, nullptr, e); });
    refused("column is NULL", [&](auto e) { return rapid_frame_group(h.frame, "all", nullptr, e); });
    refused("value is NULL", [&](auto e) { return rapid_frame_detail(h.frame, "count", nullptr, e); });
    for (const int width : {0, -1, 1 << 30})
        refused("each side must be",
                [&](auto e) { return rapid_scene_picture(h.scene, h.frame, width, 18, &png, &bytes, e); });
    const float P[3] = {0, 0, 0};
    const std::int32_t corners[3] = {0, 1, 2};
    column.name = "P";
    column.data = P;
    for (const std::size_t count : {SIZE_MAX, SIZE_MAX / 12 + 1}) {
        refused("count", [&](auto e) { return rapid_offers_mesh(h.offers, "a", P, count, corners, 1, e); });
        refused("triangle_count", [&](auto e) { return rapid_offers_mesh(h.offers, "a", P, 1, corners, count, e); });
        refused("count", [&](auto e) { return rapid_offers_points(h.offers, "a", count, &column, 1, e); });
    }
    column.type = 17;
    refused("its type is 17", [&](auto e) { return rapid_offers_points(h.offers, "a", 1, &column, 1, e); });
    CHECK(scene == nullptr);
    CHECK(frame == nullptr);
    CHECK(rapid_scene_advance(h.scene, nullptr, nullptr) == RAPID_OK);  // none of these calls changed anything
}

// Misbehaving callbacks of a program, as C sees them.
TEST_CASE("a mistake in a callback is an error of the scene, which stays usable", "[c]")
{
    struct Program {
        int (*wrong)(const rapid_call*) = nullptr;
    } program;
    rapid_offers* offers = nullptr;
    REQUIRE(rapid_offers_new(&offers, nullptr) == RAPID_OK);
    REQUIRE(rapid_offers_guard(offers, 1, nullptr) == RAPID_OK);
    const rapid_node_column heat = {"heat", RAPID_FLOAT};
    auto edit = sized<rapid_node_type>();
    edit.name = "warm";
    edit.kind = RAPID_EDIT;
    edit.writes = &heat;
    edit.write_count = 1;
    edit.user = &program;
    edit.call = [](void* user, const rapid_call* now) {
        int (*const wrong)(const rapid_call*) = static_cast<Program*>(user)->wrong;
        return wrong && now->frame > 2 ? wrong(now) : 0;
    };
    REQUIRE(rapid_offers_node(offers, &edit, nullptr) == RAPID_OK);
    rapid_options options = rapid_default_options();
    options.offers = offers;
    rapid_scene* scene = nullptr;
    REQUIRE(rapid_scene_open_text("warm.lua",
                                  "local rapid = require 'rapid'\n"
                                  "return rapid.create { points = rapid.points.grid {} } :warm {} :solve {}",
                                  &options, &scene, nullptr) == RAPID_OK);
    struct Wrong {
        const char* expected;
        int (*does)(const rapid_call*);
    };
    for (const Wrong& wrong : {
             Wrong{"it returned -1", [](const rapid_call*) { return -1; }},
             Wrong{"broken", [](const rapid_call*) -> int { throw std::runtime_error("broken"); }},
             Wrong{"not a std::exception", [](const rapid_call*) -> int { throw 3; }},
             Wrong{"nan at index 2", [](const rapid_call* now) { return now->writes[0][2] = NAN, 0; }},
             Wrong{"inf at index 0", [](const rapid_call* now) { return now->writes[0][0] = INFINITY, 0; }},
             Wrong{"\"warm\" was written beyond the end",
                   [](const rapid_call* now) { return now->writes[0][now->count] = 1, 0; }},
             Wrong{"kills was written beyond the end",
                   [](const rapid_call* now) { return now->kill[now->count] = 1, 0; }},
             Wrong{"takes no rods",
                   [](const rapid_call* now) -> int {
                       rapid_error* error = nullptr;
                       if (rapid_call_add_rod(now, 0, 1, 1, 0, &error) == RAPID_OK) return 0;
                       const std::string message = rapid_error_message(error);
                       rapid_error_release(error);
                       throw std::runtime_error(message);
                   }},
         }) {
        CAPTURE(wrong.expected);
        program.wrong = wrong.does;
        rapid_error* error = nullptr;
        CHECK(rapid_scene_advance_to(scene, 3, nullptr, &error) == RAPID_FAILED_FRAME);
        CHECK_THAT(rapid_error_message(error), Contains(wrong.expected) && Contains("warm"));
        CHECK(std::string(rapid_error_node(error)) == "warm1");
        CHECK(rapid_error_line(error) == 2);
        rapid_error_release(error);
        program.wrong = nullptr;
        REQUIRE(rapid_scene_restart(scene, nullptr) == RAPID_OK);
        CHECK(rapid_scene_advance_to(scene, 3, nullptr, nullptr) == RAPID_OK);
        REQUIRE(rapid_scene_restart(scene, nullptr) == RAPID_OK);
    }
    rapid_scene_release(scene, nullptr);
    rapid_offers_release(offers, nullptr);
}

TEST_CASE("what the other callbacks throw is an error that names them", "[c]")
{
    const char* const text = R"(
print("begun")
require "other"
local rapid = require "rapid"
return rapid.create { points = rapid.points.read("points.csv") } :solve {}
)";
    const test::TemporaryFolder folder;
    const std::string points = folder.write("points.csv", "id,Px,Py,Pz\n0,0,0,0\n");
    struct Program {
        std::string throws, points;
        void in(const char* callback) const
        {
            if (throws == callback) throw std::runtime_error("broken");
        }
    } program{"", points};
    rapid_options options = rapid_default_options();
    options.user = &program;
    options.log = [](void* user, int, const char*) { static_cast<Program*>(user)->in("log"); };
    options.find_module = [](void* user, const char* name) -> const char* {
        static_cast<Program*>(user)->in("find_module");
        return std::string(name) == "other" ? "return {}" : nullptr;
    };
    options.find_file = [](void* user, const char*) {
        static_cast<Program*>(user)->in("find_file");
        return static_cast<Program*>(user)->points.c_str();
    };
    options.progress = [](void* user, std::int64_t, std::int64_t) {
        return static_cast<Program*>(user)->in("progress"), 1;
    };
    rapid_scene* scene = nullptr;
    for (const char* callback : {"log", "find_module", "find_file", "progress"}) {
        CAPTURE(callback);
        program.throws = callback;
        rapid_error* error = nullptr;
        int status = rapid_scene_open_text("begun.lua", text, &options, &scene, &error);
        if (program.throws == "progress") {
            REQUIRE(status == RAPID_OK);
            status = rapid_scene_advance_to(scene, 1, nullptr, &error);
            CHECK(status == RAPID_FAILED_FRAME);
        } else {
            CHECK(status == RAPID_WRONG_SCENE);
        }
        CHECK_THAT(rapid_error_message(error),
                   Contains(std::string("the program's ") + callback) && Contains("broken"));
        rapid_error_release(error);
        rapid_scene_release(scene, nullptr);
        program.throws.clear();
        REQUIRE(rapid_scene_open_text("begun.lua", text, &options, &scene, nullptr) == RAPID_OK);
        CHECK(rapid_scene_advance_to(scene, 1, nullptr, nullptr) == RAPID_OK);
        rapid_scene_release(scene, nullptr);
    }
}

}  // namespace rapid
