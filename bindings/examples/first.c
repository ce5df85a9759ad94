/* Opens graphs/first.lua, puts a ball of its own in the place of the torus, and prints the mean height of the beads.
 *
 *     first_c graphs/first.lua
 */
#include <math.h>
#include <rapid/rapid.h>
#include <stdio.h>
#include <stdlib.h>

static const double center[3] = {0, 0.7, 0}, radius = 0.7; /* m */

static int ball(void* user, size_t n, const double* P, double* phi, double* gradient)
{
    (void)user;
    for (size_t i = 0; i < n; ++i, P += 3) {
        const double d[3] = {P[0] - center[0], P[1] - center[1], P[2] - center[2]};
        const double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        phi[i] = length - radius;
        if (gradient)
            for (int axis = 0; axis < 3; ++axis) gradient[3 * i + axis] = length > 0 ? d[axis] / length : 0;
    }
    return 0;
}

static void check(int status, rapid_error** error)
{
    if (status == RAPID_OK) return;
    fprintf(stderr, "%s\n", rapid_error_text(*error));
    rapid_error_release(*error);
    exit(1);
}

static void warn(void* user, int level, const char* text)
{
    (void)user;
    fprintf(stderr, "%s%s\n", level == RAPID_LOG_WARNING ? "warning: " : "", text);
}

int main(int count, char** arguments)
{
    rapid_error* error = NULL;
    rapid_offers* offers = NULL;
    rapid_scene* scene = NULL;
    const rapid_shape shape = {sizeof shape, {-0.7, 0, -0.7}, {0.7, 1.4, 0.7}, ball, NULL, 1, 0};
    const rapid_setting settings[] = {{"rate", {RAPID_NUMBER, {5000, 0, 0}, NULL}},
                                      {"collide1.shape", {RAPID_TEXT, {0, 0, 0}, "host:ball"}}};
    rapid_options options = rapid_default_options();

    check(rapid_offers_new(&offers, &error), &error);
    check(rapid_offers_shape(offers, "ball", &shape, &error), &error);
    options.offers = offers;
    options.set = settings;
    options.set_count = 2;
    options.log = warn;
    check(rapid_scene_open(count > 1 ? arguments[1] : "graphs/first.lua", &options, &scene, &error), &error);

    for (int number = 24; number <= 96; number += 24) {
        rapid_frame* frame = NULL;
        rapid_column P = {sizeof P, NULL, 0, 0, 0, 0, NULL};
        double sum = 0, nearest = INFINITY;
        check(rapid_scene_advance_to(scene, number, &frame, &error), &error);
        check(rapid_frame_column(frame, "P", &P, &error), &error);
        for (size_t i = 0; i < P.count; ++i) {
            const float* at = (const float*)((const char*)P.data + i * P.stride);
            const double d[3] = {at[0] - center[0], at[1] - center[1], at[2] - center[2]};
            sum += at[1];
            nearest = fmin(nearest, sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]));
        }
        printf("frame %d: %zu points, mean height %.4f m, nearest to the ball's middle %.3f m\n", number, P.count,
               P.count ? sum / (double)P.count : 0, nearest);
        check(rapid_frame_release(frame, &error), &error);
    }
    rapid_offers_release(offers, NULL);
    check(rapid_scene_release(scene, &error), &error);
    return 0;
}
