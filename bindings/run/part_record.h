// What a part of a run is: a small JSON file beside its frames, by which `rapid merge` knows that parts belong
// together.
//
//   sparks_part03of16.####.vdb has sparks_part03of16.vdb.json
//
// It is written when the part is complete, and removed when it begins again: a part without one is not complete.
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
    // A file that the part has written: the number of its points, and the hash of its bytes.
    struct File {
        std::uint64_t points;
        std::string hash;
    };
    std::map<std::int64_t, File> files;  // by frame
    // What decides the bits of a run, by name: "rate", "--seed", "content of fog.vdb" (a hash).
    std::map<std::string, std::string> identity;

    // Adds the files that the run reads, and the version of Rapid.
    void identify(const std::map<std::string, std::string>& contents);

    // Error: the file can't be read, or is no such record.
    static PartRecord read(const std::filesystem::path& file);
    void write(const std::filesystem::path& file) const;
};

// "rate is 2000 there and 3000 here" for each that differs; empty where nothing does.
std::string difference(const PartRecord& there, const PartRecord& here);

// The record of a sequence, or of a file: by its pattern with the part's name.
std::filesystem::path part_record_file(const std::string& pattern, std::string_view output = "main");

}  // namespace rapid
