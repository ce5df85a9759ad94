// The record of a part of a run: a small JSON file next to its frames, by which `rapid merge` recognizes parts that
// belong together.
//
//   sparks_part03of16.####.vdb has sparks_part03of16.vdb.json
//
// It is written when the part is complete, and removed when the part starts again: a part without a record is not
// complete.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "include/rapid/run.h"

namespace rapid {

struct PartRecord {
    RunPart part;
    std::optional<double> sample;
    RunFrames frames;
    double fps = 24;         // of the output's simulation
    std::int64_t start = 1;  // likewise: its first frame
    // A file written by the part: its number of points, and the hash of its bytes.
    struct File {
        std::uint64_t points;
        std::string hash;
    };
    std::map<std::int64_t, File> files;  // by frame
    // Inputs that determine a run's result, by name: "rate", "--seed", "content of fog.vdb" (a hash).
    std::map<std::string, std::string> identity;

    // Adds the files that the run reads, and the version of Rapid.
    void identify(const std::map<std::string, std::string>& contents);

    // Throws Error if the file cannot be read, or is not such a record.
    static PartRecord read(const std::filesystem::path& file);
    void write(const std::filesystem::path& file) const;
};

// Returns "rate is 2000 there and 3000 here" for each difference; empty if there is none.
std::string difference(const PartRecord& there, const PartRecord& here);

// Returns the record's file for a sequence or a file, by its pattern with the part's name.
std::filesystem::path part_record_file(const std::string& pattern, std::string_view output = "main");

// Entries for settings, with the command's option names in the files of any program.
constexpr char seed_entry[] = "--seed", part_entry[] = "--part", sample_entry[] = "--sample",
               events_entry[] = "--events";

// Returns the name of an entry in messages.
std::string name_in_message(const std::string& name);

}  // namespace rapid
