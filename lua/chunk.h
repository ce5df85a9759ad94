// The view of the points that a kernel's runner gets: compiled into the host, and passed as text to ffi.cdef
// (lua/kernel.lua). Graph code cannot reach any of it.

typedef struct rapid_float3 {
    float x, y, z;
} rapid_float3;
typedef struct rapid_float4 {
    float x, y, z, w;
} rapid_float4;
typedef struct rapid_double3 {
    double x, y, z;
} rapid_double3;

// Each runner has one, at a fixed address for its lifetime: the host writes it before each call.
typedef struct rapid_chunk {
    double number, time, dt;  // the frame, seconds; first, since kernels read them at this offset
    double first;             // index in the set of the chunk's first point
    double substep;           // in an action: the substep, from 0
    int32_t size;             // points
    int32_t at;               // the point being processed, -1 for none
    int32_t not_finite;       // the point to which a value that is not finite was last assigned, -1 for none
    uint64_t random;          // key of the node's random numbers
    uint8_t* kill;            // shape [size], set to 1 by p:kill(); null if the kernel never kills
    uint8_t* result;          // shape [size], the results of a predicate; null for other kernels
    uint8_t* members;         // shape [size], the points to visit; null for all
    const double* times;      // in an action: each point's time, s since the start, and substep, s; shape [size]
    const double* steps;
    // Followed by pointers to the first point's value in each column, and then in each group (uint8, 0 or 1), as the
    // runner's layout numbers them. A column or group that all points share holds a single value.
} rapid_chunk;

typedef double (*rapid_rand)(uint64_t random, int64_t id, double use, double frame);

// The distance to a shape. gradient: shape [3].
typedef double (*rapid_shape_distance)(const void* shape, double x, double y, double z, double* gradient);

// The velocity of a shape's surface, m/s. value: shape [3].
typedef void (*rapid_shape_velocity)(const void* shape, double x, double y, double z, double* value);

// The value of a mesh attribute at the nearest point. shape: the mesh's surface in the step; value: shape [3]. Returns
// the number of components, 1 or 3, or 0 if the mesh has no attribute of this name.
typedef int32_t (*rapid_mesh_value)(const void* mesh, const void* shape, const char* name, double x, double y, double z,
                                    double* value);

// A sample of a vector grid. value: shape [3].
typedef void (*rapid_vector_grid_sample)(const void* grid, double x, double y, double z, double* value);

// The density of a fog.
typedef double (*rapid_fog_sample)(const void* fog, double x, double y, double z);

// runtime/math/noise.h; curl: shape [3].
typedef double (*rapid_noise)(double x, double y, double z, double time, double octaves, double seed);
typedef void (*rapid_curl_noise)(double x, double y, double z, double time, double octaves, double seed, double* curl);
