/* Rapid in C, and through it in any other language: scenes in Lua are opened, advanced, and read without a copy.
 * docs/host.md is the guide; rapid/scene.h is the same in C++, with more details on each function.
 *
 * Names are rapid_SUBJECT_VERB, like those of the class members in C++ and Python (docs/host.md has the table). A
 * function that can fail returns RAPID_OK or another status, with details in *error unless `error` is NULL: an object
 * that the caller frees with rapid_error_release(). After RAPID_OK *error is NULL. No function throws an exception or
 * ends the program.
 *
 * Handles (rapid_scene and the other types without a definition) are numbers in the form of pointers. One that is NULL,
 * already released, or of another type is an error, RAPID_WRONG_CALL. Getters that cannot fail return their value; for
 * such a handle, and for a scene that is in another call, they return 0, "" or NULL. Each handle that a function
 * returns must be released with rapid_SUBJECT_release(). Texts are UTF-8 and end with a zero; returned ones belong to
 * the handle that they come from.
 *
 * Structs begin with their size, which lets a newer library recognize the struct of an older program:
 *
 *     rapid_options options = rapid_default_options();
 *     rapid_column P = {sizeof P};
 *
 * Threads: a scene is used by one thread at a time, which may be another at each call; a second call meanwhile returns
 * RAPID_BUSY. rapid_scene_cancel() and all functions of frames and snapshots may be called from any thread at any time.
 * Different scenes run concurrently on different threads. Unless stated otherwise, callbacks are called on the thread
 * of the call that they belong to. They may not call the scene.
 */
#ifndef RAPID_RAPID_H
#define RAPID_RAPID_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#if defined(__cplusplus)
extern "C" {
#endif

#define RAPID_VERSION_MAJOR 1 /* of this header */
#define RAPID_VERSION_MINOR 0 /* of this header */

/* Statuses of functions. */
enum {
    RAPID_OK = 0,
    RAPID_WRONG_CALL = 1,   /* an argument, or a call at the wrong time; nothing has changed */
    RAPID_WRONG_SCENE = 2,  /* found before the first frame: Lua, a node's argument, a missing file */
    RAPID_FAILED_FRAME = 3, /* found while a frame was computed */
    RAPID_CANCELLED = 4,
    RAPID_TOO_LONG = 5,      /* a script took longer than script_seconds */
    RAPID_OUT_OF_MEMORY = 6, /* the system has no more, or a limit was reached */
    RAPID_BUSY = 7,          /* the scene is in another call */
    RAPID_UNEXPECTED = 8     /* from a library or a callback; the text is all that is known */
};

/* Handles. */
typedef struct rapid_error rapid_error;
typedef struct rapid_scene rapid_scene;
typedef struct rapid_frame rapid_frame;
typedef struct rapid_snapshot rapid_snapshot;
typedef struct rapid_offers rapid_offers;
typedef struct rapid_shapes rapid_shapes;
typedef struct rapid_run rapid_run;

/* "1.0.0", of the library. */
const char* rapid_version(void);

/* ---- Errors. */

const char* rapid_error_message(const rapid_error* error); /* the fault and the remedy */
const char* rapid_error_file(const rapid_error* error);    /* "" if there is none */
int rapid_error_line(const rapid_error* error);            /* from 1; 0 if there is none */
const char* rapid_error_node(const rapid_error* error);    /* "" if there is none */
const char* rapid_error_text(const rapid_error* error);    /* FILE:LINE: node "NAME": MESSAGE, as far as known */
/* The call stack of the script that raised it, one line per call, innermost first; "" if no script did. */
const char* rapid_error_script_stack(const rapid_error* error);
int rapid_error_kind(const rapid_error* error); /* RAPID_WRONG_CALL, ... */
void rapid_error_release(rapid_error* error);

/* ---- Values. */

/* Types of a value. */
enum { RAPID_NUMBER = 0, RAPID_BOOLEAN = 1, RAPID_TEXT = 2, RAPID_VEC3 = 3 };

/* A number, a boolean, a text or a vector. */
typedef struct rapid_value {
    int type;         /* RAPID_NUMBER, ... */
    double number[3]; /* RAPID_NUMBER: [0]; RAPID_BOOLEAN: [0] is 0 or 1; RAPID_VEC3: x y z */
    const char* text; /* RAPID_TEXT */
} rapid_value;

/* Types of a column. */
enum {
    RAPID_FLOAT = 0,
    RAPID_FLOAT_VEC3 = 1,
    RAPID_INT32 = 2,
    RAPID_INT64 = 3,
    RAPID_QUAT = 4,
    RAPID_UINT8 = 5,
    RAPID_STRING = 6 /* tokens of strings: rapid_frame_text_of() */
};

/* Values of one attribute, or members of a group (RAPID_UINT8, 0 or 1): shape [count][components], packed within a
 * point; the value of point i is at (const char*)data + i * stride. stride is 0 if all points share one value. */
typedef struct rapid_column {
    size_t size;       /* sizeof(rapid_column), set by the caller */
    const char* name;  /* of the attribute or group; belongs to the frame */
    int type;          /* RAPID_FLOAT, ... */
    size_t count;      /* of points */
    size_t components; /* 3 for RAPID_FLOAT_VEC3 (x y z), 4 for RAPID_QUAT (x y z w), else 1 */
    size_t stride;     /* bytes */
    const void* data;  /* float, int32_t, int64_t, uint8_t; for RAPID_STRING uint32_t, tokens */
} rapid_column;

/* ---- Scenes. */

/* Levels of a text for `log`. */
enum { RAPID_LOG_PRINT = 0, RAPID_LOG_WARNING = 1 };

/* A value for a parameter. */
typedef struct rapid_setting {
    const char* name;  /* a rapid.param, or NODE.PARAM: "solve.substeps" */
    rapid_value value; /* of the parameter's type */
} rapid_setting;

/* Options for opening and running a scene. Start from rapid_default_options() and change some. */
typedef struct rapid_options {
    size_t size;              /* sizeof(rapid_options) */
    const rapid_setting* set; /* values of parameters, by name or NODE.PARAM */
    size_t set_count;         /* of `set` */
    const uint64_t* seed;     /* replaces the seed of each create node, but no rapid.param "seed"; NULL: theirs */
    const char* const* paths; /* folders searched for modules and nodes in Lua */
    size_t path_count;        /* of `paths` */
    int threads;              /* 0: those of the caller's TBB arena; n: n threads of its own */
    double script_seconds;    /* limit for scripts, for each frame and for opening [600] */
    uint64_t script_memory;   /* bytes of Lua memory for each thread [1 GiB] */
    uint64_t memory;          /* bytes for the whole process; 0: the free memory */
    int estimate_errors;      /* 0: no estimates in the statistics [1] */
    int keep_all;             /* 1: prunes no attribute */
    void* user;               /* passed to the callbacks */
    /* Receives the output of scripts and Rapid's warnings. */
    void (*log)(void* user, int level, const char* text);
    /* Called after each frame of rapid_scene_advance_to(); 0 ends it with RAPID_CANCELLED. */
    int (*progress)(void* user, int64_t frame, int64_t last);
    /* Returns the text of the Lua module or node with this name, valid until the next call; NULL: search the
     * folders. */
    const char* (*find_module)(void* user, const char* name);
    /* Returns the path of a file that the scene names, valid until the next call; NULL: the usual one. */
    const char* (*find_file)(void* user, const char* path);
    rapid_offers* offers; /* the program's offers to the scene; NULL: none */
} rapid_options;

/* Returns the default options: those in brackets above, otherwise zeros. */
static inline rapid_options rapid_default_options(void)
{
    rapid_options options;
    memset(&options, 0, sizeof options);
    options.size = sizeof options;
    options.script_seconds = 600;
    options.script_memory = (uint64_t)1 << 30;
    options.estimate_errors = 1;
    return options;
}

/* Opens the scene of a file, or of a text with a name for messages. options: NULL for the defaults. *scene is NULL
 * on failure. */
int rapid_scene_open(const char* file, const rapid_options* options, rapid_scene** scene, rapid_error** error);
int rapid_scene_open_text(const char* name, const char* text, const rapid_options* options, rapid_scene** scene,
                          rapid_error** error);
/* Releases the scene. Its frames and snapshots stay valid. A running call continues to its end. */
int rapid_scene_release(rapid_scene* scene, rapid_error** error);

/* Loads node types from a library built against the runtime's headers (docs/extending.md), for scenes opened later
 * in the whole process. No other thread may open a scene meanwhile. */
int rapid_scene_load_plugin(const char* file, rapid_error** error);

/* A rapid.param of the scene. */
typedef struct rapid_parameter {
    size_t size;          /* sizeof(rapid_parameter), set by the caller */
    const char* name;     /* under which it is set */
    const char* doc;      /* as the scene gives it */
    rapid_value value;    /* with which the scene was run */
    rapid_value fallback; /* its default, of the same type */
} rapid_parameter;

/* Parameters are in the order in which the scene declares them. */
size_t rapid_scene_parameter_count(rapid_scene* scene);
/* The texts stay valid until the scene is set or released. */
int rapid_scene_parameter(rapid_scene* scene, size_t index, rapid_parameter* parameter, rapid_error** error);
/* Sets parameters, runs the scene's file again, and returns to the start. After an error the scene is unchanged. */
int rapid_scene_set(rapid_scene* scene, const rapid_setting* settings, size_t count, rapid_error** error);

/* A node of the scene. */
typedef struct rapid_node {
    size_t size;      /* sizeof(rapid_node), set by the caller */
    const char* name; /* the type's with a number, unless the scene gives one */
    const char* type; /* `:TYPE { ... }` */
    const char* file; /* where the scene makes it */
    int line;         /* of the file, from 1 */
} rapid_node;

/* Nodes are in the order in which the scene makes them; their texts stay valid until the scene is set or released. */
size_t rapid_scene_node_count(rapid_scene* scene);
int rapid_scene_node(rapid_scene* scene, size_t index, rapid_node* node, rapid_error** error);
/* Returns all node types that a scene of this program may use, as JSON: [{"name", "doc", "parameters": [{"name",
 * "type", "unit", "doc", "default", "required"}]}]. The text belongs to the scene, until the next call of this
 * function. */
int rapid_scene_node_types(rapid_scene* scene, const char** json, rapid_error** error);
/* Returns the warnings of opening, one per line. The text belongs to the scene, until the next call of this
 * function. */
int rapid_scene_warnings(rapid_scene* scene, const char** text, rapid_error** error);

/* Returns the frame rate of the plan's first create node. */
double rapid_scene_fps(rapid_scene* scene);
/* Return the number of the scene's first frame, and of the one that rapid_scene_advance() computes. */
int64_t rapid_scene_first_frame(rapid_scene* scene);
int64_t rapid_scene_next_frame(rapid_scene* scene);
/* Computes the next frame, or all up to one. *frame must be released; frame == NULL: it is not needed. After an
 * error the scene has no next frame until it is restarted, restored or set. */
int rapid_scene_advance(rapid_scene* scene, rapid_frame** frame, rapid_error** error);
int rapid_scene_advance_to(rapid_scene* scene, int64_t number, rapid_frame** frame, rapid_error** error);
int rapid_scene_restart(rapid_scene* scene, rapid_error** error);
/* Ends the advance, trace or points_after that is running, or else the next one, with RAPID_CANCELLED. From any
 * thread.
 */
int rapid_scene_cancel(rapid_scene* scene, rapid_error** error);

/* Saves and restores the complete state, after at least one frame. Frames after a restore are bit-identical to those
 * after the save. */
int rapid_scene_save(rapid_scene* scene, rapid_snapshot** snapshot, rapid_error** error);
int rapid_scene_restore(rapid_scene* scene, rapid_snapshot* snapshot, rapid_error** error);
int64_t rapid_snapshot_frame(rapid_snapshot* snapshot); /* the last one computed before it was taken */
uint64_t rapid_snapshot_size(rapid_snapshot* snapshot); /* bytes */
/* Writes a file, which gets its name when it is complete, or reads one written by this build of Rapid. *snapshot
 * must be released. */
int rapid_snapshot_write(rapid_snapshot* snapshot, const char* path, rapid_error** error);
int rapid_snapshot_read(const char* path, rapid_snapshot** snapshot, rapid_error** error);
int rapid_snapshot_release(rapid_snapshot* snapshot, rapid_error** error);

/* Returns what the scene's plan keeps and prunes, and why: an object, as printed by `rapid explain --json`. It
 * belongs to the scene, until the next call of this function. */
int rapid_scene_explain(rapid_scene* scene, const char** json, rapid_error** error);
/* Returns the points as they leave a node in a frame, as a frame whose only output has the node's name. Goes to the
 * start, and computes the frames up to this one separately; afterwards the scene is at its start. *frame must be
 * released. */
int rapid_scene_points_after(rapid_scene* scene, const char* node, int64_t number, rapid_frame** frame,
                             rapid_error** error);
/* Forms of a graph: in Graphviz's language; as a picture; as nodes and edges with their positions, an object, as
 * written by `rapid graph -o FILE.json`. */
enum { RAPID_GRAPH_DOT = 0, RAPID_GRAPH_SVG = 1, RAPID_GRAPH_JSON = 2 };
/* Returns the graph of the scene: form = RAPID_GRAPH_DOT, ... The other forms need Graphviz's program `dot`. *text
 * belongs to the scene, until the next call of this function. */
int rapid_scene_graph(rapid_scene* scene, int form, const char** text, rapid_error** error);
/* Traces the lives of points: births, changes by each node, forces, contacts, deaths and their causes, in the frames
 * from `first` to `last`. ids: shape [count]. create: the name of the node that makes them; NULL: each. Returns to
 * the start and computes the frames separately; afterwards the scene is at its start. *json is a list, as printed by
 * `rapid trace --json`. After RAPID_FAILED_FRAME, RAPID_TOO_LONG and RAPID_OUT_OF_MEMORY of a frame it has the lives
 * up to then. It belongs to the scene, until the next call of this function. */
int rapid_scene_trace(rapid_scene* scene, const int64_t* ids, size_t count, const char* create, int64_t first,
                      int64_t last, const char** json, rapid_error** error);

/* ---- Offers of a program to its scenes: meshes, points and shapes, which scenes take as rapid.host "NAME" (a setting
 * "host:NAME" assigns one to a parameter of a node), and nodes. Arrays are copied.
 *
 * Callbacks get arrays of points, never a single point, from any thread, several at once, unless stated otherwise. They
 * return 0; anything else is an error of the frame. Their output must be finite. */

int rapid_offers_new(rapid_offers** offers, rapid_error** error);
/* guard = 1: detects callbacks that write past the ends of their arrays. Call it before anything is offered. */
int rapid_offers_guard(rapid_offers* offers, int guard, rapid_error** error);
/* Calls release(user) once, from any thread, when the offers are released and no scene uses their callbacks any
 * more. */
int rapid_offers_on_release(rapid_offers* offers, void (*release)(void* user), void* user, rapid_error** error);
/* positions: shape [count][3], m; triangles: shape [triangle_count][3], counter-clockwise seen from outside. If the mesh
 * is offered again for each frame, it moves (rapid_scene_offer()). */
int rapid_offers_mesh(rapid_offers* offers, const char* name, const float* positions, size_t count,
                      const int32_t* triangles, size_t triangle_count, rapid_error** error);
/* Reads name, type, data and stride (0: packed) of each column; one must be "P". */
int rapid_offers_points(rapid_offers* offers, const char* name, size_t count, const rapid_column* columns,
                        size_t column_count, rapid_error** error);

/* A shape given by its signed distance, for :collide, :attract, :spring and kernels. */
typedef struct rapid_shape {
    size_t size;               /* sizeof(rapid_shape) */
    double lower[3], upper[3]; /* bounds, m, which may be infinite: outside of them the distance is positive */
    /* phi, shape [n]: the distance at each position of P, shape [n][3], negative inside. gradient, shape [n][3] or
     * NULL: the gradient of the distance, out of the shape; zero if it does not exist. */
    int (*distance)(void* user, size_t n, const double* P, double* phi, double* gradient);
    void* user;              /* passed to `distance` */
    double slope_bound;      /* the largest slope of the distance; 0 stands for 1, an exact distance */
    double smallest_feature; /* m: a wall thinner than this may be missed; 0: the shape is convex */
} rapid_shape;
/* The struct is copied; the callback is called as long as a scene has the shape. */
int rapid_offers_shape(rapid_offers* offers, const char* name, const rapid_shape* shape, rapid_error** error);

/* The points that a node's callback processes. */
typedef struct rapid_call {
    size_t count;              /* of points */
    double frame, time, dt;    /* number; s since the start; s, of a frame */
    const double* parameters;  /* in the order of the declaration; a vector is three numbers */
    const double* P;           /* for a force: shape [count][3], m, in the middle of a substep */
    const double* v;           /* m/s */
    double* acceleration;      /* m/s^2, initially zero */
    const float* const* reads; /* columns, in the order of the declaration, shape [count][1 or 3] */
    float* const* writes;      /* for an edit, with their values */
    uint8_t* kill;             /* for an edit: initially 0; points with 1 are removed afterwards */
    const int64_t* id;         /* for a constraint, with P at the frame's beginning */
    void* rods;                /* for a constraint: for rapid_call_add_rod() */
} rapid_call;

/* Adds a rod of a constraint, which keeps two points, by id, at a length, m, in this frame; compliance in m/N, 0:
 * rigid. */
int rapid_call_add_rod(const rapid_call* call, int64_t a, int64_t b, double length, double compliance,
                       rapid_error** error);

/* A parameter of a program's node. */
typedef struct rapid_node_parameter {
    const char* name;     /* in the table of arguments */
    const char* doc;      /* a sentence */
    const char* unit;     /* may be NULL */
    rapid_value fallback; /* RAPID_NUMBER or RAPID_VEC3 */
} rapid_node_parameter;

/* A column that a node reads or writes. */
typedef struct rapid_node_column {
    const char* name; /* of the attribute */
    int type;         /* RAPID_FLOAT or RAPID_FLOAT_VEC3 */
} rapid_node_column;

/* Kinds of nodes. */
enum { RAPID_FORCE = 0, RAPID_EDIT = 1, RAPID_CONSTRAINT = 2 };

/* A node of the program. In Lua it is used like any other: `:magnet { strength = 3 }`. */
typedef struct rapid_node_type {
    size_t size;      /* sizeof(rapid_node_type) */
    const char* name; /* an identifier in Lua */
    const char* doc;  /* a sentence */
    /* RAPID_FORCE: called for chunks of points, in each substep; RAPID_EDIT, RAPID_CONSTRAINT: once a frame, for all
     * points, on the scene's thread */
    int kind;
    const rapid_node_parameter* parameters;          /* besides `group` */
    size_t parameter_count;                          /* of `parameters` */
    const rapid_node_column* reads;                  /* passed to each call */
    size_t read_count;                               /* of `reads` */
    const rapid_node_column* writes;                 /* for an edit; P and v by these names */
    size_t write_count;                              /* of `writes` */
    int (*call)(void* user, const rapid_call* call); /* returns 0, or else the frame fails */
    void* user;                                      /* passed to `call` */
} rapid_node_type;
/* Texts and arrays are copied. */
int rapid_offers_node(rapid_offers* offers, const rapid_node_type* type, rapid_error** error);

/* Replaces or adds the objects of `offers`. Functions of the frame that use rapid.host "NAME" get them from the next
 * frame on, everything else when the scene's file is run again (rapid_scene_set()).
 *
 * A mesh with as many positions and the same triangles as that of the frame before moves from there through the frame,
 * like the last file of a sequence of meshes: points are born along its path with its velocity, and as a collider it
 * sweeps points along. With other triangles it is at rest in this frame, with a warning. In a frame without an offer,
 * and after rapid_scene_restart() and rapid_scene_set(), the last mesh is at rest; a snapshot holds the last meshes. */
int rapid_scene_offer(rapid_scene* scene, rapid_offers* offers, rapid_error** error);
/* Releases the offers. Scenes retain the objects offered to them. */
int rapid_offers_release(rapid_offers* offers, rapid_error** error);

/* ---- Frames. Pointers into a frame stay valid and its data unchanged until it is released, even if the scene is
 * not. */

/* The other outputs of the frame are separate frames that share its memory. *frame must be released. */
int rapid_frame_output(rapid_frame* of, const char* name, rapid_frame** frame, rapid_error** error);
/* Return names, one per line, which belong to the frame: of the scene's outputs; of this output's columns, groups
 * and detail values. */
int rapid_frame_outputs(rapid_frame* frame, const char** lines, rapid_error** error);
int rapid_frame_columns(rapid_frame* frame, const char** lines, rapid_error** error);
int rapid_frame_groups(rapid_frame* frame, const char** lines, rapid_error** error);
int rapid_frame_details(rapid_frame* frame, const char** lines, rapid_error** error);
/* Returns the warnings of nodes in this frame, one per line. */
int rapid_frame_warnings(rapid_frame* frame, const char** lines, rapid_error** error);

/* The number of the frame. */
int64_t rapid_frame_number(rapid_frame* frame);
double rapid_frame_time(rapid_frame* frame); /* s since the start of the output's simulation */
double rapid_frame_fps(rapid_frame* frame);  /* of the output's simulation */
size_t rapid_frame_size(rapid_frame* frame); /* points of this output */

/* The most requested statistics of a frame; rapid_frame_statistics_json() has all. */
typedef struct rapid_statistics {
    size_t size;                                   /* sizeof(rapid_statistics), set by the caller */
    uint64_t points;                               /* of all outputs */
    uint64_t born, died, collisions;               /* in this frame */
    int substeps;                                  /* the maximum of all Solve nodes */
    int has_errors;                                /* 1 if the next three were estimated */
    double error_p50, error_p95, error_max;        /* m, of positions, accumulated since birth */
    double penetration_max;                        /* m */
    double constraint_residual_max;                /* m */
    double seconds, script_seconds, solve_seconds; /* wall time: total, and of parts */
} rapid_statistics;
/* Fills in the figures of the frame. */
int rapid_frame_statistics(rapid_frame* frame, rapid_statistics* statistics, rapid_error** error);
/* Returns the frame's object in the file of `rapid run --stats`. */
int rapid_frame_statistics_json(rapid_frame* frame, const char** json, rapid_error** error);

/* Returns the time of each pass over the points: a list in order, with "nodes", "stage" ("graph", "script",
 * "solve"), "begin" and "seconds" since the frame's beginning, "points" and "bytes" of the result. */
int rapid_frame_profile_json(rapid_frame* frame, const char** json, rapid_error** error);

/* Strings of attributes are stored as tokens: in a process, equal strings have equal tokens, in no order, and 0 is
 * the empty string. Tokens and their texts stay valid. Callable from any thread. */
int rapid_frame_text_of(uint32_t token, const char** text, rapid_error** error);
int rapid_frame_token_of(const char* text, uint32_t* token, rapid_error** error);

/* Return an attribute or a group, whose memory belongs to the frame. This takes some nanoseconds for any number of
 * points. */
int rapid_frame_column(rapid_frame* frame, const char* name, rapid_column* column, rapid_error** error);
int rapid_frame_group(rapid_frame* frame, const char* name, rapid_column* column, rapid_error** error);
/* Does the same as rapid_frame_column(), but writes out a value that all points share, so that stride is never 0. */
int rapid_frame_expanded(rapid_frame* frame, const char* name, rapid_column* column, rapid_error** error);
/* Returns the indices of the points with these ids in the columns, shape [count]; UINT32_MAX for an unknown id. */
int rapid_frame_indices(rapid_frame* frame, const int64_t* ids, size_t count, uint32_t* indices, rapid_error** error);
/* Returns a value of the whole set (:detail). */
int rapid_frame_detail(rapid_frame* frame, const char* name, rapid_value* value, rapid_error** error);

/* Writes a file in a format that Rapid knows, by the extension. */
int rapid_frame_write(rapid_frame* frame, const char* path, rapid_error** error);
/* Reads the points of such a file as a frame with number and time 0. rapid_frame_warnings() lists the file's other
 * contents. *frame must be released. */
int rapid_frame_read(const char* path, rapid_frame** frame, rapid_error** error);
/* Describes the number of points, their bounds, the range of each attribute, and the groups: an object, like that of
 * `rapid info --json`. It belongs to the frame, until it is described again. */
int rapid_frame_describe(rapid_frame* frame, const char** json, rapid_error** error);
/* Compares the points of two frames by id: *same is 1 if positions differ by at most `tolerance` times the diagonal
 * of the bounds of both, other floats relatively, and everything else is equal. *json is an object, like that of
 * `rapid diff --json`, and belongs to `frame`, until it is compared again. Either may be NULL. */
int rapid_frame_compare(rapid_frame* frame, rapid_frame* with, double tolerance, int* same, const char** json,
                        rapid_error** error);
int rapid_frame_release(rapid_frame* frame, rapid_error** error);

/* ---- Shapes of a scene in a frame: those that its points collide with or are born from, and the look of its
 * pictures. Pointers stay valid until the shapes are released. Callable from any thread. */

/* *shapes must be released. The frame need not be computed. */
int rapid_scene_shapes(rapid_scene* scene, int64_t number, rapid_shapes** shapes, rapid_error** error);

/* Roles of a shape for the points. */
enum { RAPID_COLLIDER = 0, RAPID_EMITTER = 1 };

/* A triangle mesh in world space: one of the scene, or the surface of a level set. A shape at rest has the same
 * arrays in all frames. */
typedef struct rapid_mesh {
    size_t size;              /* sizeof(rapid_mesh), set by the caller */
    int role;                 /* RAPID_COLLIDER, ... */
    size_t corner_count;      /* of positions */
    const float* positions;   /* shape [corner_count][3], m */
    size_t triangle_count;    /* of triangles */
    const int32_t* triangles; /* shape [triangle_count][3], counter-clockwise seen from outside; from 0 */
} rapid_mesh;

/* An infinite plane. */
typedef struct rapid_plane {
    size_t size;      /* sizeof(rapid_plane), set by the caller */
    double normal[3]; /* unit length, out of the shape */
    double offset;    /* m; its points have normal . x = offset */
} rapid_plane;

/* Both are in the order of the nodes; infinite shapes other than planes are omitted. */
size_t rapid_shapes_mesh_count(rapid_shapes* shapes);
int rapid_shapes_mesh(rapid_shapes* shapes, size_t index, rapid_mesh* mesh, rapid_error** error);
size_t rapid_shapes_plane_count(rapid_shapes* shapes);
int rapid_shapes_plane(rapid_shapes* shapes, size_t index, rapid_plane* plane, rapid_error** error);
/* Returns 1 if the scene sets the camera of its pictures. */
int rapid_shapes_has_camera(rapid_shapes* shapes);
/* Returns the warnings of making them, such as a mesh with holes, one per line. */
int rapid_shapes_warnings(rapid_shapes* shapes, const char** lines, rapid_error** error);
int rapid_shapes_release(rapid_shapes* shapes, rapid_error** error);

/* The camera of a picture. NULL or 0 means that a value is fitted. */
typedef struct rapid_camera {
    const double* position; /* shape [3], m */
    const double* target;   /* shape [3], m */
    double fov;             /* degrees, from the lower to the upper edge; below 180 */
} rapid_camera;

/* Returns the bytes of a .png of a frame with shapes. camera: NULL to fit everything. The bytes belong to the frame
 * until the next picture. */
int rapid_frame_picture(rapid_frame* frame, rapid_shapes* shapes, const rapid_camera* camera, int width, int height,
                        const void** png, size_t* bytes, rapid_error** error);
/* Does the same with the shapes of the frame in its scene. */
int rapid_scene_picture(rapid_scene* scene, rapid_frame* frame, int width, int height, const void** png, size_t* bytes,
                        rapid_error** error);

/* ---- Runs that write files, as `rapid run` does. */

/* Every step-th frame from the first one to the last. */
typedef struct rapid_frames {
    int64_t first; /* the number of the first frame */
    int64_t last;  /* the last frame that is included */
    int64_t step;  /* the distance between two frames, at least 1 */
} rapid_frames;

/* How a run ended. */
enum { RAPID_COMPLETE = 0, RAPID_ENDED = 1, RAPID_FAILED = 2 };

/* Options of a run. Start from rapid_default_run_options() and change some. */
typedef struct rapid_run_options {
    size_t size;                /* sizeof(rapid_run_options) */
    const char* text;           /* text of the scene, whose file is then only a name for messages; NULL: the file's */
    const rapid_frames* frames; /* frames to write; NULL: 48 from the first */
    /* PATTERN or PATTERN:ATTRIBUTE,ATTRIBUTE, where #### is the frame's number and {output} the name of an output of
     * the scene; the extension selects the format (docs/cli.md). */
    const char* const* outputs;
    size_t output_count;    /* of `outputs` */
    int width, height;      /* of pictures [1280 x 720] */
    rapid_camera camera;    /* of pictures */
    const char* statistics; /* a file of JSON; NULL: none, as for those below */
    const char* profile;    /* a trace in Chrome's format */
    const char* events;     /* births, contacts and deaths as points */
    const char* cache;      /* a folder from which a run continues an earlier one */
    int64_t cache_every;    /* a snapshot after every n-th frame, and after the last; 0: none [10] */
    int cache_again;        /* 1: computes and writes all frames, regardless of the cache */
    int cache_replace;      /* 1: replaces the cache of another run, which otherwise is an error */
    int part, part_count;   /* one of the subsets of the points, from 1; 0: all */
    double sample;          /* the fraction of the points, above 0 and at most 1 [1] */
    void* user;             /* passed to the callbacks, which may be NULL, on the thread of the call */
    /* Called after each frame. is_known: it is from a cache, and was not computed again. */
    void (*frame)(void* user, int64_t number, uint64_t points, double seconds, int is_known);
    void (*line)(void* user, const char* text);    /* the files written, the contents of a cache */
    void (*warning)(void* user, const char* text); /* each once; with its number if it is of a frame */
} rapid_run_options;

/* Returns the default options: those in brackets above, otherwise zeros. */
static inline rapid_run_options rapid_default_run_options(void)
{
    rapid_run_options options;
    memset(&options, 0, sizeof options);
    options.size = sizeof options;
    options.width = 1280;
    options.height = 720;
    options.cache_every = 10;
    options.sample = 1;
    return options;
}

/* The outcome of a run. */
typedef struct rapid_outcome {
    size_t size;           /* sizeof(rapid_outcome), set by the caller */
    int ending;            /* RAPID_COMPLETE; RAPID_ENDED by rapid_run_end_after_frame(); RAPID_FAILED in a frame */
    int64_t last_frame;    /* the last one computed or known */
    const char* unwritten; /* statistics or a profile that could not be written, and why, one per line */
    const char* summary;   /* for RAPID_COMPLETE: the summary that `rapid run` prints, several lines */
} rapid_outcome;

/* Makes a run; nothing is opened yet. A run is used by one thread at a time, except rapid_run_end_after_frame() and
 * rapid_run_cancel(). options: NULL for the defaults. *run must be released. */
int rapid_run_make(const char* file, const rapid_options* scene, const rapid_run_options* options, rapid_run** run,
                   rapid_error** error);
/* Opens and plans the scene, and checks the names of files; once. */
int rapid_run_prepare(rapid_run* run, rapid_error** error);
int64_t rapid_run_first_frame(rapid_run* run); /* of the scene, after rapid_run_prepare() */
/* Returns the frames to write, after rapid_run_prepare(). */
int rapid_run_frames(rapid_run* run, rapid_frames* frames, rapid_error** error);
/* Computes and writes the frames; once. *outcome, whose texts belong to the run, is also set after the error of a
 * frame. */
int rapid_run_run(rapid_run* run, rapid_outcome* outcome, rapid_error** error);
/* Ends the run after the current frame, with a snapshot if it has a cache; or at once. Callable from any thread. */
int rapid_run_end_after_frame(rapid_run* run, rapid_error** error);
int rapid_run_cancel(rapid_run* run, rapid_error** error);
/* Releases the run. A running call continues to its end. */
int rapid_run_release(rapid_run* run, rapid_error** error);

/* The result of rapid_merge_files(). */
typedef struct rapid_merged {
    size_t size;          /* sizeof(rapid_merged), set by the caller */
    size_t parts, frames; /* read, of each part; written */
    uint64_t points;      /* of all frames */
} rapid_merged;

/* Merges the files of the parts of a run, as the whole run would have written them (docs/scale.md). parts: patterns
 * of the files of each part, shape [count]; {part} stands for all parts. progress, which may be NULL, is called with
 * each frame; 0 ends the merge with RAPID_CANCELLED. *merged: may be NULL. Meanwhile no scene may run. */
int rapid_merge_files(const char* const* parts, size_t count, const char* output,
                      int (*progress)(void* user, int64_t frame, uint64_t points), void* user, rapid_merged* merged,
                      rapid_error** error);

#if defined(__cplusplus)
}
#endif

#endif
