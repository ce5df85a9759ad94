// Hashes of contents (XXH3). Equal bytes have equal hashes, in any process and on any machine.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

struct XXH3_state_s;

namespace rapid {

std::uint64_t content_hash(std::string_view bytes);

// The hash of bytes that arrive in pieces.
class ContentHash {
public:
    ContentHash();
    void add(const void* data, std::size_t bytes);
    std::uint64_t value() const;

private:
    struct Free {
        void operator()(XXH3_state_s* state) const;
    };
    std::unique_ptr<XXH3_state_s, Free> state_;
};

// Returns the hash of a file, which is read in pieces. Throws Error if it can't be read.
std::uint64_t file_hash(const std::filesystem::path& path);

// Returns 16 hexadecimal digits.
std::string hash_text(std::uint64_t hash);

}  // namespace rapid
