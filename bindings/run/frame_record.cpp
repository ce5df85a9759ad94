#include "bindings/run/frame_record.h"

#include <sys/stat.h>

namespace rapid {

bool WrittenFile::look()
{
    struct stat status = {};
    if (::stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return false;
    bytes = static_cast<std::uint64_t>(status.st_size);
    modified = std::int64_t{status.st_mtim.tv_sec} * 1'000'000'000 + status.st_mtim.tv_nsec;
    return true;
}

bool WrittenFile::is_whole() const
{
    WrittenFile now;
    now.path = path;
    return now.look() && now.bytes == bytes && now.modified == modified;
}

}  // namespace rapid
