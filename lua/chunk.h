// What a kernel's runner sees of the points: compiled into the host, and given as text to ffi.cdef (lua/kernel.lua).
// Graph code never gets hold of any of it.

typedef struct rapid_float3 { float x, y, z; } rapid_float3;
typedef struct rapid_float4 { float x, y, z, w; } rapid_float4;
typedef struct rapid_double3 { double x, y, z; } rapid_double3;

// A runner has one, at the same place for as long as it lives: the host writes it before each call.
typedef struct rapid_chunk {
    double number, time, dt;  // the frame, seconds; first, since kernels get them as they lie here
    double first;             // place in the set of the chunk's first point
    double substep;           // of an action, from 0
    int32_t size;             // points
    int32_t at;               // the point that is being worked on, -1 for none
    int32_t not_finite;       // the point to which a value that is not finite was last assigned, -1 for none
    uint64_t random;          // key of the node's random numbers
    uint8_t* kill;            // shape [size], set to 1 by p:kill(); null where the kernel never kills
    uint8_t* result;          // shape [size], what a predicate returned; null for other kernels
    uint8_t* members;         // shape [size], the points to visit; null for all
    const double* times;      // of an action: each point's own time, s since the start, and sub-step, s; shape [size]
    const double* steps;
    // Behind it lie pointers to the first point's value in each column, and then in each group (uint8, 0 or 1), as the
    // runner's layout numbers them. Where all points share one value, there is one.
} rapid_chunk;

typedef double (*rapid_rand)(uint64_t random, int64_t id, double use, double frame);

// Of a shape's own pointer; gradient: shape [3].
typedef double (*rapid_shape_distance)(const void* shape, double x, double y, double z, double* gradient);

// The velocity of its surface, m/s; value: shape [3].
typedef void (*rapid_shape_velocity)(const void* shape, double x, double y, double z, double* value);

// Of a mesh's own pointer and that of its surface in the step: the numbers of the attribute where it is nearest, 1 or 3,
// or 0 where it has none of this name; value: shape [3].
typedef int32_t (*rapid_mesh_value)(const void* mesh, const void* shape, const char* name, double x, double y, double z,
                                    double* value);

// Of a grid of vectors' own pointer; value: shape [3].
typedef void (*rapid_vector_grid_sample)(const void* grid, double x, double y, double z, double* value);

// Of a fog's own pointer.
typedef double (*rapid_fog_sample)(const void* fog, double x, double y, double z);

// runtime/noise.h; curl: shape [3].
typedef double (*rapid_noise)(double x, double y, double z, double time, double octaves, double seed);
typedef void (*rapid_curl_noise)(double x, double y, double z, double time, double octaves, double seed, double* curl);
