// What a kernel does to points, read from its bytecode (lua/bytecode.lua).
#pragma once

#include <cstddef>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "runtime/base/error.h"
#include "runtime/base/object.h"

struct lua_State;

namespace rapid {

class State;

// The first place where a function writes upvalues, globals or tables that outlive its call; it reads the result of
// lua/bytecode.lua at the top of the stack.
class StoreOutside {
public:
    explicit StoreOutside(lua_State* L);

    // Error: there is one.
    void refuse() const;

private:
    std::string message_;
    Location location_;
};

struct KernelAnalysis {
    std::set<std::string> reads, writes;      // of the point itself
    std::set<std::string> may, may_write;     // of values that may be the point
    std::map<std::string, Location> places;   // where it first names an attribute of the point itself
    std::map<std::string, int> vectors;       // components of what it assigns to an attribute: 3 or 4
    std::set<std::string> joins, asks;        // groups that it joins or leaves, and that it asks for
    bool asks_any = false;                    // for groups by computed names
    bool kills = false, asks_places = false;  // whether it may; a function of the whole set, whether it reads points
};

struct KernelSource {
    std::size_t number = 0;           // in each state
    Location location;                // of the function
    bool of_the_set = false;          // its first parameter is all points, not one (:detail)
    bool may_compute_groups = false;  // it belongs to a node whose parameters name groups
};

// In the main state, once the file has run. Error: it writes what other points share, assigns what is read only, or
// calls a method that there is not.
KernelAnalysis analyse_kernel(State& state, const KernelSource& kernel);

// The shapes that move, and the meshes, that the kernel reaches by its upvalues and globals.
std::vector<ObjectPtr> moving_shapes_of(State& state, std::size_t kernel);

// Of its bytecode: the same in each state that has run the same file.
std::string fingerprint_of(State& state, std::size_t kernel);

}  // namespace rapid
