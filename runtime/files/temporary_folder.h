// A folder of this process alone, removed with all that is in it.
#pragma once

#include <filesystem>
#include <string>

namespace rapid {

class TemporaryFolder {
public:
    // Below the system's folder for such. `purpose` is a part of its name, and of the error that it can't be made.
    explicit TemporaryFolder(const std::string& purpose);
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    const std::filesystem::path& path() const { return path_; }

private:
    std::filesystem::path path_;
};

}  // namespace rapid
