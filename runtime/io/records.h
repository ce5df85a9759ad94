// Records: one of the same size for each point, as .bgeo and .ply hold them.
//
// Columns are woven into records, and back, chunk by chunk in parallel; a chunk's records stay in cache until they are
// handed to the system, so that writing costs little more than writing the same bytes from one array.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "runtime/io/file.h"
#include "runtime/points/point_set.h"

namespace rapid {

enum class ByteOrder { Little, Big };
enum class ScalarType { Int8, UInt8, Int16, UInt16, Int32, UInt32, Float, Double };
std::size_t scalar_bytes(ScalarType type);

// Builds records out of columns, in the order of the calls. The columns must outlive it.
class RecordWriter {
public:
    explicit RecordWriter(ByteOrder order) : order_(order) {}

    // Floats and int32 as they are; int64 as int32. Error: one that does not fit, naming .vdb and .csv.
    void add(const std::string& name, const AnyColumn& column);
    // Membership as a UInt8.
    void add_group(const Column<std::uint8_t>& members);
    // The same number in every record.
    void add_constant(float value);

    std::size_t record_bytes() const { return record_bytes_; }
    void write(OutputFile& file, std::uint64_t offset, std::size_t points) const;

private:
    struct Part {
        enum Kind { Words, Narrowed, Byte } kind;
        const unsigned char* from;
        std::size_t stride;  // bytes from point to point; 0 where all share a value
        std::size_t words;
        std::size_t offset;  // in the record
    };
    void weave(const Part& part, std::size_t begin, std::size_t end, unsigned char* records) const;
    void push(Part::Kind kind, const void* from, std::size_t stride, std::size_t words, std::size_t bytes);

    ByteOrder order_;
    std::vector<Part> parts_;
    std::size_t record_bytes_ = 0;
    std::vector<std::unique_ptr<std::uint32_t>> constants_;
};

// An attribute in a record: numbers of one type at these places.
struct RecordAttribute {
    std::string name;
    ScalarType type;
    std::vector<std::size_t> offsets;  // bytes
    bool group = false;
    double scale = 1;  // floats are multiplied with it (colours held as bytes)
};

// The points of records of `stride` bytes. Three floats become a vec3, four a quaternion; integers become int32, or
// int64 where they may be larger and for id. Without an id, points are numbered from 0.
PointSet read_records(std::span<const unsigned char> records, std::size_t points, std::size_t stride, ByteOrder order,
                      const std::vector<RecordAttribute>& attributes);

}  // namespace rapid
