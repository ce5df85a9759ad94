// Where Rapid's own files are: for programs that help to write scenes, and for those that confine themselves.
#pragma once

#include <string>

#include "include/rapid/scene.h"

namespace rapid {

// The folders of the Rapid that the program runs with.
struct Installation {
    // Modules, and nodes written in Lua. rapid.d.lua describes all that scenes are written with to Lua's language
    // server; new/ has what a scene begins with.
    std::string lua;
    std::string library;  // the library, and the part of it that is loaded when it is first needed

    // From any thread. Error: the files in Lua are not where they belong to.
    static Result<Installation> find();

    // Loads that part now, which reads and writes level sets, meshes and .vdb: for a program that then limits its
    // memory or the files that it may open. From any thread. Error: it is not there, or of another version.
    static Result<Done> load_all();
};

}  // namespace rapid
