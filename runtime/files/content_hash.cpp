#include "runtime/files/content_hash.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>
#include <xxhash.h>

#include <cerrno>
#include <new>

#include "runtime/files/file_error.h"
#include "runtime/files/input_file.h"

namespace rapid {

std::uint64_t content_hash(std::string_view bytes) { return XXH3_64bits(bytes.data(), bytes.size()); }

ContentHash::ContentHash() : state_(XXH3_createState())
{
    if (!state_) throw std::bad_alloc();
    XXH3_64bits_reset(state_.get());
}

void ContentHash::add(const void* data, std::size_t bytes) { XXH3_64bits_update(state_.get(), data, bytes); }
std::uint64_t ContentHash::value() const { return XXH3_64bits_digest(state_.get()); }
void ContentHash::Free::operator()(XXH3_state_s* state) const { XXH3_freeState(state); }

std::uint64_t file_hash(const std::filesystem::path& path)
{
    check_readable(path);
    const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    if (!file) throw file_error("can't be read", errno);
    ContentHash hash;
    constexpr std::size_t piece = std::size_t{1} << 20;
    const auto buffer = std::make_unique_for_overwrite<unsigned char[]>(piece);
    while (true) {
        const ssize_t count = ::read(file.number(), buffer.get(), piece);
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) throw file_error("can't be read", errno);
        if (count == 0) return hash.value();
        hash.add(buffer.get(), static_cast<std::size_t>(count));
    }
}

std::string hash_text(std::uint64_t hash) { return fmt::format("{:016x}", hash); }

}  // namespace rapid
