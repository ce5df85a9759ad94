// Locates Rapid's own files, for programs that help to write scenes and for those that confine themselves.
#pragma once

#include <string>

#include "include/rapid/scene.h"

namespace rapid {

// Folders of the installation with which the program runs.
struct Installation {
    // Modules, and nodes written in Lua. rapid.d.lua describes the graph language to Lua's language server; new/ has
    // templates for new scenes.
    std::string lua;
    std::string library;  // the library, and its part that is loaded on first use

    // Callable from any thread. Fails if the Lua files are missing.
    static Result<Installation> find();

    // Loads the deferred part now, which reads and writes level sets, meshes and .vdb. For a program that then limits
    // its memory or the files that it may open. Callable from any thread. Fails if the part is missing or of another
    // version.
    static Result<Done> load_all();
};

}  // namespace rapid
