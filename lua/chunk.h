// What a kernel's runner sees of the points: compiled into the host, and given as text to ffi.cdef (lua/kernel.lua).
// Graph code never gets hold of any of it.

typedef struct rapid_column {
    void* data;      // of the chunk's first point
    int64_t stride;  // scalars from one point to the next: 1, 3 (vec3), 4 (quat), or 0 where all points share one value
} rapid_column;

typedef struct rapid_chunk {
    int64_t size;           // points
    int64_t first;          // place in the set of the chunk's first point
    rapid_column* columns;  // as the runner's layout numbers them
    rapid_column* groups;   // uint8, 0 or 1
    uint8_t* kill;          // shape [size], set to 1 by p:kill(); null where the kernel never kills
    uint8_t* result;        // shape [size], what a predicate returned; null for other kernels
    uint8_t* members;       // shape [size], the points to visit; null for all
    uint64_t random;        // key of the node's random numbers
    double number, time, dt;  // the frame, seconds
    double substep;           // of an action, from 0
    const double* times;      // of an action: each point's own time, s since the start, and sub-step, s; shape [size]
    const double* steps;
} rapid_chunk;

typedef double (*rapid_rand)(uint64_t random, int64_t id, double use, double frame);

// Of a shape's own pointer; gradient: shape [3].
typedef double (*rapid_shape_distance)(const void* shape, double x, double y, double z, double* gradient);

// Of a grid of vectors' own pointer; value: shape [3].
typedef void (*rapid_vector_grid_sample)(const void* grid, double x, double y, double z, double* value);

// runtime/noise.h; curl: shape [3].
typedef double (*rapid_noise)(double x, double y, double z, double time, double octaves, double seed);
typedef void (*rapid_curl_noise)(double x, double y, double z, double time, double octaves, double seed, double* curl);
