// Files of a SavedState, as used by a run's cache. Contents in file order, with numbers in the machine's format:
//
//   "\x89RAPID\r\n"   identifies the file
//   8 bytes           length of the header
//   the header        JSON: fields of the writer, "format", and "blocks", each with "type", "values" and
//                     "pieces", which are sizes in bytes
//   the blocks        the bytes of the state, then its columns, in pieces of a megabyte, compressed by Blosc if that
//                     makes them smaller
//   8 bytes           XXH3 of everything before
//
// The checksum detects damage but does not protect from malice. The owner of a state checks its contents
// (points/state_archive.h).
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "runtime/base/json.h"
#include "runtime/files/input_file.h"
#include "runtime/points/saved_state.h"

namespace rapid {

// The "format" that this version writes, and the only one that it reads.
inline constexpr int state_format = 5;

// Compresses on all threads. `header` is an object. Throws Error if the file can't be written.
void write_state(const std::filesystem::path& path, CheckedJson header, const SavedState& state);
// Returns the same file as a string.
std::string text_of_state(CheckedJson header, const SavedState& state);

class StateFile {
public:
    // Reads and checks the whole file. Throws Error if it can't be read, is not a state file, or is truncated or
    // damaged.
    explicit StateFile(const std::filesystem::path& path) : StateFile(Content{InputFile(path), {}}) {}
    // Reads a string from text_of_state().
    static StateFile in_memory(std::string text) { return StateFile(Content{{}, std::move(text)}); }

    const CheckedJson& header() const { return header_; }
    std::uint64_t bytes() const { return text().size(); }
    // Decompresses on all threads. Throws Error if the file is damaged.
    SavedState state() const;

    // Returns true if the file begins like a state file and should be read as one.
    static bool is_one(const std::filesystem::path& path);

private:
    struct Content {
        std::optional<InputFile> file;
        std::string text;  // if there is no file
    };
    explicit StateFile(Content content);
    std::string_view text() const { return content_.file ? content_.file->text() : content_.text; }

    Content content_;
    CheckedJson header_;
    std::size_t blocks_at_ = 0;
};

}  // namespace rapid
