// Columns that are larger than memory: while one of these lives, the blocks of large columns (buffer.h) are unnamed
// files, mapped. The system may write their pages out, and what of them is in memory is kept below a limit; values stay
// as they are.
//
// For one process that does one thing, as `rapid merge` does: the setting is that of the process.
#pragma once

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <memory>

#include "runtime/points/point_set.h"

namespace rapid {

class ColumnFiles {
public:
    // folder: of the files, on a disk with room for the columns. resident: bytes that may be in memory.
    ColumnFiles(const std::filesystem::path& folder, std::size_t resident);
    // The columns that were made while it lived must be gone.
    ~ColumnFiles();
    ColumnFiles(const ColumnFiles&) = delete;
    ColumnFiles& operator=(const ColumnFiles&) = delete;

    // The same points, with their large columns in files.
    static PointSet moved(PointSet points);
    // While one of these lives, new columns are in memory all the same: those that are soon gone.
    class Pause;

private:
    struct Trimmer;
    std::unique_ptr<Trimmer> trimmer_;
};

class ColumnFiles::Pause {
public:
    Pause();
    ~Pause();
    Pause(const Pause&) = delete;
    Pause& operator=(const Pause&) = delete;
};

// Whether a ColumnFiles lives: large columns are then best read and written in their order.
bool columns_lie_in_files();
// Between two stretches of columns that are gone over in their order: what is in memory of them is taken back at once
// if it is too much. From any thread; nothing where no ColumnFiles lives.
void trim_columns();

// From and to values of a column, wherever they lie; those of the column in one block. In a file these are a read and a
// write of the file: through its mapping each page would be a fault, and stay in memory. Error: the file can't be read
// or written.
void read_values(void* to, const void* from, std::size_t bytes);
void write_values(void* to, const void* from, std::size_t bytes);
// The values of `size` points from `begin` on.
template <class T>
void read_values(T* to, const Strided<T>& column, std::size_t begin, std::size_t size)
{
    if (column.stride == 0)
        std::fill_n(to, size, *column.data);
    else
        read_values(to, column.data + begin, size * sizeof(T));
}

// For Buffer: whole pages in a file; null where no ColumnFiles lives. Error: no room.
void* map_in_file(std::size_t bytes);
// Whether a block is one of those; then it is of the new size, and may be elsewhere: in `block`. Error: no room.
bool resize_in_file(void*& block, std::size_t old_bytes, std::size_t bytes);
// Whether a block is one of those; then it is gone.
bool unmap_in_file(void* block, std::size_t bytes);

}  // namespace rapid
