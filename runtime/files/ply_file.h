// PLY files for points and meshes, ascii or binary in either byte order: the header, then the elements in file order.
//
// Nothing in a file is trusted: counts are checked against its size before memory is allocated, and numbers against
// their types. Errors do not contain the file's name; the caller adds it.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/files/scalars.h"

namespace rapid {

struct PlyProperty {
    std::string name;
    ScalarType type = ScalarType::Float;
    bool list = false;
    ScalarType count_type = ScalarType::UInt8;
};

struct PlyElement {
    std::string name;
    std::size_t count = 0;
    std::vector<PlyProperty> properties;

    bool has_lists() const;
    std::size_t stride() const;  // bytes of its scalar properties and of the counts of its lists
};

// The rows of an element without lists.
struct PlyRecords {
    std::span<const unsigned char> bytes;
    std::size_t stride;
    ByteOrder order;
    std::vector<unsigned char> parsed;  // storage for values from an ascii file
};

class PlyFile {
public:
    // `text` must outlive the object. Throws Error if the header is missing or wrong.
    explicit PlyFile(std::string_view text);

    const std::vector<PlyElement>& elements() const { return elements_; }

    // Elements must be read or skipped in order, all of them, because a file may be truncated in its last one.
    PlyRecords read_records(const PlyElement& element);
    void read_lists(const PlyElement& element, std::size_t property,
                    const std::function<void(std::span<const std::int64_t> list)>& row);
    // Returns a scalar property of the row whose list is being passed to `row`.
    double number_of_row(std::size_t property) const { return numbers_[property]; }
    void pass_over(const PlyElement& element);

private:
    enum class Encoding { Ascii, Little, Big };

    void read_header();
    void read_line(const std::vector<std::string>& words);
    ByteOrder order() const { return encoding_ == Encoding::Big ? ByteOrder::Big : ByteOrder::Little; }
    void check_promise(const PlyElement& element) const;
    double parse_number(const PlyElement& element, std::size_t row, const PlyProperty& property, ScalarType type);
    double take_number(const PlyElement& element, std::size_t row, const PlyProperty& property, ScalarType type);

    std::string_view text_;
    std::size_t at_ = 0;
    Encoding encoding_ = Encoding::Ascii;
    std::vector<PlyElement> elements_;
    std::vector<double> numbers_;  // of the current row in read_lists()
};

}  // namespace rapid
