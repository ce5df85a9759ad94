// A file that grows by pieces, each with a checksum: what a run has told so far, for the one that goes on behind it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string_view>

#include "runtime/files/file_error.h"

namespace rapid {

class PieceLog {
public:
    // A file that is there keeps what it has. Error: it can't be opened.
    explicit PieceLog(const std::filesystem::path& path);

    // Error: the file system's; then the log is as it was.
    void add(std::string_view piece);
    std::uint64_t bytes() const { return bytes_; }

    // Calls f for the pieces of the first so many bytes, in order. Error: they are not whole.
    void read(std::uint64_t bytes, const std::function<void(std::string_view piece)>& f) const;
    // The next piece comes behind the first so many bytes. What is there stays until then: a run that goes on behind an
    // earlier snapshot writes the same once more, of which a later one may know.
    void go_on_behind(std::uint64_t bytes) { bytes_ = bytes; }

private:
    Descriptor file_;
    std::uint64_t bytes_ = 0;
};

}  // namespace rapid
