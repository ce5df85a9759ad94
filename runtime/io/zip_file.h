// Zip files through Minizip: written to an OutputFile as they grow, read from memory.
//
// Errors do not contain the file's name; the caller adds it.
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

    // Begins an uncompressed member of this size. Its time is the earliest that a zip file can store.
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

    // `bytes` must outlive it. Throws Error if this is not a zip file, or if members are encrypted or claim more than
    // the file can contain.
    explicit ZipReader(std::span<const unsigned char> bytes);
    ZipReader(const ZipReader&) = delete;
    ZipReader& operator=(const ZipReader&) = delete;
    ~ZipReader();

    const std::vector<Member>& members() const { return members_; }
    // Throws Error if the checksum shows damage.
    std::vector<unsigned char> read(const Member& member);

private:
    struct Archive;
    std::unique_ptr<Archive> archive_;
    std::vector<Member> members_;
};

}  // namespace rapid
