/* Plays a scene's points into pictures, frame.0001.ppm and so on: as much of a renderer as docs/host.md leads to.
 *
 *     player graphs/first.lua 96
 */
#include <rapid/rapid.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { width = 640, height = 360 };
static unsigned char picture[height][width][3];

static void check(int status, rapid_error** error)
{
    if (status == RAPID_OK) return;
    fprintf(stderr, "%s\n", rapid_error_text(*error));
    rapid_error_release(*error);
    exit(1);
}

/* Adds light where a camera at (0, 1, 7), looking along -z, sees the point. */
static void draw(const float* P)
{
    static const unsigned char light[3] = {90, 70, 40};
    const float depth = 7 - P[2], focal = 500; /* m, pixels */
    if (depth < 0.1f) return;
    const float x = width / 2 + focal * P[0] / depth, y = height / 2 - focal * (P[1] - 1) / depth;
    if (!(x >= 0 && x < width && y >= 0 && y < height)) return;
    unsigned char* pixel = picture[(int)y][(int)x];
    for (int c = 0; c < 3; ++c) pixel[c] = pixel[c] + light[c] < 255 ? (unsigned char)(pixel[c] + light[c]) : 255;
}

static void write(int number)
{
    char name[32];
    snprintf(name, sizeof name, "frame.%04d.ppm", number);
    FILE* file = fopen(name, "wb");
    if (!file || fprintf(file, "P6\n%d %d\n255\n", width, height) < 0 ||
        fwrite(picture, sizeof picture, 1, file) != 1 || fclose(file) != 0) {
        perror(name);
        exit(1);
    }
}

int main(int count, char** arguments)
{
    rapid_error* error = NULL;
    rapid_scene* scene = NULL;
    if (count != 3) {
        fprintf(stderr, "player SCENE LAST-FRAME\n");
        return 2;
    }
    check(rapid_scene_open(arguments[1], NULL, &scene, &error), &error);
    for (int number = 1; number <= atoi(arguments[2]); ++number) {
        rapid_frame* frame = NULL;
        rapid_column P = {sizeof P, NULL, 0, 0, 0, 0, NULL};
        check(rapid_scene_advance_to(scene, number, &frame, &error), &error);
        check(rapid_frame_column(frame, "P", &P, &error), &error);
        memset(picture, 0, sizeof picture);
        for (size_t i = 0; i < P.count; ++i) draw((const float*)((const char*)P.data + i * P.stride));
        write(number);
        check(rapid_frame_release(frame, &error), &error);
    }
    check(rapid_scene_release(scene, &error), &error);
    return 0;
}
