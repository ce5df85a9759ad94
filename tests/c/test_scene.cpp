// Wrong calls of the C interface, and handles that know their objects. tests/scene/test_scene.cpp tests scenes.
#include <atomic>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "include/rapid/rapid.h"
#include "runtime/solver/figure_table.h"
#include "tests/files/temporary_folder.h"
#include "tests/scene/opened.h"
#include "tests/test.h"

namespace rapid {
namespace {

using Catch::Contains, Catch::StartsWith;

const char* const fall = R"(
local rapid = require "rapid"
local height = rapid.param("height", 10, "m, of the drop")
return rapid.create { points = rapid.points.grid { size = {1, 0, 1}, spacing = 0.25, center = vec3(0, height, 0) } }
  :attribute { heat = 2 } :gravity {} :solve {}
)";

rapid_scene* opened(const char* text = fall)
{
    rapid_scene* scene = nullptr;
    REQUIRE(rapid_scene_open_text("fall.lua", text, nullptr, &scene, nullptr) == RAPID_OK);
    return scene;
}

// The status of a call, with the message of its error.
class OwnedError {
public:
    OwnedError() = default;
    OwnedError(const OwnedError&) = delete;
    OwnedError& operator=(const OwnedError&) = delete;
    ~OwnedError() { rapid_error_release(error_); }
    operator rapid_error**() { return &error_; }
    std::string message() const { return rapid_error_message(error_); }
    const rapid_error* get() const { return error_; }

private:
    rapid_error* error_ = nullptr;
};

template <class T>
T sized()
{
    T result{};
    result.size = sizeof(T);
    return result;
}

}  // namespace

TEST_CASE("a scene runs in C", "[c]")
{
    rapid_scene* scene = opened();
    rapid_frame* frame = nullptr;
    REQUIRE(rapid_scene_advance_to(scene, 25, &frame, nullptr) == RAPID_OK);
    auto statistics = sized<rapid_statistics>();
    REQUIRE(rapid_frame_statistics(frame, &statistics, nullptr) == RAPID_OK);
    CHECK(statistics.points == 16);
    CHECK(rapid_frame_size(frame) == 16);
    CHECK(rapid_frame_number(frame) == 25);
    CHECK(rapid_frame_time(frame) == Approx(1));
    auto P = sized<rapid_column>(), heat = sized<rapid_column>();
    REQUIRE(rapid_frame_column(frame, "P", &P, nullptr) == RAPID_OK);
    REQUIRE(rapid_frame_column(frame, "heat", &heat, nullptr) == RAPID_OK);
    CHECK(P.type == RAPID_FLOAT_VEC3);
    CHECK(std::string(P.name) == "P");
    CHECK(heat.stride == 0);
    CHECK(*static_cast<const float*>(heat.data) == 2);
    for (size_t i = 0; i < P.count; ++i)
        CHECK(reinterpret_cast<const float*>(static_cast<const char*>(P.data) + i * P.stride)[1] ==
              Approx(10 - 9.81 / 2).epsilon(1e-5));
    REQUIRE(rapid_frame_expanded(frame, "heat", &heat, nullptr) == RAPID_OK);
    CHECK(heat.stride == 4);
    const char* names = nullptr;
    REQUIRE(rapid_frame_columns(frame, &names, nullptr) == RAPID_OK);
    CHECK(std::string(names) == "P\nheat\nid\nv");
    REQUIRE(rapid_scene_release(scene, nullptr) == RAPID_OK);
    CHECK(static_cast<const float*>(P.data)[1] == Approx(10 - 9.81 / 2).epsilon(1e-5));
    REQUIRE(rapid_frame_release(frame, nullptr) == RAPID_OK);
}

TEST_CASE("the statistics of a frame in C are those of the file of a run", "[c]")
{
    rapid_scene* scene = opened(test::every_figure);
    rapid_frame* frame = nullptr;
    const char* text = nullptr;
    auto statistics = sized<rapid_statistics>();
    REQUIRE(rapid_scene_advance_to(scene, 2, &frame, nullptr) == RAPID_OK);
    REQUIRE(rapid_frame_statistics(frame, &statistics, nullptr) == RAPID_OK);
    REQUIRE(rapid_frame_statistics_json(frame, &text, nullptr) == RAPID_OK);
    const nlohmann::json json = nlohmann::json::parse(text);
    int members = 0;
    const auto check = [&](const char* name, auto& value) {
        INFO(name);
        CHECK(value == json.at(name));
        CHECK(value > 0);
        ++members;
    };
    const auto check_all = [&](const auto& all) {
#define RAPID_FIGURE(type, name, ...)     \
    if constexpr (requires { all.name; }) \
        if (json.at(#name).is_number()) check(#name, all.name);
        RAPID_FIGURES(RAPID_FIGURE)
#undef RAPID_FIGURE
    };
    check_all(statistics);
    CHECK(members == 7);
    CHECK(statistics.has_errors);
    CHECK(statistics.error_p50 == json["error"]["position_p50"]);
    CHECK(statistics.error_p95 == json["error"]["position_p95"]);
    CHECK(statistics.error_max == json["error"]["position_max"]);
    CHECK(statistics.seconds == json["seconds"]["total"]);
    CHECK(statistics.script_seconds == json["seconds"]["script"]);
    CHECK(statistics.solve_seconds == json["seconds"]["solve"]);
    REQUIRE(rapid_frame_release(frame, nullptr) == RAPID_OK);
    REQUIRE(rapid_scene_release(scene, nullptr) == RAPID_OK);
}

TEST_CASE("the header is of the library's version", "[c]")
{
    CHECK_THAT(rapid_version(), Catch::StartsWith(std::to_string(RAPID_VERSION_MAJOR) + "." +
                                                  std::to_string(RAPID_VERSION_MINOR) + "."));
}

TEST_CASE("objects offered in C are used by the scene", "[c]")
{
    rapid_offers* offers = nullptr;
    REQUIRE(rapid_offers_new(&offers, nullptr) == RAPID_OK);
    const float P[] = {0, 5, 0, 0, 6, 0}, heat[] = {1, 2};
    rapid_column columns[2] = {sized<rapid_column>(), sized<rapid_column>()};
    columns[0].name = "P";
    columns[0].type = RAPID_FLOAT_VEC3;
    columns[0].data = P;
    columns[1].name = "heat";
    columns[1].type = RAPID_FLOAT;
    columns[1].data = heat;
    REQUIRE(rapid_offers_points(offers, "cloud", 2, columns, 2, nullptr) == RAPID_OK);

    const rapid_node_parameter rate = {"rate", "by which it grows", "1/s", {RAPID_NUMBER, {2, 0, 0}, nullptr}};
    const rapid_node_column grown = {"heat", RAPID_FLOAT};
    auto grow = sized<rapid_node_type>();
    grow.name = "grow";
    grow.doc = "Adds to the heat.";
    grow.kind = RAPID_EDIT;
    grow.parameters = &rate;
    grow.parameter_count = 1;
    grow.writes = &grown;
    grow.write_count = 1;
    int calls = 0;
    grow.user = &calls;
    grow.call = [](void* user, const rapid_call* now) {
        ++*static_cast<int*>(user);
        for (size_t i = 0; i < now->count; ++i) now->writes[0][i] += static_cast<float>(now->parameters[0] * now->dt);
        return now->frame > 13 ? 7 : 0;
    };
    REQUIRE(rapid_offers_node(offers, &grow, nullptr) == RAPID_OK);

    rapid_options options = rapid_default_options();
    options.offers = offers;
    rapid_scene* scene = nullptr;
    REQUIRE(rapid_scene_open_text("offered.lua",
                                  "local rapid = require 'rapid'\n"
                                  "return rapid.create { points = rapid.host 'cloud' } :grow {} :solve {}",
                                  &options, &scene, nullptr) == RAPID_OK);
    CHECK(rapid_offers_release(offers, nullptr) == RAPID_OK);
    rapid_frame* frame = nullptr;
    REQUIRE(rapid_scene_advance_to(scene, 13, &frame, nullptr) == RAPID_OK);
    CHECK(calls == 12);
    auto found = sized<rapid_column>();
    REQUIRE(rapid_frame_column(frame, "heat", &found, nullptr) == RAPID_OK);
    CHECK(static_cast<const float*>(found.data)[1] == Approx(3));
    OwnedError error;
    CHECK(rapid_scene_advance(scene, nullptr, error) == RAPID_FAILED_FRAME);
    CHECK_THAT(error.message(), Contains("it returned 7"));
    rapid_frame_release(frame, nullptr);
    rapid_scene_release(scene, nullptr);
}

TEST_CASE("a column of strings contains tokens in C, in both directions", "[c]")
{
    const float P[] = {0, 0, 0, 1, 0, 0};
    std::uint32_t tokens[] = {0, 0};
    REQUIRE(rapid_frame_token_of("leaf", &tokens[1], nullptr) == RAPID_OK);
    rapid_column columns[] = {sized<rapid_column>(), sized<rapid_column>()};
    columns[0].name = "P";
    columns[0].type = RAPID_FLOAT_VEC3;
    columns[0].data = P;
    columns[1].name = "name";
    columns[1].type = RAPID_STRING;
    columns[1].data = tokens;
    rapid_offers* offers = nullptr;
    REQUIRE(rapid_offers_new(&offers, nullptr) == RAPID_OK);
    REQUIRE(rapid_offers_points(offers, "two", 2, columns, 2, nullptr) == RAPID_OK);
    rapid_options options = rapid_default_options();
    options.offers = offers;
    rapid_scene* scene = nullptr;
    const char* text =
        "local rapid = require 'rapid' return rapid.create { points = rapid.host 'two' }"
        ":points('fall', function(p) if p.name == 'leaf' then p.name = 'fallen leaf' end end) :solve {}";
    REQUIRE(rapid_scene_open_text("two.lua", text, &options, &scene, nullptr) == RAPID_OK);
    rapid_frame* frame = nullptr;
    REQUIRE(rapid_scene_advance_to(scene, 2, &frame, nullptr) == RAPID_OK);
    auto names = sized<rapid_column>();
    REQUIRE(rapid_frame_column(frame, "name", &names, nullptr) == RAPID_OK);
    REQUIRE((names.type == RAPID_STRING && names.components == 1 && names.count == 2 && names.stride == 4));
    const auto* found = static_cast<const std::uint32_t*>(names.data);
    const char* name = nullptr;
    REQUIRE(rapid_frame_text_of(found[0], &name, nullptr) == RAPID_OK);
    CHECK(std::string(name) == "");
    REQUIRE(rapid_frame_text_of(found[1], &name, nullptr) == RAPID_OK);
    CHECK(std::string(name) == "fallen leaf");
    rapid_frame_release(frame, nullptr);
    rapid_scene_release(scene, nullptr);
    rapid_offers_release(offers, nullptr);
}

TEST_CASE("a mesh that is offered for each frame in C lifts points at its speed", "[c]")
{
    const std::int32_t triangles[] = {0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1,
                                      2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3};
    // The box has its top at this height. The caller releases the offers.
    const auto box_at = [&](float top) {
        std::vector<float> P;
        for (const float x : {-1.0f, 1.0f})
            for (const float y : {top - 0.2f, top})
                for (const float z : {-1.0f, 1.0f}) P.insert(P.end(), {x, y, z});
        rapid_offers* offers = nullptr;
        REQUIRE(rapid_offers_new(&offers, nullptr) == RAPID_OK);
        REQUIRE(rapid_offers_mesh(offers, "box", P.data(), 8, triangles, 12, nullptr) == RAPID_OK);
        return offers;
    };
    rapid_options options = rapid_default_options();
    options.offers = box_at(0);
    rapid_scene* scene = nullptr;
    REQUIRE(rapid_scene_open_text(
                "lift.lua",
                "local rapid = require 'rapid' return rapid.create { fps = 24, points = rapid.points.from { P = {{0, "
                "0.25, 0}} } } :collide { shape = function() return rapid.levelset.from_mesh(rapid.host 'box', { voxel "
                "= 0.05 }) end, bounce = 0 } :solve {}",
                &options, &scene, nullptr) == RAPID_OK);
    rapid_offers_release(options.offers, nullptr);
    for (int passed = 0; passed <= 6; ++passed) {
        const float top = 0.1f * static_cast<float>(passed);  // 2.4 m/s
        rapid_offers* offers = box_at(top);
        REQUIRE(rapid_scene_offer(scene, offers, nullptr) == RAPID_OK);
        rapid_offers_release(offers, nullptr);
        rapid_frame* frame = nullptr;
        REQUIRE(rapid_scene_advance(scene, &frame, nullptr) == RAPID_OK);
        auto P = sized<rapid_column>(), v = sized<rapid_column>();
        REQUIRE(rapid_frame_column(frame, "P", &P, nullptr) == RAPID_OK);
        REQUIRE(rapid_frame_column(frame, "v", &v, nullptr) == RAPID_OK);
        CHECK(static_cast<const float*>(P.data)[1] == Approx(std::max(0.25f, top)).margin(1e-4));
        CHECK(static_cast<const float*>(v.data)[1] == Approx(top > 0.25f ? 2.4 : 0).margin(1e-4));
        rapid_frame_release(frame, nullptr);
    }
    rapid_scene_release(scene, nullptr);
}

TEST_CASE("points are written, read, described and compared in C", "[c]")
{
    const test::TemporaryFolder folder;
    rapid_scene* scene = opened();
    rapid_frame *first = nullptr, *second = nullptr, *read = nullptr;
    REQUIRE(rapid_scene_advance(scene, &first, nullptr) == RAPID_OK);
    REQUIRE(rapid_scene_advance(scene, &second, nullptr) == RAPID_OK);
    REQUIRE(rapid_frame_write(first, (folder / "fall.npz").c_str(), nullptr) == RAPID_OK);
    REQUIRE(rapid_frame_read((folder / "fall.npz").c_str(), &read, nullptr) == RAPID_OK);
    const char *json = nullptr, *of_read = nullptr;
    REQUIRE(rapid_frame_describe(first, &json, nullptr) == RAPID_OK);
    REQUIRE(rapid_frame_describe(read, &of_read, nullptr) == RAPID_OK);
    CHECK_THAT(json, StartsWith("{\"points\":"));
    int same = -1;
    REQUIRE(rapid_frame_compare(read, first, 0, &same, nullptr, nullptr) == RAPID_OK);
    CHECK(same == 1);
    REQUIRE(rapid_frame_compare(first, second, 0, &same, &json, nullptr) == RAPID_OK);
    CHECK(same == 0);
    CHECK_THAT(json, StartsWith("{\"same\":false,"));
    for (rapid_frame* frame : {first, second, read}) rapid_frame_release(frame, nullptr);
    rapid_scene_release(scene, nullptr);
}

TEST_CASE("wrong offers in C are errors by name", "[c]")
{
    rapid_offers* offers = nullptr;
    REQUIRE(rapid_offers_new(&offers, nullptr) == RAPID_OK);
    const auto refused = [](const char* what, const auto& call) {
        OwnedError error;
        CHECK(call(error) == RAPID_WRONG_CALL);
        CHECK_THAT(error.message(), Contains(what));
    };
    auto shape = sized<rapid_shape>();
    auto type = sized<rapid_node_type>();
    refused("offers is NULL", [&](rapid_error** e) { return rapid_offers_new(nullptr, e); });
    refused("the offers handle is NULL", [&](rapid_error** e) { return rapid_offers_guard(nullptr, 1, e); });
    refused("release is NULL", [&](rapid_error** e) { return rapid_offers_on_release(offers, nullptr, nullptr, e); });
    refused("name is NULL", [&](rapid_error** e) { return rapid_offers_shape(offers, nullptr, &shape, e); });
    refused("shape is NULL", [&](rapid_error** e) { return rapid_offers_shape(offers, "a", nullptr, e); });
    refused("shape->distance", [&](rapid_error** e) { return rapid_offers_shape(offers, "a", &shape, e); });
    refused("positions", [&](rapid_error** e) { return rapid_offers_mesh(offers, "a", nullptr, 3, nullptr, 0, e); });
    refused("columns", [&](rapid_error** e) { return rapid_offers_points(offers, "a", 1, nullptr, 1, e); });
    refused("type->call", [&](rapid_error** e) { return rapid_offers_node(offers, &type, e); });
    type.call = [](void*, const rapid_call*) { return 0; };
    refused("type->name", [&](rapid_error** e) { return rapid_offers_node(offers, &type, e); });
    type.name = "a";
    type.kind = 9;
    refused("type->kind = 9", [&](rapid_error** e) { return rapid_offers_node(offers, &type, e); });
    CHECK(rapid_offers_release(offers, nullptr) == RAPID_OK);
    refused("the offers handle is not open: it was closed, or it is the handle of something else",
            [&](rapid_error** e) { return rapid_offers_release(offers, e); });
}

TEST_CASE("a program learns when a scene no longer uses its callbacks", "[c]")
{
    const auto count = [](void* counter) { ++*static_cast<int*>(counter); };
    int first = 0, second = 0, unused = 0;
    const auto offer_plane = [&](int& released) {
        rapid_offers* offers = nullptr;
        REQUIRE(rapid_offers_new(&offers, nullptr) == RAPID_OK);
        auto shape = sized<rapid_shape>();
        std::fill_n(shape.lower, 3, -HUGE_VAL);
        std::fill_n(shape.upper, 3, HUGE_VAL);
        shape.distance = [](void*, std::size_t n, const double* P, double* phi, double* gradient) {
            for (std::size_t i = 0; i < n; ++i) phi[i] = P[3 * i + 1] + 5;
            for (std::size_t i = 0; gradient && i < 3 * n; ++i) gradient[i] = i % 3 == 1;
            return 0;
        };
        REQUIRE(rapid_offers_shape(offers, "ground", &shape, nullptr) == RAPID_OK);
        REQUIRE(rapid_offers_on_release(offers, count, &released, nullptr) == RAPID_OK);
        return offers;
    };

    rapid_offers* offers = offer_plane(unused);
    CHECK(rapid_offers_release(offers, nullptr) == RAPID_OK);
    CHECK(unused == 1);

    rapid_options options = rapid_default_options();
    options.offers = offer_plane(first);
    rapid_scene* scene = nullptr;
    REQUIRE(rapid_scene_open_text("ground.lua",
                                  "local rapid = require 'rapid'\n"
                                  "return rapid.create {} :collide { shape = rapid.host 'ground' } :solve {}",
                                  &options, &scene, nullptr) == RAPID_OK);
    CHECK(rapid_offers_release(options.offers, nullptr) == RAPID_OK);
    rapid_frame* frame = nullptr;
    REQUIRE(rapid_scene_advance_to(scene, 3, &frame, nullptr) == RAPID_OK);
    CHECK(first == 0);
    rapid_offers* replacing = offer_plane(second);
    REQUIRE(rapid_scene_offer(scene, replacing, nullptr) == RAPID_OK);
    CHECK(rapid_offers_release(replacing, nullptr) == RAPID_OK);
    rapid_frame_release(frame, nullptr);
    rapid_scene_release(scene, nullptr);
    CHECK(first == 1);
    CHECK(second == 1);
    CHECK(unused == 1);
}

TEST_CASE("an error in C has message, file, line and node", "[c]")
{
    rapid_scene* scene = nullptr;
    OwnedError error;
    CHECK(rapid_scene_open_text("wrong.lua",
                                "local rapid = require 'rapid'\nreturn rapid.create {} :wind { speed = 1 }", nullptr,
                                &scene, error) == RAPID_WRONG_SCENE);
    CHECK(scene == nullptr);
    CHECK(std::string(rapid_error_file(error.get())) == "wrong.lua");
    CHECK(rapid_error_line(error.get()) == 2);
    CHECK(rapid_error_kind(error.get()) == RAPID_WRONG_SCENE);
    CHECK_THAT(rapid_error_text(error.get()), Contains("wrong.lua:2: "));
    CHECK(std::string(rapid_error_message(nullptr)).empty());
    CHECK(rapid_error_line(nullptr) == 0);
    rapid_error_release(nullptr);
}

TEST_CASE("a handle that is NULL, closed or of something else is an error", "[c]")
{
    rapid_scene* scene = opened();
    rapid_frame* frame = nullptr;
    REQUIRE(rapid_scene_advance(scene, &frame, nullptr) == RAPID_OK);
    auto column = sized<rapid_column>();
    {
        OwnedError error;
        CHECK(rapid_scene_advance(nullptr, nullptr, error) == RAPID_WRONG_CALL);
        CHECK(error.message() == "the scene handle is NULL");
    }
    {
        OwnedError error;
        CHECK(rapid_frame_column(reinterpret_cast<rapid_frame*>(scene), "P", &column, error) == RAPID_WRONG_CALL);
        CHECK_THAT(error.message(),
                   Contains("the frame handle is not open: it was closed, or it is the handle of something else"));
    }
    int local = 0;
    CHECK(rapid_scene_restart(reinterpret_cast<rapid_scene*>(&local), nullptr) == RAPID_WRONG_CALL);
    CHECK(rapid_frame_release(frame, nullptr) == RAPID_OK);
    CHECK(rapid_frame_release(frame, nullptr) == RAPID_WRONG_CALL);
    CHECK(rapid_frame_column(frame, "P", &column, nullptr) == RAPID_WRONG_CALL);
    CHECK(rapid_scene_release(scene, nullptr) == RAPID_OK);
    CHECK(rapid_scene_release(scene, nullptr) == RAPID_WRONG_CALL);
    CHECK(rapid_scene_advance(scene, nullptr, nullptr) == RAPID_WRONG_CALL);
    rapid_scene* next = opened();  // may have the address of the previous one
    CHECK(next != scene);
    CHECK(rapid_scene_next_frame(scene) == 0);
    CHECK(rapid_scene_next_frame(next) == 1);
    CHECK(rapid_scene_release(next, nullptr) == RAPID_OK);
}

TEST_CASE("arguments that are NULL are errors by name", "[c]")
{
    rapid_scene* scene = opened();
    rapid_frame* frame = nullptr;
    REQUIRE(rapid_scene_advance(scene, &frame, nullptr) == RAPID_OK);
    const auto refused = [](const char* name, const auto& call) {
        OwnedError error;
        CHECK(call(error) == RAPID_WRONG_CALL);
        CHECK_THAT(error.message(), Contains(std::string(name) + " is NULL"));
    };
    rapid_scene* other = nullptr;
    refused("file", [&](rapid_error** e) { return rapid_scene_open(nullptr, nullptr, &other, e); });
    refused("text", [&](rapid_error** e) { return rapid_scene_open_text("a", nullptr, nullptr, &other, e); });
    refused("scene", [&](rapid_error** e) { return rapid_scene_open_text("a", fall, nullptr, nullptr, e); });
    refused("scene", [&](rapid_error** e) { return rapid_scene_open("a.lua", nullptr, nullptr, e); });
    refused("name", [&](rapid_error** e) { return rapid_scene_open_text(nullptr, fall, nullptr, &other, e); });
    refused("text", [&](rapid_error** e) { return rapid_scene_warnings(scene, nullptr, e); });
    refused("the offers handle", [&](rapid_error** e) { return rapid_scene_offer(scene, nullptr, e); });
    refused("a setting's name", [&](rapid_error** e) {
        const rapid_setting unnamed = {nullptr, {RAPID_NUMBER, {1, 0, 0}, nullptr}};
        return rapid_scene_set(scene, &unnamed, 1, e);
    });
    refused("the text of a value", [&](rapid_error** e) {
        const rapid_setting empty = {"height", {RAPID_TEXT, {0, 0, 0}, nullptr}};
        return rapid_scene_set(scene, &empty, 1, e);
    });
    refused("parameter", [&](rapid_error** e) { return rapid_scene_parameter(scene, 0, nullptr, e); });
    refused("settings", [&](rapid_error** e) { return rapid_scene_set(scene, nullptr, 1, e); });
    refused("node", [&](rapid_error** e) { return rapid_scene_node(scene, 0, nullptr, e); });
    refused("json", [&](rapid_error** e) { return rapid_scene_node_types(scene, nullptr, e); });
    refused("snapshot", [&](rapid_error** e) { return rapid_scene_save(scene, nullptr, e); });
    refused("the snapshot handle", [&](rapid_error** e) { return rapid_scene_restore(scene, nullptr, e); });
    refused("json", [&](rapid_error** e) { return rapid_scene_explain(scene, nullptr, e); });
    refused("node", [&](rapid_error** e) {
        rapid_frame* behind = nullptr;
        return rapid_scene_points_after(scene, nullptr, 2, &behind, e);
    });
    refused("frame", [&](rapid_error** e) { return rapid_scene_points_after(scene, "solve1", 2, nullptr, e); });
    refused("json", [&](rapid_error** e) { return rapid_frame_profile_json(frame, nullptr, e); });
    refused("text", [&](rapid_error** e) { return rapid_scene_graph(scene, RAPID_GRAPH_DOT, nullptr, e); });
    refused("json", [&](rapid_error** e) {
        const std::int64_t id = 0;
        return rapid_scene_trace(scene, &id, 1, nullptr, 1, 2, nullptr, e);
    });
    refused("ids", [&](rapid_error** e) {
        const char* json = nullptr;
        return rapid_scene_trace(scene, nullptr, 1, nullptr, 1, 2, &json, e);
    });
    refused("name", [&](rapid_error** e) {
        auto column = sized<rapid_column>();
        return rapid_frame_column(frame, nullptr, &column, e);
    });
    refused("column", [&](rapid_error** e) { return rapid_frame_column(frame, "P", nullptr, e); });
    refused("column", [&](rapid_error** e) { return rapid_frame_expanded(frame, "heat", nullptr, e); });
    refused("name", [&](rapid_error** e) { return rapid_frame_detail(frame, nullptr, nullptr, e); });
    refused("frame", [&](rapid_error** e) { return rapid_frame_output(frame, "main", nullptr, e); });
    refused("lines", [&](rapid_error** e) { return rapid_frame_columns(frame, nullptr, e); });
    refused("json", [&](rapid_error** e) { return rapid_frame_statistics_json(frame, nullptr, e); });
    refused("png", [&](rapid_error** e) {
        size_t bytes = 0;
        return rapid_scene_picture(scene, frame, 32, 18, nullptr, &bytes, e);
    });
    refused("bytes", [&](rapid_error** e) {
        const void* png = nullptr;
        return rapid_scene_picture(scene, frame, 32, 18, &png, nullptr, e);
    });
    refused("call", [&](rapid_error** e) { return rapid_call_add_rod(nullptr, 0, 1, 1, 0, e); });
    refused("statistics", [&](rapid_error** e) { return rapid_frame_statistics(frame, nullptr, e); });
    refused("shapes", [&](rapid_error** e) { return rapid_scene_shapes(scene, 1, nullptr, e); });
    refused("run", [&](rapid_error** e) { return rapid_run_make("a.lua", nullptr, nullptr, nullptr, e); });
    refused("path", [&](rapid_error** e) { return rapid_frame_write(frame, nullptr, e); });
    refused("path", [&](rapid_error** e) {
        rapid_snapshot* read = nullptr;
        return rapid_snapshot_read(nullptr, &read, e);
    });
    refused("snapshot", [&](rapid_error** e) { return rapid_snapshot_read("fall.state", nullptr, e); });
    refused("the snapshot handle", [&](rapid_error** e) { return rapid_snapshot_write(nullptr, "fall.state", e); });
    refused("path", [&](rapid_error** e) {
        rapid_frame* read = nullptr;
        return rapid_frame_read(nullptr, &read, e);
    });
    refused("frame", [&](rapid_error** e) { return rapid_frame_read("points.csv", nullptr, e); });
    refused("json", [&](rapid_error** e) { return rapid_frame_describe(frame, nullptr, e); });
    refused("the frame handle",
            [&](rapid_error** e) { return rapid_frame_compare(frame, nullptr, 0, nullptr, nullptr, e); });
    CHECK(rapid_frame_compare(frame, frame, 0, nullptr, nullptr, nullptr) == RAPID_OK);
    CHECK(rapid_scene_set(scene, nullptr, 0, nullptr) == RAPID_OK);
    rapid_frame_release(frame, nullptr);
    rapid_scene_release(scene, nullptr);
}

TEST_CASE("a struct's size says what the program knows", "[c]")
{
    rapid_scene* scene = nullptr;
    rapid_options options = rapid_default_options();
    OwnedError error;
    options.size = 0;
    CHECK(rapid_scene_open_text("a.lua", fall, &options, &scene, error) == RAPID_WRONG_CALL);
    CHECK_THAT(error.message(), Contains("sizeof(*options)"));

    // Options of an older program, whose struct ends after the settings.
    const rapid_setting height = {"height", {RAPID_NUMBER, {3, 0, 0}, nullptr}};
    options = rapid_default_options();
    options.size = offsetof(rapid_options, seed);
    options.set = &height;
    options.set_count = 1;
    options.threads = -5;  // not part of the older struct
    REQUIRE(rapid_scene_open_text("a.lua", fall, &options, &scene, nullptr) == RAPID_OK);
    auto parameter = sized<rapid_parameter>();
    REQUIRE(rapid_scene_parameter(scene, 0, &parameter, nullptr) == RAPID_OK);
    CHECK(parameter.value.number[0] == 3);
    CHECK(parameter.fallback.number[0] == 10);
    parameter = {};
    parameter.size = offsetof(rapid_parameter, value);
    REQUIRE(rapid_scene_parameter(scene, 0, &parameter, nullptr) == RAPID_OK);
    CHECK(std::string(parameter.doc) == "m, of the drop");
    CHECK(parameter.value.number[0] == 0);
    parameter.size = 3;
    CHECK(rapid_scene_parameter(scene, 0, &parameter, nullptr) == RAPID_WRONG_CALL);
    rapid_scene_release(scene, nullptr);

    // Options of a newer program. A newer field that is not used is zero.
    struct Newer {
        rapid_options known;
        void* more;
    } newer{rapid_default_options(), nullptr};
    newer.known.size = sizeof newer;
    REQUIRE(rapid_scene_open_text("a.lua", fall, &newer.known, &scene, nullptr) == RAPID_OK);
    rapid_scene_release(scene, nullptr);
    newer.more = &newer;
    CHECK(rapid_scene_open_text("a.lua", fall, &newer.known, &scene, nullptr) == RAPID_WRONG_CALL);
}

TEST_CASE("callbacks get the program's pointer, and may not call the scene", "[c]")
{
    struct Seen {
        rapid_scene* scene = nullptr;
        int frames = 0, status = -1;
    } seen;
    rapid_options options = rapid_default_options();
    options.user = &seen;
    options.progress = [](void* user, int64_t frame, int64_t) {
        auto& s = *static_cast<Seen*>(user);
        ++s.frames;
        s.status = rapid_scene_advance(s.scene, nullptr, nullptr);
        return frame < 3 ? 1 : 0;
    };
    REQUIRE(rapid_scene_open_text("a.lua", fall, &options, &seen.scene, nullptr) == RAPID_OK);
    CHECK(rapid_scene_advance_to(seen.scene, 9, nullptr, nullptr) == RAPID_CANCELLED);
    CHECK(seen.frames == 3);
    CHECK(seen.status == RAPID_BUSY);
    // If the scene is closed during its own call, that call still completes.
    options.progress = [](void* user, int64_t, int64_t) {
        auto& s = *static_cast<Seen*>(user);
        s.status = rapid_scene_release(s.scene, nullptr);
        return 1;
    };
    rapid_scene_release(seen.scene, nullptr);
    REQUIRE(rapid_scene_open_text("a.lua", fall, &options, &seen.scene, nullptr) == RAPID_OK);
    CHECK(rapid_scene_advance_to(seen.scene, 1, nullptr, nullptr) == RAPID_OK);
    CHECK(seen.status == RAPID_OK);
    CHECK(rapid_scene_advance(seen.scene, nullptr, nullptr) == RAPID_WRONG_CALL);
}

TEST_CASE("the shapes of a scene are read in C, and a picture has them", "[c]")
{
    rapid_scene* scene = opened(
        "local rapid = require 'rapid'\n"
        "return rapid.create {} :emit { source = rapid.mesh.box { size = {2, 4, 6} }, rate = 1000 }\n"
        "  :collide { shape = rapid.shape.plane { normal = {0, 1, 0}, offset = -3 } } :solve {}");
    rapid_shapes* shapes = nullptr;
    REQUIRE(rapid_scene_shapes(scene, 1, &shapes, nullptr) == RAPID_OK);
    REQUIRE(rapid_shapes_mesh_count(shapes) == 1);
    REQUIRE(rapid_shapes_plane_count(shapes) == 1);
    auto mesh = sized<rapid_mesh>();
    REQUIRE(rapid_shapes_mesh(shapes, 0, &mesh, nullptr) == RAPID_OK);
    CHECK(mesh.role == RAPID_EMITTER);
    double volume = 0;  // by the divergence theorem
    for (std::size_t i = 0; i < mesh.triangle_count; ++i) {
        const auto corner = [&](std::size_t k) { return mesh.positions + 3 * mesh.triangles[3 * i + k]; };
        const float *a = corner(0), *b = corner(1), *c = corner(2);
        volume += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                   a[2] * (b[0] * c[1] - b[1] * c[0])) /
                  6;
    }
    CHECK(volume == Approx(48));
    auto plane = sized<rapid_plane>();
    REQUIRE(rapid_shapes_plane(shapes, 0, &plane, nullptr) == RAPID_OK);
    CHECK(plane.normal[1] == 1);
    CHECK(plane.offset == -3);
    CHECK(rapid_shapes_has_camera(shapes) == 0);

    rapid_frame* frame = nullptr;
    REQUIRE(rapid_scene_advance(scene, &frame, nullptr) == RAPID_OK);
    const void* png = nullptr;
    std::size_t bytes = 0;
    REQUIRE(rapid_scene_picture(scene, frame, 64, 36, &png, &bytes, nullptr) == RAPID_OK);
    const std::string fitted(static_cast<const char*>(png), bytes);
    REQUIRE(rapid_frame_picture(frame, shapes, nullptr, 64, 36, &png, &bytes, nullptr) == RAPID_OK);
    CHECK(std::string(static_cast<const char*>(png), bytes) == fitted);
    const double position[] = {0, 50, 90};
    const rapid_camera far_away = {position, nullptr, 20};
    REQUIRE(rapid_frame_picture(frame, shapes, &far_away, 64, 36, &png, &bytes, nullptr) == RAPID_OK);
    CHECK(std::string(static_cast<const char*>(png), bytes) != fitted);
    rapid_frame_release(frame, nullptr);
    rapid_shapes_release(shapes, nullptr);
    rapid_scene_release(scene, nullptr);
}

TEST_CASE("a run in C writes its files, and those of its parts are merged into the same", "[c]")
{
    const test::TemporaryFolder folder;
    const auto bytes_of = [](const std::string& file) {
        std::ifstream in(file, std::ios::binary);
        return std::string(std::istreambuf_iterator<char>(in), {});
    };
    struct Seen {
        int frames = 0, merged = 0;
    } seen;
    const rapid_frames two = {1, 2, 1};
    const auto run = [&](const std::string& output, int part, int count) {
        const char* outputs[] = {output.c_str()};
        rapid_run_options options = rapid_default_run_options();
        options.text = fall;
        options.frames = &two;
        options.outputs = outputs;
        options.output_count = 1;
        options.part = part;
        options.part_count = count;
        options.user = &seen;
        options.frame = [](void* user, int64_t, uint64_t, double, int) { ++static_cast<Seen*>(user)->frames; };
        rapid_run* made = nullptr;
        REQUIRE(rapid_run_make("fall.lua", nullptr, &options, &made, nullptr) == RAPID_OK);
        REQUIRE(rapid_run_prepare(made, nullptr) == RAPID_OK);
        CHECK(rapid_run_first_frame(made) == 1);
        rapid_frames frames{};
        REQUIRE(rapid_run_frames(made, &frames, nullptr) == RAPID_OK);
        CHECK(frames.last == 2);
        auto outcome = sized<rapid_outcome>();
        REQUIRE(rapid_run_run(made, &outcome, nullptr) == RAPID_OK);
        CHECK(outcome.ending == RAPID_COMPLETE);
        CHECK(outcome.last_frame == 2);
        CHECK(std::string(outcome.summary).size() > 10);
        rapid_run_release(made, nullptr);
    };
    run(folder / "whole.####.csv", 0, 0);
    CHECK(seen.frames == 2);
    for (const int part : {1, 2}) run(folder / "x.####.csv", part, 2);
    const std::string parts = folder / "x_part{part}.####.csv";
    const char* patterns[] = {parts.c_str()};
    auto merged = sized<rapid_merged>();
    REQUIRE(rapid_merge_files(
                patterns, 1, (folder / "merged.####.csv").c_str(),
                [](void* user, int64_t, uint64_t) { return ++static_cast<Seen*>(user)->merged; }, &seen, &merged,
                nullptr) == RAPID_OK);
    CHECK(merged.parts == 2);
    CHECK(merged.frames == 2);
    CHECK(merged.points == 32);
    CHECK(seen.merged == 2);
    for (const char* number : {"0001", "0002"})
        CHECK(bytes_of(folder / ("merged." + std::string(number) + ".csv")) ==
              bytes_of(folder / ("whole." + std::string(number) + ".csv")));
}

TEST_CASE("an error of a frame of a run is there with its outcome in C", "[c]")
{
    rapid_run_options options = rapid_default_run_options();
    options.text =
        "local rapid = require 'rapid'\n"
        "return rapid.create { points = rapid.points.grid {} }"
        ":points('fails', function(p, frame) if frame.number == 3 then error 'no more' end end) :solve {}";
    rapid_run* run = nullptr;
    REQUIRE(rapid_run_make("fails.lua", nullptr, &options, &run, nullptr) == RAPID_OK);
    REQUIRE(rapid_run_prepare(run, nullptr) == RAPID_OK);
    auto outcome = sized<rapid_outcome>();
    OwnedError error;
    CHECK(rapid_run_run(run, &outcome, error) == RAPID_FAILED_FRAME);
    CHECK(outcome.ending == RAPID_FAILED);
    CHECK(outcome.last_frame == 2);
    CHECK_THAT(error.message(), Contains("no more"));
    rapid_run_release(run, nullptr);
}

TEST_CASE("handles are opened and closed on several threads", "[c][threads]")
{
    std::atomic<int> wrong = 0;
    std::vector<std::thread> threads;
    for (int t = 0; t < 3; ++t)
        threads.emplace_back([&] {
            for (int i = 0; i < 3; ++i) {
                rapid_scene* scene = nullptr;
                rapid_frame* frame = nullptr;
                if (rapid_scene_open_text("fall.lua", fall, nullptr, &scene, nullptr) != RAPID_OK) ++wrong;
                if (rapid_scene_advance_to(scene, 3, &frame, nullptr) != RAPID_OK) ++wrong;
                if (rapid_scene_release(scene, nullptr) != RAPID_OK) ++wrong;
                if (rapid_frame_release(frame, nullptr) != RAPID_OK) ++wrong;
            }
        });
    for (std::thread& thread : threads) thread.join();
    CHECK(wrong == 0);
}

}  // namespace rapid
