// -o, --camera, --size: the files of a graph's frames.
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
    // The -o as the user gave them.
    const std::vector<std::string>& names() const { return files_.outputs; }
    // Whether one is a film, which a program of its own writes. Error: an unknown format.
    bool makes_films() const;

private:
    FileOutputs files_;
};

}  // namespace rapid
