// Options -o, --camera and --size for the files of a graph's frames.
#pragma once

#include <cstdint>
#include <optional>
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

// --cache, --cache-every and --again, of the commands that keep snapshots of runs.
class CacheOptions {
public:
    // docs: the purposes of the folder and of --again.
    void declare(Options& options, const std::string& doc_of_folder, const std::string& doc_of_again);
    // Throws Error if --cache-every is given without --cache.
    void check() const;

    bool requested() const { return !folder_.empty(); }
    const std::string& folder() const { return folder_; }
    const std::optional<std::int64_t>& every() const { return every_; }
    bool again() const { return again_; }

private:
    std::string folder_;
    std::optional<std::int64_t> every_;
    bool again_ = false;
};

// Parses "NAME=A,B,C" of --sweep and --vary: a parameter and its values.
struct SweptSetting {
    std::string name;  // NODE.PARAM, or of a rapid.param
    std::vector<std::string> values;
};

// Commas within braces do not separate values: "wind={1,0,0},{2,0,0}" has two. Throws Error if the text does not have
// this form; the error names the option, and `names`, the kind of name that it takes.
SweptSetting read_swept_setting(const std::string& option, const std::string& text, const std::string& names);

}  // namespace rapid
