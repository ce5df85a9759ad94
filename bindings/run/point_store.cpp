#include "bindings/run/point_store.h"

#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <vector>

#include "runtime/files/file_error.h"

namespace rapid {
namespace {

// Of each frame: its number, points and columns; of each column: the length of its name and its type, the name, the
// values.
struct FrameHead {
    std::int64_t frame;
    std::uint64_t points, columns;
};
struct ColumnHead {
    std::uint64_t name_size;
    AttributeType type;
};

}  // namespace

PointStore::PointStore() : descriptor_(memfd_create("rapid study", MFD_CLOEXEC))
{
    if (descriptor_ < 0) throw file_error("no memory for the frames of the reference", errno);
}

PointStore::~PointStore() { close(descriptor_); }

void PointStore::clear()
{
    if (ftruncate(descriptor_, 0) != 0 || lseek(descriptor_, 0, SEEK_SET) != 0)
        throw file_error("the frames of the reference can't be replaced", errno);
}

void PointStore::keep(std::int64_t frame, const PointSet& points)
{
    const auto put = [this](const void* data, std::size_t bytes) {
        for (const char* at = static_cast<const char*>(data); bytes > 0;) {
            const ssize_t count = write(descriptor_, at, bytes);
            if (count < 0 && errno == EINTR) continue;
            if (count < 0) throw file_error("the frames of the reference can't be kept", errno);
            at += count;
            bytes -= static_cast<std::size_t>(count);
        }
    };
    const FrameHead head{frame, points.size(), points.columns().size()};
    put(&head, sizeof head);
    for (const auto& [name, any] : points.columns()) {
        const ColumnHead column_head{name.size(), type_of(any)};
        put(&column_head, sizeof column_head);
        put(name.data(), name.size());
        std::visit(
            [&](auto column) {  // a copy: writing expands one value to all
                const auto values = column.write();
                put(values.data(), values.size_bytes());
            },
            any);
    }
}

PointSet PointStore::read(std::int64_t frame, std::uint64_t& place) const
{
    const auto take = [&](void* data, std::size_t bytes) {
        for (char* at = static_cast<char*>(data); bytes > 0;) {
            const ssize_t count = pread(descriptor_, at, bytes, static_cast<off_t>(place));
            if (count < 0 && errno == EINTR) continue;
            if (count <= 0) throw Error(fmt::format("the reference has no frame {}", frame));
            at += count;
            bytes -= static_cast<std::size_t>(count);
            place += static_cast<std::uint64_t>(count);
        }
    };
    FrameHead head;
    take(&head, sizeof head);
    if (head.frame != frame) throw Error(fmt::format("the reference has no frame {}", frame));
    PointSet points;
    points.append(head.points);
    for (std::uint64_t i = 0; i < head.columns; ++i) {
        ColumnHead column_head;
        take(&column_head, sizeof column_head);
        std::string name(column_head.name_size, ' ');
        take(name.data(), name.size());
        AnyColumn any = column_of_type<AnyColumn>(static_cast<std::size_t>(column_head.type));
        std::visit(
            [&](auto& column) {
                const auto values = column.append_for_writing(head.points);
                take(values.data(), values.size_bytes());
            },
            any);
        points.set(name, std::move(any));
    }
    return points;
}

}  // namespace rapid
