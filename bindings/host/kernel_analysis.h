// Analyses a kernel's effect on points, read from its bytecode (lua/bytecode.lua).
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "runtime/base/error.h"
#include "runtime/base/object.h"

struct lua_State;

namespace rapid {

class State;

// The first place where a function writes upvalues, globals or tables that outlive its call, read from the result of
// lua/bytecode.lua at the top of the stack.
class StoreOutside {
public:
    explicit StoreOutside(lua_State* L);

    // Throws Error if such a place exists.
    void refuse() const;

private:
    std::string message_;
    Location location_;
};

struct KernelAnalysis {
    std::set<std::string> reads, writes;        // of the point itself
    std::set<std::string> may, may_write;       // of values that may be the point
    std::map<std::string, Location> locations;  // first mention of each attribute of the point itself
    std::map<std::string, int> vectors;         // components assigned to an attribute: 3 or 4
    std::set<std::string> joins, queries;       // groups that it joins or leaves, and groups that it queries
    bool queries_any_group = false;             // queries groups by computed names
    bool kills = false;                         // may remove points
    bool reads_indices = false;                 // may read a point's index; a function of the whole set: reads points
};

struct KernelSource {
    std::size_t number = 0;           // the same in each state
    Location location;                // position of the function
    bool of_the_set = false;          // its first parameter is all points, not one (:detail)
    bool may_compute_groups = false;  // it belongs to a node whose parameters name groups
};

// Analyses a kernel in the main state, after the file has run. Throws Error if it writes state that points share,
// assigns a read-only attribute, or calls an unknown method.
KernelAnalysis analyse_kernel(State& state, const KernelSource& kernel);

// Returns the objects, except nodes, that the kernel reaches by its upvalues and globals. Nothing if it reaches more
// values than are looked at.
std::optional<std::vector<ObjectPtr>> objects_of(State& state, std::size_t kernel);

// Returns a fingerprint of its bytecode, the same in each state that has run the same file.
std::string fingerprint_of(State& state, std::size_t kernel);

}  // namespace rapid
