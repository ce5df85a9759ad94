// A folder private to this process, removed with all its contents.
#pragma once

#include <filesystem>
#include <string>

namespace rapid {

class TemporaryFolder {
public:
    // Creates the folder in the system's temporary folder. `purpose` is part of its name, and of the error if it can't
    // be created.
    explicit TemporaryFolder(const std::string& purpose);
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    const std::filesystem::path& path() const { return path_; }

private:
    std::filesystem::path path_;
};

}  // namespace rapid
