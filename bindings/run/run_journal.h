// The journal of a folder of `--cache`: of which run it is, and a record of each frame that is complete. Entries are
// added while the run goes on; one that is torn or damaged is left out, and its frame is computed again.
//
//   "\x89RAPIDJ\n"                                 what the file is
//   8 bytes, 8 bytes, the entry; and so on         the length of the entry, and XXH3 of it
//
// The first entry is the fingerprint of the run, the others are records (frame_record.h) and films.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "bindings/run/frame_record.h"
#include "runtime/files/file_error.h"
#include "runtime/points/saved_state.h"

namespace rapid {

class RunJournal {
public:
    struct Contents {
        Fingerprint fingerprint;
        std::map<std::int64_t, FrameRecord> frames;
        std::map<std::string, WrittenFile> films;  // by path
        std::size_t damaged = 0;                   // entries
    };
    // Reads what is whole. Entries after the fingerprint are read only if `is_of_run` says so, as others may be those
    // of another version. Sets is_there to false if there is no journal.
    static Contents read(const std::filesystem::path& file, const std::function<bool(const Fingerprint&)>& is_of_run,
                         bool& is_there);

    // Writes these contents anew. Error: it can't be written.
    void begin(const std::filesystem::path& file, const Contents& contents);
    // Error: it can't be written; what was there stays.
    void add(const FrameRecord& record);
    void add(const WrittenFile& film);

private:
    void add(const SavedState& entry);

    Descriptor file_;
};

}  // namespace rapid
