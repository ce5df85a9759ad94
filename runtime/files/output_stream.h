// A file as a stream, for libraries that write to one without checking for failure. The stream throws the file's own
// errors.
#pragma once

#include <ostream>
#include <streambuf>
#include <vector>

#include "runtime/files/output_file.h"

namespace rapid {

class OutputBuffer : public std::streambuf {
public:
    explicit OutputBuffer(OutputFile& file);

    void flush();

protected:
    int_type overflow(int_type c) override;
    int sync() override;
    pos_type seekoff(off_type offset, std::ios_base::seekdir direction, std::ios_base::openmode) override;
    pos_type seekpos(pos_type position, std::ios_base::openmode mode) override;

private:
    OutputFile& file_;
    std::vector<char> block_;
    std::uint64_t offset_ = 0;  // of the block in the file
    std::uint64_t end_ = 0;
};

// The caller must call flush() at the end, because a destructor can't report a full disk.
class OutputStream : public std::ostream {
public:
    explicit OutputStream(OutputFile& file) : std::ostream(nullptr), buffer_(file)
    {
        rdbuf(&buffer_);
        exceptions(badbit | failbit);  // rethrows the buffer's own error
    }

private:
    OutputBuffer buffer_;
};

}  // namespace rapid
