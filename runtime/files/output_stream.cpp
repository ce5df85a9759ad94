#include "runtime/files/output_stream.h"

#include <algorithm>

namespace rapid {

OutputBuffer::OutputBuffer(OutputFile& file) : file_(file), block_(std::size_t{1} << 20)
{
    setp(block_.data(), block_.data() + block_.size());
}

void OutputBuffer::flush()
{
    file_.write_at(offset_, pbase(), static_cast<std::size_t>(pptr() - pbase()));
    offset_ += static_cast<std::uint64_t>(pptr() - pbase());
    setp(block_.data(), block_.data() + block_.size());
}

OutputBuffer::int_type OutputBuffer::overflow(int_type c)
{
    flush();
    if (!traits_type::eq_int_type(c, traits_type::eof())) sputc(traits_type::to_char_type(c));
    return traits_type::not_eof(c);
}

int OutputBuffer::sync()
{
    flush();
    return 0;
}

OutputBuffer::pos_type OutputBuffer::seekoff(off_type offset, std::ios_base::seekdir direction, std::ios_base::openmode)
{
    const std::uint64_t here = offset_ + static_cast<std::uint64_t>(pptr() - pbase());
    end_ = std::max(end_, here);
    if (direction == std::ios_base::cur && offset == 0) return pos_type(static_cast<off_type>(here));
    const off_type base = direction == std::ios_base::beg   ? 0
                          : direction == std::ios_base::cur ? static_cast<off_type>(here)
                                                            : static_cast<off_type>(end_);
    flush();
    offset_ = static_cast<std::uint64_t>(base + offset);
    return pos_type(base + offset);
}

OutputBuffer::pos_type OutputBuffer::seekpos(pos_type position, std::ios_base::openmode mode)
{
    return seekoff(off_type(position), std::ios_base::beg, mode);
}

}  // namespace rapid
