// --cache, --cache-every and --again, of the commands that keep snapshots of runs.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "bindings/command_line/command.h"

namespace rapid {

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

}  // namespace rapid
