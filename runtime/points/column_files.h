// Columns larger than memory. While a ColumnFiles exists, large blocks of columns (buffer.h) are mappings of unnamed
// files. The system may write their pages out, and their resident memory is held below a limit. Values are unaffected.
//
// The setting is process-wide, for processes with a single task such as `rapid merge`.
#pragma once

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <memory>

#include "runtime/points/point_set.h"

namespace rapid {

class ColumnFiles {
public:
    // folder: location of the files, on a disk with room for the columns. resident: limit for bytes in memory.
    ColumnFiles(const std::filesystem::path& folder, std::size_t resident);
    // Columns created during its lifetime must be destroyed first.
    ~ColumnFiles();
    ColumnFiles(const ColumnFiles&) = delete;
    ColumnFiles& operator=(const ColumnFiles&) = delete;

    // Returns the same points, with their large columns in files.
    static PointSet moved(PointSet points);
    // Makes new columns live in memory during its lifetime. For short-lived columns.
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

// Returns true if a ColumnFiles exists. Large columns are then best read and written in order.
bool columns_lie_in_files();
// Releases resident pages if they exceed the limit. Call it between sections of a sequential pass over columns, from
// any thread. Does nothing if no ColumnFiles exists.
void trim_columns();

// Copy column values to or from memory. The column's values must be in one block. For a block in a file they read and
// write the file directly: access through the mapping would fault on each page and leave it in memory. Throws Error if
// the file can't be read or written.
void read_values(void* to, const void* from, std::size_t bytes);
void write_values(void* to, const void* from, std::size_t bytes);
// Reads the values of `size` points, starting at `begin`.
template <class T>
void read_values(T* to, const Strided<T>& column, std::size_t begin, std::size_t size)
{
    if (column.stride == 0)
        std::fill_n(to, size, *column.data);
    else
        read_values(to, column.data + begin, size * sizeof(T));
}

// Returns whole pages mapped from a file, for Buffer. Null if no ColumnFiles exists. Throws Error if the disk is full.
void* map_in_file(std::size_t bytes);
// Resizes a mapped block, which may move (`block` is updated). Returns false if the block is not mapped from a file.
// Throws Error if the disk is full.
bool resize_in_file(void*& block, std::size_t old_bytes, std::size_t bytes);
// Unmaps a block. Returns false if the block is not mapped from a file.
bool unmap_in_file(void* block, std::size_t bytes);

}  // namespace rapid
