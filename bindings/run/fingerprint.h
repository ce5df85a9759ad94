// The inputs that determine a run's frames, by name: Rapid's version, parameters, seeds, nodes and their arguments, the
// code of all functions, the content of the files that are read. Runs with equal fingerprints are bit-identical.
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

// options: further options of the command that change the run's data, by name.
Fingerprint fingerprint_of(const Session& session, const Plan& plan, const std::filesystem::path& graph,
                           const Fingerprint& options);

std::string hash_of(const Fingerprint& fingerprint);

std::vector<std::string> differences(const Fingerprint& was, const Fingerprint& is);

// The contents of the files that a run reads.
class InputContents {
public:
    // Code is left out if its effects are known otherwise.
    enum class Code { Included, Excluded };

    // folder: of the graph, to which names are relative.
    InputContents(std::filesystem::path folder, Code code) : folder_(std::move(folder)), code_(code) {}

    // Called before the file is read, from any thread.
    void add(const std::filesystem::path& file);
    // Returns the contents since the last call, by name.
    Fingerprint take();
    // Returns the same for a file that another run has read: "" if it does not exist.
    std::string content_of(const std::string& name) const;

    static bool is_content(const std::string& name);

private:
    const std::filesystem::path folder_;
    const Code code_;
    std::mutex mutex_;
    Fingerprint known_, fresh_;
};

}  // namespace rapid
