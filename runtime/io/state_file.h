// Files of a SavedState, as a cache of a run holds them. In the order of the file, numbers as the machine has them:
//
//   "\x89RAPID\r\n"    what the file is
//   8 bytes            the length of the header
//   the header         JSON: what its writer says of it, "format", and "blocks": each with "type", "values" and
//                      "pieces", their sizes in bytes
//   the blocks         the bytes of the state, then its columns, in pieces of a megabyte, which Blosc has compressed
//                      where that makes them smaller
//   8 bytes            XXH3 of all that is before
//
// The checksum finds damage. It is no protection from those who mean harm: what is in a state is checked by whose it is
// (points/state_archive.h).
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "runtime/checked_json.h"
#include "runtime/files/input_file.h"
#include "runtime/points/saved_state.h"

namespace rapid {

// The "format" of the files that this Rapid writes, and of those that it reads.
inline constexpr int state_format = 5;

// Compresses on all threads. `header` is an object. Throws Error if the file can't be written.
void write_state(const std::filesystem::path& path, CheckedJson header, const SavedState& state);
// The same file in memory.
std::string text_of_state(CheckedJson header, const SavedState& state);

class StateFile {
public:
    // Reads and checks the whole file. Error: it can't be read; it is no such file, torn or damaged.
    explicit StateFile(const std::filesystem::path& path) : StateFile(Content{InputFile(path), {}}) {}
    // The same of what text_of_state() has returned.
    static StateFile in_memory(std::string text) { return StateFile(Content{{}, std::move(text)}); }

    const CheckedJson& header() const { return header_; }
    std::uint64_t bytes() const { return text().size(); }
    // Decompresses, on all threads. Error: it is damaged.
    SavedState state() const;

    // Whether the file begins as one, and so is to be read as one.
    static bool is_one(const std::filesystem::path& path);

private:
    struct Content {
        std::optional<InputFile> file;
        std::string text;  // without a file
    };
    explicit StateFile(Content content);
    std::string_view text() const { return content_.file ? content_.file->text() : content_.text; }

    Content content_;
    CheckedJson header_;
    std::size_t blocks_at_ = 0;
};

}  // namespace rapid
