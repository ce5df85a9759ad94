// Records of fixed size, one for each point, as in .bgeo and .ply.
//
// Columns are interleaved into records, and separated again, chunk by chunk in parallel. The records of a chunk stay in
// cache until they are written, so that writing costs little more than writing the same bytes from an array.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "runtime/files/output_file.h"
#include "runtime/files/scalars.h"
#include "runtime/points/point_set.h"

namespace rapid {

// Interleaves columns, in the order of the calls. The columns must outlive it.
class RecordWriter {
public:
    explicit RecordWriter(ByteOrder order) : order_(order) {}

    // Floats and int32 unchanged; int64 as int32. Error: a value that does not fit, naming .vdb and .csv.
    void add(const std::string& name, const AnyColumn& column);
    // Membership as a UInt8.
    void add_group(const Column<std::uint8_t>& members);
    // The same number in every record.
    void add_constant(float value);

    std::size_t record_bytes() const { return record_bytes_; }
    void write(OutputFile& file, std::uint64_t offset, std::size_t points) const;

private:
    // A column in the record.
    struct Part {
        enum Encoding { Words, Narrowed, Byte } encoding;
        const unsigned char* from;
        std::size_t stride;  // bytes from point to point; 0 for a uniform column
        std::size_t words;
        std::size_t offset;  // in the record
    };
    void interleave(const Part& part, std::size_t begin, std::size_t end, unsigned char* records) const;
    void push(Part::Encoding encoding, const void* from, std::size_t stride, std::size_t words, std::size_t bytes);

    ByteOrder order_;
    std::vector<Part> parts_;
    std::size_t record_bytes_ = 0;
    std::vector<std::unique_ptr<std::uint32_t>> constants_;
};

// An attribute in a record: numbers of one type.
struct RecordAttribute {
    std::string name;
    ScalarType type;
    std::vector<std::size_t> offsets;  // of the numbers in the record, bytes
    bool group = false;
    double scale = 1;  // factor, which makes integers floats (colours stored as bytes)
};

// Reads points from records of `stride` bytes. Three floats become a vec3, four a quaternion; integers become int32;
// unsigned 32-bit integers and id become int64. Without an id, points are numbered from 0. Error: an id that is not
// whole.
PointSet read_records(std::span<const unsigned char> records, std::size_t points, std::size_t stride, ByteOrder order,
                      const std::vector<RecordAttribute>& attributes);

}  // namespace rapid
