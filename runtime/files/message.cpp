#include "runtime/files/message.h"

#include <new>

#include "runtime/base/error.h"

namespace rapid {

void MessageWriter::put_bytes(const void* from, std::size_t bytes)
{
    if (bytes > memory_.size() - at_) throw std::bad_alloc();
    if (bytes > 0) std::memcpy(memory_.data() + at_, from, bytes);
    at_ += bytes;
}

void MessageWriter::put_text(const std::string& text)
{
    put(text.size());
    put_bytes(text.data(), text.size());
}

void MessageReader::check_left(std::size_t count, std::size_t bytes) const
{
    if (count > (memory_.size() - at_) / bytes) throw Error("can't be read: the reader failed, so the file is damaged");
}

const unsigned char* MessageReader::take_bytes(std::size_t count, std::size_t bytes)
{
    check_left(count, bytes);
    const unsigned char* taken = memory_.data() + at_;
    at_ += count * bytes;
    return taken;
}

std::string MessageReader::take_text()
{
    const auto size = take<std::size_t>();
    const unsigned char* from = take_bytes(size, 1);
    return {from, from + size};
}

}  // namespace rapid
