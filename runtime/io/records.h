// Records of fixed size, one for each point, as in .bgeo, .ply and .prt; or a record of one attribute, which is an
// array, as in .npz and .vtp.
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
    // int64 is written as int32, or as it is.
    enum Integers { Narrow, Wide };
    explicit RecordWriter(ByteOrder order, Integers integers = Narrow) : order_(order), integers_(integers) {}

    // Floats and int32 unchanged; of a text the place in the file's table (text_table.h) is added, as an int32. Error:
    // an int64 that has to be narrowed and does not fit, naming .vdb and .csv.
    void add(const std::string& name, const AnyColumn& column);
    // Membership as a UInt8.
    void add_group(const Column<std::uint8_t>& members);
    // The same number in every record.
    void add_constant(float value);

    std::size_t record_bytes() const { return record_bytes_; }
    void write(OutputFile& file, std::uint64_t offset, std::size_t points) const;
    // The records of the points [begin, end), shape [(end - begin) * record_bytes()].
    void interleave(std::size_t begin, std::size_t end, unsigned char* records) const;

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
    Integers integers_;
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

// Records in memory, which must outlive it.
struct Records {
    std::span<const unsigned char> bytes;
    std::size_t points, stride;
    ByteOrder order;
};

// Sets an attribute of the points. Three floats become a vec3, four a quaternion; integers become int32; integers
// beyond 32 bits, unsigned 32-bit ones and id become int64. Error: an id that is not whole; an integer beyond int64.
void read_attribute(PointSet& points, const Records& records, const RecordAttribute& attribute);
// Ids from 0, in order.
void number_points(PointSet& points);

// Reads points from records. Without an id, points are numbered from 0.
PointSet read_records(const Records& records, const std::vector<RecordAttribute>& attributes);

}  // namespace rapid
