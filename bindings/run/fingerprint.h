// What the frames of a run follow from, by name: Rapid's version, parameters, seeds, nodes and their arguments, the
// code of all functions, the content of the files that are read. Runs of equal fingerprints come to the same bits.
#pragma once

#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "bindings/host/session.h"
#include "runtime/graph/plan.h"

namespace rapid {

using Fingerprint = std::map<std::string, std::string>;

// options: further ones of the command that change what a run keeps, by name.
Fingerprint fingerprint_of(const Session& session, const Plan& plan, const std::filesystem::path& graph,
                           const Fingerprint& options);

std::string hash_of(const Fingerprint& fingerprint);

// "rate was 20000, is 30000"; "the function in line 12 of scene.lua is another one"; empty where nothing differs.
// Entries for settings, named as the command's options in the files of any program.
constexpr char seed_entry[] = "--seed", part_entry[] = "--part", sample_entry[] = "--sample",
               events_entry[] = "--events";

// What a message calls an entry.
std::string name_in_message(const std::string& name);
std::vector<std::string> differences(const Fingerprint& was, const Fingerprint& is);

// The contents of the files that a run reads.
class InputContents {
public:
    // With those of its code, or without: what that does may be known besides.
    enum class Code { Included, LeftOut };

    // folder: of the graph, from which names are told.
    InputContents(std::filesystem::path folder, Code code) : folder_(std::move(folder)), code_(code) {}

    // Before the file is read; from any thread.
    void add(const std::filesystem::path& file);
    // Those since the last call, by name.
    Fingerprint take();
    // The same of a file that another run has read: "" where it is not there.
    std::string content_of(const std::string& name) const;

    static bool is_content(const std::string& name);

private:
    const std::filesystem::path folder_;
    const Code code_;
    std::mutex mutex_;
    Fingerprint known_, fresh_;
};

}  // namespace rapid
