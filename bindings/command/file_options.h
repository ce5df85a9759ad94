// Options -o, --camera and --size for the files of a graph's frames.
#pragma once

#include <string>
#include <vector>

#include "bindings/command_line/command.h"
#include "include/rapid/run.h"

namespace rapid {

class FileOptions {
public:
    void declare(Options& options);

    const FileOutputs& files() const { return files_; }
    // Returns the -o as the user gave them.
    const std::vector<std::string>& names() const { return files_.outputs; }
    // Returns true if one is a film, which a separate program writes. Throws Error if the format is unknown.
    bool makes_films() const;

private:
    FileOutputs files_;
};

}  // namespace rapid
