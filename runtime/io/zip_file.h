// Zip files, by Minizip: written to an OutputFile as they grow, read from memory.
//
// Errors say what is wrong; who calls adds the file's name.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "runtime/files/output_file.h"

namespace rapid {

class ZipWriter {
public:
    explicit ZipWriter(OutputFile& file);
    ZipWriter(const ZipWriter&) = delete;
    ZipWriter& operator=(const ZipWriter&) = delete;
    ~ZipWriter();

    // Begins a member of so many bytes, which is stored as it is. Its time is the first that a zip file knows.
    void begin(const std::string& name, std::uint64_t bytes);
    void write(const void* data, std::size_t bytes);
    void end();
    // Writes the directory.
    void finish();

private:
    struct Archive;
    std::unique_ptr<Archive> archive_;
};

class ZipReader {
public:
    struct Member {
        std::string name;
        std::uint64_t position;  // in the directory
        std::uint64_t number;
        std::size_t bytes;
    };

    // `bytes` must outlive it. Error: no zip file; members that are encrypted, or hold more than the file can.
    explicit ZipReader(std::span<const unsigned char> bytes);
    ZipReader(const ZipReader&) = delete;
    ZipReader& operator=(const ZipReader&) = delete;
    ~ZipReader();

    const std::vector<Member>& members() const { return members_; }
    // Error: damage, which the checksum shows.
    std::vector<unsigned char> read(const Member& member);

private:
    struct Archive;
    std::unique_ptr<Archive> archive_;
    std::vector<Member> members_;
};

}  // namespace rapid
