// Records of fixed size, one per point, as in .bgeo, .ply and .prt; or a record of one attribute, which is an array, as
// in .npz and .vtp.
//
// Columns are interleaved into records, and separated again, in parallel chunks. The records of a chunk stay in the
// cache until they are written, so writing costs little more than writing the same bytes from an array.
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
    // Narrow writes int64 as int32, Wide keeps it.
    enum Integers { Narrow, Wide };
    explicit RecordWriter(ByteOrder order, Integers integers = Narrow) : order_(order), integers_(integers) {}

    // Adds a column. Floats and int32 are unchanged; a string becomes its index in the file's table (text_table.h), an
    // int32. Throws Error if an int64 that must be narrowed does not fit; the message suggests .vdb and .csv.
    void add(const std::string& name, const AnyColumn& column);
    // Adds bytes, such as the members of a group.
    void add_bytes(const Column<std::uint8_t>& column);
    // Adds the same number to every record.
    void add_constant(float value);

    std::size_t record_bytes() const { return record_bytes_; }
    void write(OutputFile& file, std::uint64_t offset, std::size_t points) const;
    // Writes the records of the points [begin, end), shape [(end - begin) * record_bytes()].
    void interleave(std::size_t begin, std::size_t end, unsigned char* records) const;

private:
    // A column in the record.
    struct Part {
        enum Encoding { Words, Narrowed, Byte } encoding;
        const unsigned char* from;
        std::size_t stride;  // bytes between points; 0 for a uniform column
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
    std::vector<std::size_t> offsets;  // byte offsets of the numbers in the record
    bool group = false;
    double scale = 1;  // factor that converts integers to floats (colours stored as bytes)
};

// Records in memory, which must outlive it.
struct Records {
    std::span<const unsigned char> bytes;
    std::size_t points, stride;
    ByteOrder order;
};

// Sets an attribute of the points. Three floats, or three integers of P, become a vec3, four floats a quaternion. Other
// integers become int32, but id, unsigned 32-bit and wider ones become int64. Throws Error if an id is not an integer,
// or an integer exceeds int64.
void read_attribute(PointSet& points, const Records& records, const RecordAttribute& attribute);
// Assigns ids from 0, in order.
void number_points(PointSet& points);

// Reads points from records. Without an id, points are numbered from 0.
PointSet read_records(const Records& records, const std::vector<RecordAttribute>& attributes);

}  // namespace rapid
