#include "runtime/points/column_files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <cstdio>
#include <cstring>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

#include "runtime/base/error.h"

namespace rapid {
namespace {

using namespace std::chrono_literals;

struct Block {
    std::size_t bytes;
    int descriptor;
};

std::atomic<bool> in_use{false}, paused{false};
std::atomic<std::size_t> max_resident{0};
std::mutex blocks_mutex;
std::map<void*, Block> blocks;
std::filesystem::path blocks_folder;

Error failed(const char* what, int code)
{
    return Error(
        fmt::format("can't make a file for columns in \"{}\": {}: {}", blocks_folder.string(), what, strerror(code)));
}

int open_unnamed(const std::filesystem::path& folder)
{
    const int unnamed = open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
    if (unnamed >= 0) return unnamed;
    std::string name = (folder / ".rapid-columns-XXXXXX").string();
    const int named = mkostemp(name.data(), O_CLOEXEC);
    if (named < 0) throw failed("open", errno);
    unlink(name.c_str());
    return named;
}

// Reserves disk space in advance: a write to a mapped page on a full disk would kill the process.
void reserve(int descriptor, std::size_t bytes)
{
    if (const int code = posix_fallocate(descriptor, 0, static_cast<off_t>(bytes)); code != 0)
        throw failed("reserve", code);
}

// Returns the file and offset of an address, or the descriptor -1 if the address is in no mapped block.
std::pair<int, std::size_t> place_in_file(const void* address)
{
    if (!in_use) return {-1, 0};
    const std::lock_guard lock(blocks_mutex);
    const auto next = blocks.upper_bound(const_cast<void*>(address));
    if (next == blocks.begin()) return {-1, 0};
    const auto& [begin, block] = *std::prev(next);
    const auto offset = static_cast<std::size_t>(static_cast<const char*>(address) - static_cast<char*>(begin));
    if (offset >= block.bytes) return {-1, 0};
    return {block.descriptor, offset};
}

// Copies between memory and column values (`in_column`, which is `to` or `from`). Uses pread() or pwrite() if the
// column is in a file.
template <class Call>
void transfer(Call call, const char* what, const void* in_column, void* to, const void* from, std::size_t bytes)
{
    if (bytes == 0) return;
    const auto [descriptor, offset] = place_in_file(in_column);
    if (descriptor < 0) {
        std::memcpy(to, from, bytes);
        return;
    }
    void* const in_memory = in_column == to ? const_cast<void*>(from) : to;
    for (std::size_t done = 0; done < bytes;) {
        const ssize_t count =
            call(descriptor, static_cast<char*>(in_memory) + done, bytes - done, static_cast<off_t>(offset + done));
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) throw failed(what, count < 0 ? errno : EIO);
        done += static_cast<std::size_t>(count);
    }
}

// Returns the bytes of mapped files that are resident in memory. Called often: opening statm each time took 5 % of a
// merge.
std::size_t resident_of_files()
{
    static const int statm = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
    std::array<char, 128> text{};
    if (statm < 0 || pread(statm, text.data(), text.size() - 1, 0) <= 0) return 0;
    unsigned long shared = 0;
    if (std::sscanf(text.data(), "%*u %*u %lu", &shared) != 1) return 0;
    return shared * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

// Unmaps resident pages from this process. The system may still cache them or write them out.
void trim()
{
    if (resident_of_files() <= max_resident) return;
    const std::lock_guard lock(blocks_mutex);
    for (const auto& [begin, block] : blocks) madvise(begin, block.bytes, MADV_DONTNEED);
}

}  // namespace

// Trims in the background, for code that iterates over columns without calling trim_columns().
struct ColumnFiles::Trimmer {
    Trimmer() : thread([this] { run(); }) {}
    ~Trimmer()
    {
        {
            const std::lock_guard lock(mutex);
            ends = true;
        }
        changed.notify_one();
        thread.join();
    }

    void run()
    {
        std::unique_lock lock(mutex);
        while (!changed.wait_for(lock, 2ms, [this] { return ends; })) trim();
    }

    std::mutex mutex;
    std::condition_variable changed;
    bool ends = false;
    std::thread thread;  // must be the last member
};

ColumnFiles::ColumnFiles(const std::filesystem::path& folder, std::size_t resident)
{
    RAPID_ASSERT(!in_use);
    blocks_folder = folder.empty() ? "." : folder;
    max_resident = resident_of_files() + resident;
    trimmer_ = std::make_unique<Trimmer>();
    in_use = true;
}

ColumnFiles::~ColumnFiles()
{
    RAPID_ASSERT(blocks.empty());
    in_use = false;
}

PointSet ColumnFiles::moved(PointSet points)
{
    const auto move = []<class T>(Column<T>& column) {
        if (column.is_uniform()) return;
        Column<T> in_file(0, column.fallback());
        write_values(in_file.append_for_writing(column.size()).data(), std::as_const(column).read().data,
                     column.bytes());
        column = std::move(in_file);
    };
    for (const std::string& name : points.column_names()) std::visit(move, *points.find(name));
    for (const std::string& name : points.group_names()) move(points.group(name));
    return points;
}

ColumnFiles::Pause::Pause() { paused = true; }
ColumnFiles::Pause::~Pause() { paused = false; }

bool columns_lie_in_files() { return in_use; }

void trim_columns()
{
    if (in_use) trim();
}

void read_values(void* to, const void* from, std::size_t bytes) { transfer(pread, "read", from, to, from, bytes); }

void write_values(void* to, const void* from, std::size_t bytes) { transfer(pwrite, "write", to, to, from, bytes); }

void* map_in_file(std::size_t bytes)
{
    if (!in_use || paused) return nullptr;
    const int descriptor = open_unnamed(blocks_folder);
    try {
        reserve(descriptor, bytes);
        void* block = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
        if (block == MAP_FAILED) throw failed("map", errno);
        const std::lock_guard lock(blocks_mutex);
        blocks.emplace(block, Block{bytes, descriptor});
        return block;
    } catch (...) {
        close(descriptor);
        throw;
    }
}

bool resize_in_file(void*& block, std::size_t old_bytes, std::size_t bytes)
{
    if (!in_use) return false;
    const std::lock_guard lock(blocks_mutex);
    const auto found = blocks.find(block);
    if (found == blocks.end()) return false;
    reserve(found->second.descriptor, bytes);
    void* moved = mremap(block, old_bytes, bytes, MREMAP_MAYMOVE);
    if (moved == MAP_FAILED) throw failed("map", errno);
    const Block grown{bytes, found->second.descriptor};
    blocks.erase(found);
    blocks.emplace(moved, grown);
    block = moved;
    return true;
}

bool unmap_in_file(void* block, std::size_t bytes)
{
    if (!in_use) return false;
    const std::lock_guard lock(blocks_mutex);
    const auto found = blocks.find(block);
    if (found == blocks.end()) return false;
    munmap(block, bytes);
    close(found->second.descriptor);
    blocks.erase(found);
    return true;
}

}  // namespace rapid
