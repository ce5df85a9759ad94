// A program that embeds Rapid and calls each of its functions, for tests/c/test_memory.cpp. A call fails only if memory
// is refused, or because an earlier call failed; the run after one that failed passes. It exits with 0 if that holds.
#include <cstdio>
#include <cstdlib>

#include "include/rapid/rapid.h"

namespace {

const char* const text =
    "local rapid = require 'rapid'\n"
    "local height = rapid.param('height', 2, 'm')\n"
    "return rapid.create { points = rapid.host 'cloud' }\n"
    "  :attribute { heat = 2 } :push { strength = 1 }\n"
    "  :points('warm', function(p) p.heat = p.heat + p:rand(1); p:join 'hot' end)\n"
    "  :emit { source = rapid.mesh.sphere { radius = 1 }, rate = 500, life = 1 }\n"
    "  :gravity {} :collide { shape = rapid.host 'floor' }\n"
    "  :solve { substeps = 2 }\n";

template <class T>
T sized()
{
    T result{};
    result.size = sizeof(T);
    return result;
}

bool is_right = true;
bool has_failed = false;
rapid_error* error = nullptr;  // of the last call

// Records a call's result. Returns true if it succeeded.
bool done(const char* name, int status)
{
    if (status != RAPID_OK && status != RAPID_OUT_OF_MEMORY && !has_failed) {
        is_right = false;
        std::printf("%s: status %d: %s\n", name, status, rapid_error_text(error));
    }
    has_failed = has_failed || status != RAPID_OK;
    rapid_error_release(error);
    error = nullptr;
    return status == RAPID_OK;
}

// The distance to a plane 0.1 m below the origin.
int floor_distance(void*, size_t n, const double* P, double* phi, double* gradient)
{
    for (size_t i = 0; i < n; ++i) {
        phi[i] = P[3 * i + 1] + 0.1;
        if (!gradient) continue;
        gradient[3 * i] = gradient[3 * i + 2] = 0;
        gradient[3 * i + 1] = 1;
    }
    return 0;
}

int push(void*, const rapid_call* call)
{
    for (size_t i = 0; i < call->count; ++i) call->acceleration[3 * i] = call->parameters[0];
    return 0;
}

void offer(rapid_offers* offers)
{
    const float P[] = {0, 1, 0, 0, 2, 0};
    auto column = sized<rapid_column>();
    column.name = "P";
    column.type = RAPID_FLOAT_VEC3;
    column.data = P;
    done("offers_points", rapid_offers_points(offers, "cloud", 2, &column, 1, &error));
    auto shape = sized<rapid_shape>();
    const double least = -100, most = 100;
    for (int axis = 0; axis < 3; ++axis) shape.lower[axis] = least, shape.upper[axis] = axis == 1 ? 0 : most;
    shape.distance = floor_distance;
    done("offers_shape", rapid_offers_shape(offers, "floor", &shape, &error));
    const rapid_node_parameter strength = {"strength", "m/s^2", nullptr, {RAPID_NUMBER, {1, 0, 0}, nullptr}};
    auto type = sized<rapid_node_type>();
    type.name = "push";
    type.doc = "Pushes.";
    type.parameters = &strength;
    type.parameter_count = 1;
    type.call = push;
    done("offers_node", rapid_offers_node(offers, &type, &error));
}

void read(rapid_scene* scene, rapid_frame* frame)
{
    const char* words = nullptr;
    const void* png = nullptr;
    size_t bytes = 0;
    auto column = sized<rapid_column>();
    auto statistics = sized<rapid_statistics>();
    done("frame_column", rapid_frame_column(frame, "P", &column, &error));
    done("frame_expanded", rapid_frame_expanded(frame, "heat", &column, &error));
    done("frame_statistics", rapid_frame_statistics(frame, &statistics, &error));
    done("frame_statistics_json", rapid_frame_statistics_json(frame, &words, &error));
    done("frame_names", rapid_frame_columns(frame, &words, &error));
    done("frame_profile", rapid_frame_profile_json(frame, &words, &error));
    done("scene_explain", rapid_scene_explain(scene, &words, &error));
    done("scene_graph", rapid_scene_graph(scene, RAPID_GRAPH_DOT, &words, &error));
    done("frame_describe", rapid_frame_describe(frame, &words, &error));
    done("frame_compare", rapid_frame_compare(frame, frame, 0, nullptr, &words, &error));
    done("node_types", rapid_scene_node_types(scene, &words, &error));
    done("picture", rapid_scene_picture(scene, frame, 32, 18, &png, &bytes, &error));
    const int status = rapid_frame_column(frame, "nothing", &column, &error);
    done("frame_column of no name", status == RAPID_WRONG_CALL ? RAPID_OK : status);
}

void run(rapid_offers* offers)
{
    rapid_options options = rapid_default_options();
    options.offers = offers;
    options.threads = 1;
    rapid_scene* scene = nullptr;
    done("open", rapid_scene_open_text("scene.lua", text, &options, &scene, &error));
    rapid_frame* frame = nullptr;
    rapid_snapshot* snapshot = nullptr;
    if (done("advance_to", rapid_scene_advance_to(scene, 3, &frame, &error))) read(scene, frame);
    if (done("save", rapid_scene_save(scene, &snapshot, &error))) {
        done("advance", rapid_scene_advance(scene, nullptr, &error));
        done("restore", rapid_scene_restore(scene, snapshot, &error));
    }
    const int64_t id = 0;
    const char* lives = nullptr;
    rapid_frame* behind = nullptr;
    if (done("points_after", rapid_scene_points_after(scene, "solve1", 2, &behind, &error)))
        done("frame_release", rapid_frame_release(behind, &error));
    done("trace", rapid_scene_trace(scene, &id, 1, nullptr, 1, 2, &lives, &error));
    const rapid_setting height = {"height", {RAPID_NUMBER, {3, 0, 0}, nullptr}};
    done("set", rapid_scene_set(scene, &height, 1, &error));
    done("restart", rapid_scene_restart(scene, &error));
    done("advance_to", rapid_scene_advance_to(scene, 2, nullptr, &error));
    if (frame) rapid_frame_release(frame, nullptr);
    if (snapshot) rapid_snapshot_release(snapshot, nullptr);
    if (scene) rapid_scene_release(scene, nullptr);
}

}  // namespace

int main(int count, char** arguments)
{
    // If the first run makes fewer allocations than were counted, the refused one may fall into the second run.
    const int most = count > 1 ? std::atoi(arguments[1]) : 3;
    bool failed_before = false;
    for (int run_number = 0; run_number < most; ++run_number) {
        has_failed = false;
        rapid_offers* offers = nullptr;
        if (done("offers_new", rapid_offers_new(&offers, &error))) offer(offers);
        run(offers);
        if (offers) rapid_offers_release(offers, nullptr);
        if (failed_before && !has_failed) break;
        failed_before = has_failed;
    }
    if (has_failed) std::printf("a scene does not run after the one that failed\n");
    return is_right && !has_failed ? 0 : 1;
}
