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
    PlyElement without_lists() const;
};

// Returns the factor for a colour that is stored as an integer: 1 for the largest value of 16 unsigned bits, or for
// 255, which other integers hold as well.
double colour_scale(ScalarType type);

// The rows of an element, without its lists.
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
    // Returns true if the file ends with a number that may be cut short, because no newline follows it.
    bool ends_within_number() const { return ends_within_number_; }

    // Elements must be read or skipped in order, all of them, because a file may be truncated in its last one.
    PlyRecords read_records(const PlyElement& element);  // skips lists
    void read_lists(const PlyElement& element, std::size_t property,
                    const std::function<void(std::span<const std::int64_t> list)>& row);
    // Returns a scalar property of the row whose list is being passed to `row`.
    double number_of_row(std::size_t property) const { return numbers_[property]; }
    void pass_over(const PlyElement& element);

private:
    enum class Encoding { Ascii, Little, Big };

    void read_header();
    std::string_view take_line(std::string_view line_end);
    void read_line(const std::vector<std::string>& words);
    ByteOrder order() const { return encoding_ == Encoding::Big ? ByteOrder::Big : ByteOrder::Little; }
    void check_promise(const PlyElement& element) const;
    std::size_t take_count(const PlyElement& element, std::size_t row, const PlyProperty& list);
    void skip_list(const PlyElement& element, std::size_t row, const PlyProperty& list, std::size_t count);
    double parse_number(const PlyElement& element, std::size_t row, const PlyProperty& property, ScalarType type);
    double take_number(const PlyElement& element, std::size_t row, const PlyProperty& property, ScalarType type);

    std::string_view text_;
    std::size_t at_ = 0;
    bool ends_within_number_ = false;
    Encoding encoding_ = Encoding::Ascii;
    std::vector<PlyElement> elements_;
    std::vector<double> numbers_;  // of the current row in read_lists()
};

}  // namespace rapid
